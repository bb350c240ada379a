/* What may stand between objects and lights, by the spheres around them, before any ray. */
#pragma once

#include "plan/plan.h"

/* A ball that holds points. */
typedef struct shd_ball {
    shd_vec3 center;
    double radius;
} shd_ball;

/* Whether what is in the ball `by` may hide some of the light from a point of `at`. */
bool shd_may_hide(shd_ball at, const shd_plan_light *light, shd_ball by);

/* The same of an object, which may be unbounded. */
bool shd_may_object_hide(const shd_plan *plan, shd_ball at, const shd_plan_light *light, size_t by);

/* Whether it never hides a point of itself. */
bool shd_is_flat(const shd_object *object);

/* Whether the object may shadow its own points, in front of which a light is by their normals: it
 * is not flat, or a map turns these. */
bool shd_shades_itself(const shd_plan *plan, size_t object);

/* What may shadow an object from a light. */
typedef struct shd_occluders {
    uint32_t first, count; /* in shd_occlusion.list; count SHD_OCCLUDERS_ANY: any object may */
} shd_occluders;

enum { SHD_OCCLUDERS_ANY = -1, SHD_OCCLUDERS_MOST = 8 };

typedef struct shd_occlusion {
    const shd_occluders *pairs;  /* [object][light of the plan]; NULL: any object may shadow any */
    const uint32_t *list;        /* indices of objects */
    size_t pair_count, shadowed; /* pairs that matter; those with an occluder or more */
} shd_occlusion;

/* Objects are left out that are beside the hull of the object's sphere and the light (or the sphere
 * around its shape). A shape that is convex shadows itself only from inside, and stays in its own
 * list. False: the arena is full, or cancelled. */
bool shd_find_occlusion(const shd_plan *plan, shd_arena *arena, shd_occlusion *out);
