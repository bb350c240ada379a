/* Triangles: Embree finds them, f64 places the hit. Inside of sight/. */
#ifndef SHD_SIGHT_MESH_H
#define SHD_SIGHT_MESH_H

#include <stdatomic.h>

#include "sight/shapes.h"
#include "sight/sight.h"

/* Triangles in an object's frame. Made from a client's mesh or by tessellation. */
typedef struct shd_triangles {
    size_t vertex_count, triangle_count;
    const double *positions; /* [vertex_count][3] */
    const double *normals;   /* [vertex_count][3] or NULL: a triangle's own */
    const uint32_t *indices; /* [triangle_count][3] */
    const uint32_t *faces;   /* [triangle_count]: the polygon that it is part of, ascending from
                                0 without gaps; NULL: each is its own */
} shd_triangles;

/* An analytic shape, in its unit form, as `segments` slices. False: the arena is full. */
bool shd_tessellate(shd_shape shape, double tube, int segments, shd_arena *arena,
                    shd_triangles *out);

typedef struct shd_mesh_tree shd_mesh_tree;

/* Errors and `cancelled`: as of shd_sight_new. */
shd_status shd_mesh_tree_new(const shd_triangles *triangles, shd_tracer *tracer,
                             const atomic_bool *cancelled, shd_arena *arena, shd_mesh_tree **out,
                             shd_error *error);
void shd_mesh_tree_drop(shd_mesh_tree *tree); /* NULL is fine */

/* The nearest triangle with t > ray->near, and not closer than SHD_BLIND: t, the triangle, and the
 * barycentric weights of its second and third corner: in [0,1] with a sum of at most 1, but for
 * 1e-3 at edges. */
bool shd_mesh_tree_intersect(const shd_mesh_tree *tree, const shd_ray *ray, double *t,
                             uint32_t *triangle, double *u, double *v);

/* Corner k of a triangle, and its normal by the order of its corners: twice the area long. */
shd_vec3 shd_triangle_corner(const shd_triangles *triangles, size_t triangle, int k);
shd_vec3 shd_triangle_normal(const shd_triangles *triangles, size_t triangle);

#endif
