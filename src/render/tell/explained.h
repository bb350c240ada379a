/* The plan as JSON: what is used, what is left out and why, the bounds, the costs. */
#pragma once

#include "render/tell/words.h"

/* The answer of /v1/explain. Takes the reference to `words`, a member of it. NULL: memory. */
json_t *shd_tell_explained(const shd_explained *e, json_t *words);
