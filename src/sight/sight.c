#include "sight/sight.h"

#include <stdio.h>

#include "sight/item.h"
#include "sight/tree.h"

/* The unit normal in the world; `view` for a sliver without area, which has no normal. */
static shd_vec3 world_normal(const shd_item *it, shd_vec3 normal, shd_vec3 view) {
    shd_vec3 out = view;
    shd_normalize(shd_linear(&it->normal_map, normal), &out);
    return out;
}

/* ---- Facets: where flat and gouraud objects are lit. ---- */

/* Makes a point of each face: its centroid, with its normal. All corners of its triangles name it.
 * The centroid of a polygon is that of its triangles, weighted by their areas. Returns how many
 * points there are, as the next two do. */
static size_t flat_points(const shd_item *it, const atomic_bool *cancelled, shd_vec3 *positions,
                          shd_vec3 *normals, uint32_t *corners) {
    const shd_triangles *tri = &it->triangles;
    size_t faces = 0;
    for (size_t i = 0; i < tri->triangle_count; faces++) {
        if (shd_is_cancelled_at(cancelled, faces)) break;
        shd_vec3 sum = {0, 0, 0}, normal = {0, 0, 0};
        double area = 0;
        positions[faces] = shd_triangle_corner(tri, i, 0); /* for a face without area */
        for (size_t first = i; i < tri->triangle_count; i++) {
            if (i > first && !(tri->faces && tri->faces[i] == tri->faces[first])) break;
            shd_vec3 n = shd_triangle_normal(tri, i);
            double weight = shd_length(n);
            for (int k = 0; k < 3; k++) {
                sum = shd_madd(sum, shd_triangle_corner(tri, i, k), weight / 3);
                corners[3 * i + (size_t)k] = (uint32_t)faces;
            }
            normal = shd_add(normal, n);
            area += weight;
        }
        if (area > 0) positions[faces] = shd_scale(sum, 1 / area);
        normals[faces] = normal;
    }
    return faces;
}

/* Makes three points of each triangle, with the triangle's own normal. */
static size_t triangle_points(const shd_item *it, const atomic_bool *cancelled, shd_vec3 *positions,
                              shd_vec3 *normals, uint32_t *corners) {
    const shd_triangles *tri = &it->triangles;
    for (size_t i = 0; i < 3 * tri->triangle_count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) return i;
        positions[i] = shd_triangle_corner(tri, i / 3, (int)(i % 3));
        normals[i] = shd_triangle_normal(tri, i / 3);
        corners[i] = (uint32_t)i;
    }
    return 3 * tri->triangle_count;
}

/* Whether the viewer sees the corners of a triangle run clockwise. */
static bool is_seen_from_behind(const shd_item *it, const shd_lens *lens, size_t triangle) {
    const shd_vec3 p = shd_transform(&it->to_world,
                                     shd_triangle_corner(&it->triangles, triangle, 0)),
                   n = shd_linear(&it->normal_map, shd_triangle_normal(&it->triangles, triangle));
    return shd_dot(n, shd_lens_view(lens, p)) < 0;
}

/* Makes a point of each vertex, with its normal, for each side that is seen: a vertex of a
 * silhouette is one point for triangles in front, and another one, with its normal negated, for
 * those behind. `points`: [vertex_count][2], zeroed. */
static size_t vertex_points(const shd_item *it, const shd_lens *lens, const atomic_bool *cancelled,
                            uint32_t (*points)[2], shd_vec3 *positions, shd_vec3 *normals,
                            uint32_t *corners) {
    const shd_triangles *tri = &it->triangles;
    uint32_t count = 0;
    for (size_t i = 0; i < tri->triangle_count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) break;
        const bool behind = !it->front_only && is_seen_from_behind(it, lens, i);
        for (size_t k = 3 * i; k < 3 * i + 3; k++) {
            const size_t vertex = tri->indices[k];
            uint32_t *point = &points[vertex][behind];
            if (!*point) {
                positions[count] = shd_vec3_at(tri->positions, vertex);
                normals[count] = shd_scale(shd_vec3_at(tri->normals, vertex), behind ? -1 : 1);
                *point = ++count;
            }
            corners[k] = *point - 1;
        }
    }
    return count;
}

