/* What is seen of an environment behind all objects. */
#pragma once

#include "scene/scene.h"

/* A direction of the world in the map's frame, which is turned about +y. */
static inline shd_vec3 shd_to_map(const shd_light *environment, shd_vec3 d) {
    const double c = cos(environment->turn), s = sin(environment->turn);
    return (shd_vec3){c * d.x - s * d.z, d.y, s * d.x + c * d.z};
}

/* A color of the map in the working space. */
static inline void shd_from_map(const shd_light *environment, const double rgb[3], double out[3]) {
    for (int k = 0; k < 3; k++)
        out[k] = environment->of_map[k][0] * rgb[0] + environment->of_map[k][1] * rgb[1] +
                 environment->of_map[k][2] * rgb[2];
}

/* Radiance along a unit direction, in the working space. */
void shd_backdrop_at(const shd_light *environment, shd_vec3 direction, double rgb[3]);
