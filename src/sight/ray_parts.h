/* What rays meet of one item. Inside of sight/. */
#pragma once

#include "sight/item.h"
#include "sight/ray.h"
#include "sight/tree.h"

/* A ray in an item's frame: origin + t direction, with the world's t. */
typedef struct shd_local_ray {
    shd_vec3 origin, direction;
    shd_vec3 carried; /* how far off rounding may have put each component of the origin */
    double far;
    bool starts;    /* on this item, at t = 0 */
    bool any;       /* any meeting will do: it need not be the nearest */
    bool outward;   /* and leaves it to its outer side; not for triangles */
    uint32_t start; /* the triangle */
} shd_local_ray;

/* The nearest meeting with a shape, or a mesh, that is nearer than local->far. */
bool shd_meet_shape(const shd_item *it, const shd_local_ray *local, shd_meeting *out);
bool shd_meet_mesh(const shd_item *it, const shd_local_ray *local, const atomic_bool *cancelled,
                   shd_meeting *out);

/* The torus: real roots t > 0 of the distance from it, ascending. At most 4. */
int shd_torus_roots(double tube, const shd_local_ray *local, double roots[4]);

/* The outward normal of a shape at a point of it, near enough to tell sides by: not unit. `normal`
 * is that of the face, of any side. */
static inline bool shd_points_outward(const shd_item *it, shd_vec3 point, shd_vec3 normal) {
    shd_vec3 from = point;
    if (it->shape == SHD_TORUS) {
        const double ring = hypot(point.x, point.z);
        from = (shd_vec3){point.x - point.x / ring, point.y, point.z - point.z / ring};
    }
    if (it->shape == SHD_PLANE || it->shape == SHD_DISC) return normal.y > 0;
    return shd_dot(from, normal) > 0;
}

/* Whether a meeting at t that may be off by `rounding` is between the ray's ends. */
static inline bool shd_is_between(const shd_local_ray *local, double t, double rounding) {
    return t > rounding && t < local->far - rounding;
}
