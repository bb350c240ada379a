/* Lights drawn at random, and what they send, for tests of far light. */
#pragma once

#include "shade/far.h"

/* Of potentials. */
enum { DEGREES = 3 };
static const int degrees[DEGREES] = {3, 4, 6};

static inline double uniform(uint64_t *random, double low, double high) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(*random >> 11) * 0x1p-53);
}

static inline shd_vec3 any_direction(uint64_t *random) {
    shd_vec3 v;
    do v = (shd_vec3){uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
    while (!(shd_dot(v, v) < 1 && shd_normalize(v, &v)));
    return v;
}

static inline shd_plan_light any_light(uint64_t *random, int kind, double distance) {
    shd_plan_light light = {.color = {1, 1, 1}, .gain = 1};
    const shd_vec3 toward = any_direction(random);
    light.position = shd_scale(toward, distance);
    light.toward = toward;
    light.directional = kind == 0;
    light.attenuated = kind > 1;
    light.a = kind == 1 || kind >= 4 ? 1 : 0;
    light.b = kind == 2 ? 1 : kind >= 4 ? uniform(random, 0, 1) : 0;
    light.c = kind == 3 ? 1 : kind >= 4 ? uniform(random, 0, 1) : 0;
    if (kind == 5) light.a = uniform(random, 0, 0.1);
    light.gain = uniform(random, 0.5, 2);
    return light;
}

/* E of the model. */
static inline shd_vec3 field_of(const shd_plan_light *light, shd_vec3 at) {
    if (light->directional) return light->toward;
    const shd_vec3 path = shd_sub(light->position, at);
    const double d = shd_length(path);
    return shd_scale(path, shd_attenuation(light, d) / d);
}

enum { KINDS = 6, POINTS = 13, CROWD = 90 };

/* Lamps in a ball of radius 1 about `middle`, all of which fall off alike. */
static inline void make_crowd(uint64_t *random, int kind, shd_vec3 middle, shd_plan_light *lights) {
    const shd_plan_light as = any_light(random, kind, 1);
    for (size_t j = 0; j < CROWD; j++) {
        lights[j] = as;
        lights[j].gain = uniform(random, 0.5, 2);
        lights[j].position =
            shd_madd(middle, any_direction(random), pow(uniform(random, 0, 1), 1.0 / 3));
        for (int c = 0; c < 3; c++) lights[j].color[c] = uniform(random, 0, 1);
    }
}
