/* Triangles, and how the camera sees them. Inside of sight/. */
#pragma once

#include "sight/sight.h"

/* Triangles in an object's frame, from a client's mesh or by tessellation. */
typedef struct shd_triangles {
    size_t vertex_count, triangle_count;
    const double *positions; /* [vertex_count][3] */
    const double *normals;   /* [vertex_count][3] or NULL: a triangle's own */
    const uint32_t *indices; /* [triangle_count][3] */
    /* [triangle_count]: the polygon of each, ascending from 0 without gaps. NULL: each is its own.
     */
    const uint32_t *faces;
} shd_triangles;

/* An analytic shape, in its unit form, as `segments` slices. False: the arena is full. */
bool shd_tessellate(shd_shape shape, double tube, int segments, shd_arena *arena,
                    shd_triangles *out);

/* A mesh's triangles, which are borrowed. */
shd_triangles shd_triangles_of(const shd_mesh *mesh);

/* Makes unit normals, [vertex_count][3]. Normals of no length stay. False: the arena is full. */
bool shd_triangle_units(const shd_triangles *triangles, const atomic_bool *cancelled,
                        shd_arena *arena, const double **out);

/* Corner k of a triangle; its normal by the order of its corners, which is twice the area long. */
shd_vec3 shd_triangle_corner(const shd_triangles *triangles, size_t triangle, int k);
shd_vec3 shd_triangle_normal(const shd_triangles *triangles, size_t triangle);

typedef struct shd_mesh_tree shd_mesh_tree; /* tree.h */

/* A vertex from the camera: x right, y up, `depth` forward. From where the ray through the point
 * (p, q) of the image plane passes, the vertex is at (x - p w, y - q w). w is the depth, or 1 in an
 * orthographic camera. It is half of a cache line. */
typedef struct shd_seen_vertex {
    double x, y, depth;
    float p, q; /* its place on the image plane, rounded, if w > 0 */
} shd_seen_vertex;

/* Thin triangles that lie alike, by where their two longest edges cross rows of rays: edge e
 * crosses row q at at[e] + slope[e] q, in units of `most`, to within `error`. In f32, in the tree's
 * order of leaves. `error` is 1e30 if a triangle is not told of. */
typedef struct shd_slivers {
    float *at[2], *slope[2], *error;
    double most[2]; /* |p| and |q|, up to which this holds */
} shd_slivers;

/* A mesh from the camera, in units of its own. */
typedef struct shd_mesh_view {
    const shd_mesh_tree *tree;
    const atomic_bool *cancelled;    /* if it is raised, rays end anywhere; or NULL */
    const shd_seen_vertex *vertices; /* as in shd_triangles. NULL: each is found when wanted */
    const shd_slivers *slivers; /* NULL: there are no vertices, or no box of the tree is turned */
    const double *positions;    /* of shd_triangles */
    shd_vec3 rows[3], eye; /* row . (v - eye) is x, y or depth of a point v in the tree's frame */
    shd_vec3 from;         /* the eye from the tree's middle, as boxes are */
    double scale;          /* of the tree's frame, a power of 2 */
    double unit;           /* the length in the world of 1 here */
    bool orthographic;
} shd_mesh_view;

/* How the camera sees a vertex. It is the same wherever it is found. */
static inline shd_seen_vertex shd_see_vertex(const shd_mesh_view *view, size_t vertex) {
    const shd_vec3 p = shd_scale(shd_vec3_at(view->positions, vertex), view->scale),
                   from = shd_sub(p, view->eye);
    const double x = shd_dot(view->rows[0], from), y = shd_dot(view->rows[1], from),
                 depth = shd_dot(view->rows[2], from), w = view->orthographic ? 1 : depth;
    return (shd_seen_vertex){x, y, depth, (float)(x / w), (float)(y / w)};
}

static inline double shd_seen_w(bool orthographic, const shd_seen_vertex *v) {
    return orthographic ? 1 : v->depth;
}
