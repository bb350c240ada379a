/* Lights with a shape as vectors of points see them: what rectangles and circles have in common.
 * Only for area_simd.h and circle_simd.h. */
#pragma once

#include <math.h>

#include "base/cpu.h"
#include "shade/area.h"
#include "shade/models_simd.h"

/* Below this, sums along the boundary lose digits (area.c). */
static const double SMALL_SHAPE = 0.01;

/* The way from points to a light's middle. */
typedef struct sighting {
    shd_vd path[3], distance;
    shd_vd ahead; /* of the point before a flat shape */
    shd_vd slack; /* lengths up to this may be rounding */
    shd_md held;  /* nothing is beyond f64; other lanes mean nothing */
} sighting;

SHD_INLINE sighting find_middle(const shd_light *light, const points *at, double scale) {
    const double place[3] = {light->position.x, light->position.y, light->position.z},
                 down[3] = {light->direction.x, light->direction.y, light->direction.z};
    sighting m = {.ahead = shd_vd_set(0)};
    shd_vd p[3];
    for (int c = 0; c < 3; c++) {
        p[c] = at->p[c] * shd_vd_set(1 / scale);
        m.path[c] = shd_vd_set(place[c]) - p[c];
        m.ahead -= m.path[c] * shd_vd_set(down[c]);
    }
    const shd_vd squared = dot_lanes(m.path, m.path), origin = dot_lanes(p, p),
                 farthest = shd_vd_set(FARTHEST2);
    m.distance = shd_vd_sqrt(squared);
    m.slack =
        shd_vd_set(16 * 0x1p-52) * (shd_vd_set(shd_length(light->position)) + shd_vd_sqrt(origin));
    m.held = shd_vd_gt_in(shd_vd_gt_in(shd_vd_gt(squared, shd_vd_set(NEAREST2)), farthest, squared),
                          farthest, origin);
    return m;
}

/* At least the largest L.W over a cone of directions around the shape's middle. */
SHD_INLINE shd_vd most_of(const shd_vd w[3], const shd_vd toward[3], shd_vd size) {
    const shd_vd zero = shd_vd_set(0), one = shd_vd_set(1), z = dot_lanes(w, toward),
                 cosine = shd_vd_sqrt(shd_vd_max((one - size) * (one + size), zero)),
                 sine = shd_vd_sqrt(shd_vd_max((one - z) * (one + z), zero));
    const shd_md beside = shd_vd_gt_in(shd_vd_gt(one, size), cosine, z);
    return shd_vd_select(beside, z * cosine + sine * size, one);
}

/* Up to this, the n-th power is less than e^-40. */
SHD_INLINE double faint_of(double n) {
    return n > 0 ? exp(-40 / n) : -2;
}
