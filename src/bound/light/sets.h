/* Where in a block a light sets: on which pixels N.L does not change its sign. */
#pragma once

#include <stdint.h>

#include "plan/bend.h"
#include "plan/plan.h"

/* N.L at x pixels to the right of a part's middle and y below it is `middle` + x `right` + y
 * `down`, to within half of `second` times x x + y y, as far as `side` / 2 + SHD_FRINGE. */
typedef struct shd_setting {
    double middle, right, down, second;
    int side; /* pixels */
} shd_setting;

/* False: it is not known. */
bool shd_find_setting(const shd_analytic *a, const shd_plan_light *light, shd_setting *out);

/* The pixels, as bits row by row, with N.L above 0, or below 0, in all places that are no more than
 * `reach` <= SHD_FRINGE to a side and above or below their centers. */
uint64_t shd_off_setting(const shd_setting *set, double reach);