/* False: the arena is full. */
static bool make_facets(const shd_item *it, bool flat, const shd_lens *lens,
                        const atomic_bool *cancelled, shd_arena *arena, const shd_facets **out) {
    const shd_triangles *tri = &it->triangles;
    const bool smooth = !flat && tri->normals;
    const size_t corner_count = 3 * tri->triangle_count, vertices = smooth ? tri->vertex_count : 0,
                 most = smooth && 2 * vertices < corner_count ? 2 * vertices : corner_count;
    shd_facets *facets = shd_arena_alloc(arena, 1, sizeof *facets);
    shd_vec3 *positions = shd_arena_alloc(arena, most, sizeof *positions);
    shd_vec3 *normals = shd_arena_alloc(arena, most, sizeof *normals);
    shd_vec3 *views = shd_arena_alloc(arena, most, sizeof *views);
    uint32_t *corners = shd_arena_alloc(arena, corner_count, sizeof *corners);
    uint32_t(*points)[2] = shd_arena_zalloc(arena, vertices, sizeof *points);
    if (!facets || !positions || !normals || !views || !corners || !points) return false;
    const size_t count =
        smooth ? vertex_points(it, lens, cancelled, points, positions, normals, corners)
        : flat ? flat_points(it, cancelled, positions, normals, corners)
               : triangle_points(it, cancelled, positions, normals, corners);
    for (size_t i = 0; i < count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) break;
        positions[i] = shd_transform(&it->to_world, positions[i]);
        views[i] = shd_lens_view(lens, positions[i]);
        normals[i] = world_normal(it, normals[i], views[i]);
        if (!smooth && !it->front_only && shd_dot(normals[i], views[i]) < 0)
            normals[i] = shd_scale(normals[i], -1);
    }
    *facets = (shd_facets){count, positions, normals, views, tri->triangle_count, corners};
    *out = facets;
    return true;
}

const shd_facets *shd_sight_facets(const shd_sight *sight, size_t object) {
    return sight->items[object].facets;
}

/* ---- Objects made ready. ---- */

static shd_status no_memory(shd_error *error, size_t object) {
    char path[64];
    snprintf(path, sizeof path, "/objects/%zu", object);
    return shd_fail(error, SHD_MEMORY, path, "the limit `memory` is reached by this object");
}

static shd_affine scaling_map(double size, shd_vec3 origin) {
    return (shd_affine){{{size, 0, 0}, {0, size, 0}, {0, 0, size}}, origin};
}

/* The lengths that a map gives to the axes' unit vectors. */
static void axis_lengths(const shd_affine *m, double length[3]) {
    for (int c = 0; c < 3; c++) {
        shd_vec3 column = {m->linear[0][c], m->linear[1][c], m->linear[2][c]};
        length[c] = shd_length(column);
    }
}

/* Whether a map turns or mirrors and scales all directions alike, to rounding, and by how much. */
static bool is_similar(const shd_affine *m, const double length[3], double *size) {
    const double s = length[0];
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3;
        double product = 0;
        for (int r = 0; r < 3; r++) product += m->linear[r][c] / s * (m->linear[r][d] / s);
        if (!(fabs(length[c] / s - 1) < 1e-14 && fabs(product) < 1e-14)) return false;
    }
    *size = s;
    return true;
}

/* Places the camera in the item's frame, and the item in the plan's. */
static void place_eye(const shd_plan *plan, shd_item *it) {
    const shd_camera *camera = &plan->scene->camera;
    const shd_vec3 at = it->to_world.origin;
    it->eye = shd_linear(&it->from_world, shd_sub(camera->position, at));
    it->forward = shd_linear(&it->from_world, shd_scale(camera->back, -1));
    it->far = !(shd_length(it->eye) < 16);
    it->to_frame.origin = shd_scale(shd_sub(at, plan->origin), plan->scale);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            it->to_frame.linear[r][c] = it->to_world.linear[r][c] * plan->scale;
}

