/* A light as the plan has it, and what it sends where. */
#pragma once

#include "base/vec3.h"
#include "plan/tier.h"

/* An angle in [0, pi], by its cosine and sine. */
typedef struct shd_angle {
    double cosine, sine;
} shd_angle;

/* A light that reaches surfaces: directional, point or spot, with a color that is not black. */
typedef struct shd_plan_light {
    size_t index;     /* in shd_scene.lights */
    bool directional; /* no position, no attenuation */
    bool attenuated;  /* false: attenuation is the constant `gain` */
    bool spot;
    shd_vec3 position; /* point, spot */
    shd_vec3 toward;   /* directional: unit vector from any surface to the light */
    shd_vec3 axis;     /* spot: unit vector along which it shines */
    double color[3];   /* Il */
    double a, b, c;    /* attenuation's terms, divided by the largest */
    double gain;       /* 1 / that largest term */
    double min_distance;
    /* A spot's cones, as 1 - cos of the half-angle. |axis + L|^2 / 2 is compared with these,
     * because cosines cancel near the axis and chords do not. inner <= outer <= 2. */
    double outer, inner;
    double exponent;
    shd_angle cone;          /* spot: its half-angle, or less, beyond which there is no light */
    bool steep;              /* too steep for f32: a narrow fade, a high exponent, or one below 1 */
    const double (*bins)[3]; /* of plan->bins; NULL: the light is RGB, which is `color` */
    const struct shd_light *shape; /* the scene's light, if it has a shape; else NULL */
    /* The scene's light if it is an environment, and its number among these; else NULL. It counts
     * as directional, from nowhere. */
    const struct shd_light *environment;
    size_t around;
} shd_plan_light;

/* Whether the light's cone ends without a penumbra. Light jumps there, so that f32 may not decide
 * on which side a point is. */
static inline bool shd_has_hard_rim(const shd_plan_light *light) {
    return light->spot && !(light->outer > light->inner);
}

/* The attenuation f at a surface point at the distance. */
static inline double shd_attenuation(const shd_plan_light *light, double distance) {
    if (!light->attenuated) return light->gain;
    const double d = distance > light->min_distance ? distance : light->min_distance;
    const double f = light->gain / (light->a + d * (light->b + d * light->c));
    return f < SHD_LARGEST_FALL ? f : SHD_LARGEST_FALL;
}

/* The share of light that a cone's penumbra leaves at `q`, 1 - cos of the angle from the axis. */
static inline double shd_penumbra(const shd_plan_light *light, double q) {
    if (q > light->outer) return 0;
    if (!(q > light->inner)) return 1;
    const double x = (light->outer - q) / (light->outer - light->inner);
    return x * x * (3 - 2 * x);
}
