/* How far rays from mirrors and glass drift from where exact arithmetic has them. Inside of bound/.
 */
#pragma once

#include "plan/plan.h"
#include "plan/tier.h"

/* Cosines of a path: of the angles at which its rays meet surfaces, and leave them refracted. What
 * is told holds for paths whose cosines multiply to `least` or more. At a hit with N.V = c, its
 * product with those before it being p, rays are beside by `beside` / p, points by that over c, and
 * directions are turned by `turned` / p: lengths of the world, and chords of unit vectors. */
typedef struct shd_drift {
    double beside, turned, least;
    bool known; /* false: `least` would be above SHD_LEAST_PATH */
} shd_drift;

static const double SHD_LEAST_PATH = 1e-3;

enum { SHD_DRIFTS = 17 };

/* Of the lengths on the way to a hit. Roots of quartics and seams of meshes have some more of it
 * than hits of the eye's rays. */
static const double SHD_DRIFT_ROUNDING = 4 * SHD_HIT_ROUNDING;

/* How large a scene is to the rays that go on in it. */
typedef struct shd_extent {
    shd_vec3 middle; /* of what is bounded */
    double wide;     /* the longest way between two hits, but for what a low angle to a plane makes
                        of it */
    double sizes;    /* the lengths on the way to a hit: see sight/tie.h */
} shd_extent;

shd_extent shd_extent_of(const shd_plan *plan);

/* The drifts of rays after 0 .. trace.depth steps. Their proof is in drift.c. */
void shd_find_drifts(const shd_plan *plan, const shd_extent *extent, shd_drift out[SHD_DRIFTS]);
