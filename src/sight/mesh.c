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

/* On which side of an edge rays pass: fixed + p across + q up. */
typedef struct side {
    double fixed, across, up;
} side;

static void set_sliver(const shd_mesh_view *view, const shd_leaf *leaf, const shd_slivers *out,
                       size_t i) {
    side sides[3];
    double size[3], x = 0, y = 0, at[2], slope[2], reach = 0;
    const double p = out->most[0], q = out->most[1];
    for (int e = 0; e < 3; e++) {
        const shd_seen_vertex *a = &view->vertices[leaf->corner[(e + 1) % 3]],
                              *b = &view->vertices[leaf->corner[(e + 2) % 3]];
        const double aw = shd_seen_w(view->orthographic, a), bw = shd_seen_w(view->orthographic, b);
        sides[e] = (side){a->x * b->y - a->y * b->x, a->y * bw - aw * b->y, aw * b->x - a->x * bw};
        size[e] = fabs(sides[e].across) + fabs(sides[e].up);
        x = shd_larger(fabs(a->x) + p * fabs(aw), x);
        y = shd_larger(fabs(a->y) + q * fabs(aw), y);
    }
    const int least = size[0] < size[1] ? size[0] < size[2] ? 0 : 2 : size[1] < size[2] ? 1 : 2;
    const side *two[2] = {&sides[(least + 1) % 3], &sides[(least + 2) % 3]};
    /* An edge may lie along a row: then it crosses none, and what is made of it is not a number. */
    bool told = two[0]->across * two[1]->across < 0;
    for (int e = 0; e < 2; e++) {
        const double per = 1 / (two[e]->across * p);
        at[e] = -two[e]->fixed * per;
        slope[e] = -two[e]->up * q * per;
        /* What rays are tried by is rounded in f64, and this in f32, with what casting makes of it:
         * no term more than 6 times. */
        const double error =
            6e-14 * x * y * fabs(per) + 0x1p-21 * (1 + fabs(at[e]) + fabs(slope[e]));
        told = told && error < 1e3;
        reach = shd_larger(error, reach);
    }
    for (int e = 0; e < 2; e++) {
        out->at[e][i] = told ? (float)at[e] : 0;
        out->slope[e][i] = told ? (float)slope[e] : 0;
    }
    out->error[i] = told ? (float)reach : 1e30f;
}

/* False: the arena is full. */
static bool make_slivers(shd_mesh_view *view, const shd_lens *lens, shd_arena *arena) {
    enum { PAST = 16 }; /* a vector of the widest ends beyond the last one */
    const shd_mesh_tree *tree = view->tree;
    const size_t room = tree->leaf_count + PAST;
    shd_slivers *s = shd_arena_alloc(arena, 1, sizeof *s);
    float *all = shd_arena_zalloc(arena, 5 * room, sizeof *all);
    if (!s || !all) return false;
    const double unit = view->orthographic ? 1 / view->unit : 1;
    *s = (shd_slivers){{all, all + room},
                       {all + 2 * room, all + 3 * room},
                       all + 4 * room,
                       {2 * lens->half_x * unit, 2 * lens->half_y * unit}};
    for (size_t i = 0; i < tree->leaf_count; i++) {
        if (shd_is_cancelled_at(view->cancelled, i)) break;
        set_sliver(view, &tree->leaves[i], s, i);
    }
    view->slivers = s;
    return true;
}

bool shd_mesh_view_make(shd_item *it, const shd_mesh_tree *tree, const shd_lens *lens,
                        bool is_whole, const atomic_bool *cancelled, shd_arena *arena) {
    const shd_camera *camera = lens->camera;
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
                           .from = shd_sub(shd_scale(it->eye, tree->scale), tree->middle),
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
    return !tree->turn_count || make_slivers(out, lens, arena);
}