static shd_status make_mesh(const shd_plan *plan, const shd_lens *lens, size_t index,
                            const atomic_bool *cancelled, shd_arena *arena, shd_item *it,
                            shd_error *error) {
    const shd_mesh *mesh = plan->scene->objects[index].mesh;
    const shd_mesh_kept *kept = mesh ? mesh->kept : NULL;
    const shd_mesh_tree *tree = kept ? kept->tree : NULL;
    if (kept) {
        it->units = kept->units;
    } else {
        shd_status status = shd_mesh_tree_new(&it->triangles, cancelled, arena, &tree, error);
        if (status != SHD_OK) return status;
        if (it->smooth && !shd_triangle_units(&it->triangles, cancelled, arena, &it->units))
            return no_memory(error, index);
    }
    it->blind = SHD_BLIND * plan->objects[index].radius;
    if (!shd_mesh_view_make(&it->triangles, tree, &it->to_world, it->eye, lens->camera, cancelled,
                            arena, &it->view))
        return no_memory(error, index);
    return SHD_OK;
}

static shd_status make_item(const shd_plan *plan, const shd_lens *lens, size_t index,
                            const atomic_bool *cancelled, shd_arena *arena, shd_item *it,
                            shd_error *error) {
    const shd_object *object = &plan->scene->objects[index];
    it->shape = object->shape;
    it->tube = object->tube / object->radius;
    it->front_only = plan->materials[object->material].front_only;
    if (!shd_object_frame(object, &it->to_world, &it->from_world)) {
        char path[64];
        snprintf(path, sizeof path, "/objects/%zu", index);
        return shd_fail(error, SHD_INTERNAL, path, "this object's size and transform are singular");
    }
    it->normal_map = shd_normal_map(&it->to_world);
    bool faceted = object->interpolation != SHD_PHONG;
    double axes[3];
    axis_lengths(&it->to_world, axes);
    it->similar = is_similar(&it->to_world, axes, &it->size);
    if (it->similar)
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                it->normal_map.linear[r][c] = it->to_world.linear[r][c] / it->size;
    it->ball = it->similar && it->shape == SHD_SPHERE && !faceted;
    if (it->ball) {
        it->to_world = scaling_map(it->size, it->to_world.origin);
        it->from_world = scaling_map(1 / it->size, (shd_vec3){0, 0, 0});
        it->normal_map = scaling_map(1, (shd_vec3){0, 0, 0});
    }
    place_eye(plan, it);

    if (object->shape == SHD_MESH) {
        it->triangles = shd_triangles_of(object->mesh);
        it->smooth = object->mesh->normals && !faceted;
    } else if (faceted) {
        if (!shd_tessellate(object->shape, it->tube, object->segments, arena, &it->triangles))
            return no_memory(error, index);
        it->shape = SHD_MESH;
    }
    if (faceted &&
        !make_facets(it, object->interpolation == SHD_FLAT, lens, cancelled, arena, &it->facets))
        return no_memory(error, index);
    if (it->shape == SHD_MESH) return make_mesh(plan, lens, index, cancelled, arena, it, error);
    if (it->shape != SHD_PLANE)
        it->blind = SHD_BLIND * fmax(axes[0], fmax(axes[1], axes[2])) *
                    (it->shape == SHD_TORUS ? 1 + it->tube : 1);
    return SHD_OK;
}

shd_status shd_sight_new(const shd_plan *plan, const atomic_bool *cancelled, shd_arena *arena,
                         shd_sight **out, shd_error *error) {
    const shd_scene *scene = plan->scene;
    shd_sight *sight = shd_arena_zalloc(arena, 1, sizeof *sight);
    shd_item *items = shd_arena_zalloc(arena, scene->object_count, sizeof *items);
    if (!sight || !items)
        return shd_fail(error, SHD_MEMORY, "/objects", "the limit `memory` is reached");
    sight->plan = plan;
    sight->cancelled = cancelled;
    sight->lens = shd_lens_make(&scene->camera, &scene->raster);
    sight->items = items;
    for (int i = 0; i < scene->raster.samples; i++)
        shd_sample_offset(i, scene->raster.samples, &sight->offset_x[i], &sight->offset_y[i]);
    for (size_t i = 0; i < scene->object_count; i++) {
        shd_status status = make_item(plan, &sight->lens, i, cancelled, arena, &items[i], error);
        if (status != SHD_OK) return status;
        if (shd_is_cancelled(cancelled))
            return shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
    }
    sight->count = scene->object_count;
    if (!shd_sight_outline(sight, arena))
        return shd_fail(error, SHD_MEMORY, "/objects", "the limit `memory` is reached");
    *out = sight;
    return SHD_OK;
}
