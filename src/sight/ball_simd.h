/* Where rays meet balls: spheres that stay spheres, in units of their radius. Inside of sight/. */
#pragma once

#include "sight/batch.h"

/* Where a ray meets a ball. */
typedef struct shd_ball_hit {
    double t;    /* in radii; infinity: missed */
    double side; /* minus or plus half the chord: from the foot, where the ray is nearest */
    shd_vec3 at;
} shd_ball_hit;

/* The discriminant is made from the distance of the line to the center, so that nothing cancels
 * (Haines et al., "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, chapter
 * 7). From far away, a second step takes out the foot's rounding errors along the ray. */
SHD_INLINE shd_ball_hit shd_meet_ball(shd_vec3 origin, shd_vec3 ray, bool far) {
    double along = shd_dot(origin, ray);
    shd_vec3 foot = shd_sub(origin, shd_scale(ray, along));
    if (far) {
        double more = shd_dot(foot, ray);
        foot = shd_sub(foot, shd_scale(ray, more));
        along += more;
    }
    double inside = 1 - shd_dot(foot, foot);
    double half = sqrt(inside);
    double side = -along - half > SHD_BLIND ? -half : half;
    double t = side - along;
    t = t > SHD_BLIND ? t : INFINITY;
    return (shd_ball_hit){inside >= 0 ? t : INFINITY, side, shd_madd(foot, ray, side)};
}

/* Calls a function that is compiled for each kind of camera and distance. */
#define SHD_FOR_BALL(b, far, function, ...)                                                        \
    if ((b)->orthographic)                                                                         \
        function(__VA_ARGS__, true, true);                                                         \
    else if (far)                                                                                  \
        function(__VA_ARGS__, false, true);                                                        \
    else                                                                                           \
        function(__VA_ARGS__, false, false)

SHD_INLINE shd_ball_hit shd_meet_lane(const shd_seen_ball *own, const shd_batch *b, int i,
                                      bool orthographic, bool far) {
    shd_vec3 origin = own->eye;
    if (orthographic) origin = shd_madd(origin, shd_lane(b->start, i), 1 / own->size);
    return shd_meet_ball(origin, shd_lane(b->direction, i), far);
}
