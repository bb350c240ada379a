/* How far rounding has put a ray beside where exact arithmetic has it: an error analysis that runs
 * along with each path. bound/light/drift.c has the same by planning, for all paths at once.
 *
 * A ray that is beside by q, and off the surface by what f64 makes of its hit, meets a surface at
 * N.V = c in a point that is beside by 1.1 q / c along it, if c^2 >= 8 k q, where k is by how much
 * the surface bends for each length. That turns the normal by k times as much. Mirrors turn rays by
 * twice what the normal is turned by; what glass does is the derivative of Snell's law:
 *
 *     |out'| <= eta |d'| + eta |1 - eta c / s| (|d'| + |N'|) + |s - eta c| |N'|
 *
 * with s the cosine behind the surface, if s^2 is four times what it changes by. Other rays are
 * lost: they are on a silhouette, or on the edge of total reflection, to within what they are off
 * by, and may bring anything. Rays that pass another edge as near (a silhouette that they miss, the
 * end of a light or of a shadow) may have met its other side, which nothing here knows. */
#pragma once

#include "plan/paths.h"

typedef struct shd_stray_ray {
    double beside; /* a length across the ray */
    double turned; /* a chord */
    bool lost;
} shd_stray_ray;

/* Where such a ray has met a surface. */
typedef struct shd_stray_hit {
    shd_stray_ray ray;
    double moved, normal; /* of the point, along the surface, and of the normal: a chord */
    double place;         /* what lights see of `moved`, over strays->wide */
} shd_stray_hit;

/* After `length` on its way, at an object that is met at the cosine `facing` of its own normal. */
shd_stray_hit shd_stray_meet(const shd_strays *strays, const shd_stray_ray *ray, double length,
                             size_t object, double facing);

/* How far off the light of the hit is in any channel, which is seen at N.V = `view`. Not of rays
 * that are lost. */
double shd_stray_error(const shd_strays *strays, const shd_stray_hit *hit, size_t object,
                       double view);

/* The rays that leave the hit, `out` being the cosine by which that is steep. */
shd_stray_ray shd_stray_mirrored(const shd_stray_hit *hit, double out);
shd_stray_ray shd_stray_straight(const shd_stray_hit *hit);

/* `in` and `behind`: the cosines before and behind the surface. */
shd_stray_ray shd_stray_refracted(const shd_stray_hit *hit, double eta, double in, double behind,
                                  double out);

/* Whether f64 may be wrong about what the surface refracts at all: 1 - eta^2 (1 - in^2). */
bool shd_stray_turns(const shd_stray_hit *hit, double eta, double in);
