/* Tells of a plan. Inside of render/. */
#ifndef SHD_RENDER_TELL_EXPLAIN_H
#define SHD_RENDER_TELL_EXPLAIN_H

#include <jansson.h>

#include "plan/plan.h"

/* A bound in JSON. What is not known is null. */
json_t *shd_tell_bound(const shd_bound *bound);

#endif
