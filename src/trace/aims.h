/* The points of a light with a shape that shadows look at (trace/shadows.h), as a surface point
 * sees them: by vectors, and one by one where lengths are beyond what vectors square. Only for
 * trace/. */
#pragma once

#include <stddef.h>

#include "plan/plan.h"

/* Points of a pattern in the unit square, and on the unit disc what u and v become. Arrays of
 * [count], readable up to the next multiple of SHD_AIMS_STEP. */
enum { SHD_AIMS_STEP = 8, SHD_AIMS_MOST = 64 };
typedef struct shd_aim_pattern {
    size_t count;
    const double *u, *v, *root;  /* sqrt(u) */
    const double *cosine, *sine; /* of 2 pi v */
} shd_aim_pattern;

/* Ways from a surface point: unit vectors, distances, and what each point adds to a diffuse surface
 * there, of the same factor. 0: it sends nothing there, and the way may be anything. */
typedef struct shd_aims {
    double toward[3][SHD_AIMS_MOST], far[SHD_AIMS_MOST], weight[SHD_AIMS_MOST];
} shd_aims;

/* A surface point, and how it sees the light. */
typedef struct shd_aim {
    const struct shd_light *light;
    shd_vec3 from, normal;
    shd_vec3 axis, a, b; /* unit, at right angles: to a sphere's middle, or of what a disc faces */
    double distance;     /* to its middle */
    double most;         /* 1 - cos of the cone in which a sphere is seen; 2 from inside */
} shd_aim;

shd_aim shd_aim_at(const struct shd_light *light, shd_vec3 from, shd_vec3 normal);

/* Whether vectors hold the lengths. */
bool shd_aim_is_held(const shd_aim *aim);

/* Ways to points first .. first + n - 1, n at most SHD_AIMS_MOST. */
void shd_aim_singly(const shd_aim *aim, const shd_aim_pattern *pattern, size_t first, size_t n,
                    shd_aims *out);

/* The same to rounding, if it is held. `first` is a multiple of SHD_AIMS_STEP. */
typedef void shd_aim_function(const shd_aim *aim, const shd_aim_pattern *pattern, size_t first,
                              size_t n, shd_aims *out);
shd_aim_function shd_aim_portable, shd_aim_avx2, shd_aim_avx512;

/* False: the arena is full. */
bool shd_aim_pattern_make(size_t count, shd_arena *arena, shd_aim_pattern *out);
