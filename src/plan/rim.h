/* How what is seen past the rim of a ball is told: by shd_sight_rim, for sketches. */
#pragma once

#include "base/vec3.h"

/* A block through which a ball's rim may be seen, by rays (shd_block_rays) of which `middle` is the
 * place nearest to the center on the middle one. */
typedef struct shd_rim {
    size_t object;         /* nothing else can be seen */
    shd_vec3 point;        /* that place, in the world */
    double moved;          /* no point that is seen is farther from there, in the world */
    double cosine, turned; /* N.V is no more, and no ray's direction is off the middle's by more */
    /* (N.w)^2 of the ray w through (x, y), which misses the ball where that is negative, is a sum
     * of these times 1, x, y, x^2, x y and y^2; and what they, times the most of these, sum up to.
     */
    double square[6], least, rest; /* |square[0]|, and of the others */
    double off; /* more than f64 rounds that sum by, here or where rays are cast */
} shd_rim;
