/* What is told, in JSON. */
#pragma once

#include <jansson.h>

#include "plan/plan.h"

json_t *shd_tell_number(double value); /* null if it is not finite */
json_t *shd_tell_bound(const shd_bound *bound);

/* Takes the reference to `json`, which was made since shd_json_memory_watch, and prints it. NULL:
 * memory, or `cancelled` (or NULL) was raised. */
char *shd_tell_print(json_t *json, unsigned digits, const atomic_bool *cancelled);
