/* Analytic shapes in their unit form, f64. Inside of sight/. */
#ifndef SHD_SIGHT_SHAPES_H
#define SHD_SIGHT_SHAPES_H

#include "scene/scene.h"

/* A ray in a shape's frame; `direction` need not be unit. Only t > near counts. */
typedef struct shd_ray {
    shd_vec3 origin, direction;
    double near;
} shd_ray;

typedef struct shd_surface {
    double t;        /* along the ray */
    shd_vec3 point;  /* snapped onto the shape */
    shd_vec3 normal; /* outward, any length but zero */
} shd_surface;

/* A shape's unit form: the sphere, disc, cylinder (height 1, centred) and cone (base at
 * y = -1/2, apex at y = 1/2) have radius 1, the box has sides of 1, the torus a ring of radius 1
 * and a tube of `tube` (the ratio of its radii). */

/* The nearest surface with t > ray.near; false: none. */
bool shd_intersect(shd_shape shape, double tube, const shd_ray *ray, shd_surface *out);

#endif
