#include "sight/item.h"
#include "sight/tree.h"

shd_triangles shd_triangles_of(const shd_mesh *mesh) {
    return (shd_triangles){mesh->vertex_count, mesh->triangle_count, mesh->positions,
                           mesh->normals,      mesh->indices,        NULL};
}

bool shd_triangle_units(const shd_triangles *triangles, const atomic_bool *cancelled,
                        shd_arena *arena, const double **out) {
    shd_vec3 *units = shd_arena_alloc(arena, triangles->vertex_count, sizeof *units);
    if (!units) return false;
    for (size_t i = 0; i < triangles->vertex_count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) break;
        units[i] = shd_vec3_at(triangles->normals, i);
        shd_normalize(units[i], &units[i]);
    }
    *out = &units->x;
    return true;
}

shd_vec3 shd_triangle_corner(const shd_triangles *triangles, size_t triangle, int k) {
    return shd_vec3_at(triangles->positions, triangles->indices[3 * triangle + (size_t)k]);
}

shd_vec3 shd_triangle_normal(const shd_triangles *triangles, size_t triangle) {
    const shd_vec3 a = shd_triangle_corner(triangles, triangle, 0),
                   b = shd_triangle_corner(triangles, triangle, 1),
                   c = shd_triangle_corner(triangles, triangle, 2);
    return shd_cross(shd_sub(b, a), shd_sub(c, a));
}

/* A row of the map from the mesh's frame to the camera's, times `scale`. */
static shd_vec3 row_of(const shd_affine *m, double scale, shd_vec3 axis) {
    const shd_vec3 x = shd_scale(shd_vec3_at(m->linear[0], 0), scale),
                   y = shd_scale(shd_vec3_at(m->linear[1], 0), scale),
                   z = shd_scale(shd_vec3_at(m->linear[2], 0), scale);
    return shd_madd(shd_madd(shd_scale(x, axis.x), y, axis.y), z, axis.z);
}

bool shd_mesh_view_make(shd_item *it, const shd_mesh_tree *tree, const shd_camera *camera,
                        bool is_whole, const atomic_bool *cancelled, shd_arena *arena) {
    const shd_triangles *triangles = &it->triangles;
    const shd_affine *to_world = &it->to_world;
    shd_mesh_view *out = &it->view;
    /* Powers of 2 bring the mesh, and then the map, to a size of about 1: products of coordinates
     * neither overflow nor vanish. */
    int exponent = 0;
    (void)frexp(shd_norm(to_world), &exponent);
    const double scale = ldexp(1, exponent > 1000 ? -1000 : exponent < -1000 ? 1000 : -exponent);
    *out = (shd_mesh_view){.tree = tree,
                           .cancelled = cancelled,
                           .positions = triangles->positions,
                           .rows = {row_of(to_world, scale, camera->right),
                                    row_of(to_world, scale, camera->up),
                                    row_of(to_world, scale, shd_scale(camera->back, -1))},
                           .eye = shd_scale(it->eye, tree->scale),
                           .scale = tree->scale,
                           .unit = ldexp(1 / scale, tree->exponent),
                           .orthographic = camera->projection == SHD_ORTHOGRAPHIC};
    if (!is_whole) return true;
    shd_seen_vertex *seen = shd_arena_alloc(arena, triangles->vertex_count, sizeof *seen);
    if (!seen) return false;
    for (size_t i = 0; i < triangles->vertex_count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) break;
        seen[i] = shd_see_vertex(out, i);
    }
    out->vertices = seen;
    return true;
}
