/* Lights that have a place, in boxes within boxes, and the directional ones: what tells that all of
 * them are clear of a plane, or far from an object. Inside of plan/. */
#pragma once

#include "plan/parts.h"

/* Lights that are not divided further. */
enum { SHD_TOGETHER = 16 };

/* Places, or directions, by coordinates. SHD_TOGETHER may be read from each of them on. */
typedef struct shd_rows {
    double *x, *y, *z;
    uint32_t *lights;
    size_t count;
} shd_rows;

/* Lights that lie together: a box around them. What a bundle consists of follows it. */
typedef struct shd_bundle {
    shd_vec3 low, high;
    shd_vec3 middle, half; /* of the box, to rounding */
    double away;           /* no light is farther from (0,0,0), by the sum of coordinates */
    size_t first, count;
    size_t next; /* the bundle that is not within it */
} shd_bundle;

typedef struct shd_bundles {
    shd_rows placed; /* in the order of their bundles */
    shd_rows far;    /* directional ones */
    shd_bundle *list;
    size_t count;
} shd_bundles;

/* Makes the bundles of the plan's lights, if there are none yet: `out` begins as zeros. False:
 * memory. */
bool shd_bundles_need(const shd_plan *plan, shd_arena *arena, shd_bundles *out);

/* At least the length, without a root. */
static inline double shd_length_at_most(shd_vec3 v) {
    return (fabs(v.x) + fabs(v.y) + fabs(v.z)) * (1 + 1e-9);
}
