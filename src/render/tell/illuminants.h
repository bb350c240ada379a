/* Which illuminant makes two materials of a spectral scene differ. */
#pragma once

#include <jansson.h>

#include "plan/plan.h"

/* For each named illuminant, the pair of materials whose diffuse colors differ by more under it
 * than under D65, by the most:
 *
 *     {"worst": PAIR, "each": [PAIR ...]}, a PAIR being
 *     {"illuminant": "F2", "materials": ["a", "b"], "deltaE2000": 7.1, "underD65": 0.02}
 *
 * Colors are CIELAB with the illuminant as white. The first 64 materials that are diffuse count.
 * null: there are not two. NULL: memory, or cancelled. The plan is spectral. */
json_t *shd_tell_illuminants(const shd_plan *plan, shd_arena *arena);
