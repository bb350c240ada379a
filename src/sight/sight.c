#include "sight/sight.h"

#include <stdio.h>

#include "sight/item.h"
#include "sight/tree.h"

/* ---- Facets: where flat and gouraud objects are lit. ---- */

/* Makes a point of each face: its centroid, with its normal. All corners of its triangles name it.
 * The centroid of a polygon is that of its triangles, weighted by their areas. Returns how many
 * points there are. */
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

/* Whether the viewer sees the corners of a triangle run clockwise. */
static bool is_seen_from_behind(const shd_item *it, const shd_lens *lens, size_t triangle) {
    const shd_vec3 p = shd_transform(&it->to_world,
                                     shd_triangle_corner(&it->triangles, triangle, 0)),
                   n = shd_linear(&it->normal_map, shd_triangle_normal(&it->triangles, triangle));
    return shd_dot(n, shd_lens_view(lens, p)) < 0;
}

/* Makes a point of each vertex, with its normal, for each side that is seen: a vertex of a
 * silhouette is one point for triangles in front, and another one, with its normal negated, for
 * those behind. `points`: [vertex_count][2], zeroed. NULL: vertices have no normals, and each
 * triangle gets three points with its own. */
static size_t vertex_points(const shd_item *it, const shd_lens *lens, const atomic_bool *cancelled,
                            uint32_t (*points)[2], shd_vec3 *positions, shd_vec3 *normals,
                            uint32_t *corners) {
    const shd_triangles *tri = &it->triangles;
    uint32_t count = 0;
    for (size_t i = 0; i < tri->triangle_count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) break;
        const bool behind = points && !it->front_only && is_seen_from_behind(it, lens, i);
        for (size_t k = 3 * i; k < 3 * i + 3; k++) {
            const size_t vertex = tri->indices[k];
            uint32_t alone = 0, *point = points ? &points[vertex][behind] : &alone;
            if (!*point) {
                positions[count] = shd_vec3_at(tri->positions, vertex);
                normals[count] = points
                                     ? shd_scale(shd_vec3_at(tri->normals, vertex), behind ? -1 : 1)
                                     : shd_triangle_normal(tri, i);
                *point = ++count;
            }
            corners[k] = *point - 1;
        }
    }
    return count;
}

/* Finds the first triangle of each point. False: the arena is full. */
static bool name_triangles(shd_facets *facets, const atomic_bool *cancelled, shd_arena *arena) {
    uint32_t *triangles = shd_arena_alloc(arena, facets->point_count, sizeof *triangles);
    facets->triangles = triangles;
    if (!triangles || shd_is_cancelled(cancelled)) return triangles; /* corners may be unset */
    for (size_t k = 3 * facets->triangle_count; k-- > 0;)
        triangles[facets->corners[k]] = (uint32_t)(k / 3);
    return true;
}

/* False: the arena is full. */
static bool make_facets(const shd_sight *sight, bool flat, shd_arena *arena, shd_item *it) {
    const shd_triangles *tri = &it->triangles;
    const shd_lens *lens = &sight->lens;
    const atomic_bool *cancelled = sight->cancelled;
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
    const size_t count = flat ? flat_points(it, cancelled, positions, normals, corners)
                              : vertex_points(it, lens, cancelled, smooth ? points : NULL,
                                              positions, normals, corners);
    for (size_t i = 0; i < count; i++) {
        if (shd_is_cancelled_at(cancelled, i)) break;
        positions[i] = shd_transform(&it->to_world, positions[i]);
        views[i] = shd_lens_view(lens, positions[i]);
        shd_vec3 normal = views[i]; /* that of a sliver without area, which has none */
        shd_normalize(shd_linear(&it->normal_map, normals[i]), &normal);
        const bool turned = !smooth && !it->front_only && shd_dot(normal, views[i]) < 0;
        normals[i] = turned ? shd_scale(normal, -1) : normal;
    }
    *facets = (shd_facets){count, positions, normals, views, tri->triangle_count, corners, NULL};
    it->facets = facets;
    return !shd_is_traced(sight->plan->scene) || name_triangles(facets, cancelled, arena);
}

const shd_facets *shd_sight_facets(const shd_sight *sight, size_t object) {
    const shd_item *it = sight->items[object];
    return it ? it->facets : NULL;
}

void shd_sight_corners(const shd_sight *sight, size_t object, size_t triangle, shd_vec3 out[3]) {
    const shd_item *it = sight->items[object];
    for (int k = 0; k < 3; k++)
        out[k] = shd_transform(&it->to_world, shd_triangle_corner(&it->triangles, triangle, k));
}

/* ---- Objects made ready. ---- */

static const char FULL[] = "the limit `memory` is reached by this object";

static shd_status fail_object(shd_error *error, shd_status status, size_t object, const char *why) {
    char path[64];
    snprintf(path, sizeof path, "/objects/%zu", object);
    return shd_fail(error, status, path, "%s", why);
}

static shd_affine scaling_map(double size, shd_vec3 origin) {
    return (shd_affine){{{size, 0, 0}, {0, size, 0}, {0, 0, size}}, origin};
}

/* Places the camera in the item's frame, and the item in the plan's. */
static void place_eye(const shd_plan *plan, shd_item *it) {
    const shd_camera *camera = &plan->scene->camera;
    const shd_vec3 at = it->to_world.origin;
    it->eye = shd_linear(&it->from_world, shd_sub(camera->position, at));
    it->forward = shd_linear(&it->from_world, shd_scale(camera->back, -1));
    it->to_frame.origin = shd_scale(shd_sub(at, plan->origin), plan->scale);
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++)
            it->to_frame.linear[r][c] = it->to_world.linear[r][c] * plan->scale;
}

/* Vertices that are seen once for all rays, or the first mesh's, but in no more than a part of what
 * memory is left. Those of further meshes are found for each triangle that a ray may meet, so that
 * one mesh may be in a scene many times. */
enum { SEEN_MOST = 1 << 20, SEEN_PART = 4 };

static bool sees_whole(shd_sight *sight, size_t vertices, const shd_arena *arena) {
    const size_t all = sight->seen_vertices + vertices;
    if (sight->seen_vertices && all > SEEN_MOST) return false;
    if (all > shd_arena_room(arena) / SEEN_PART / sizeof(shd_seen_vertex)) return false;
    sight->seen_vertices = all;
    return true;
}

static shd_status make_mesh(shd_sight *sight, size_t index, shd_item *it, shd_arena *arena,
                            shd_error *error) {
    const atomic_bool *cancelled = sight->cancelled;
    const shd_mesh *mesh = sight->plan->scene->objects[index].mesh;
    const shd_mesh_tree *tree = NULL;
    const shd_item *first =
        mesh && mesh->shared && mesh->first < index ? sight->items[mesh->first] : NULL;
    if (first) {
        tree = first->view.tree;
        it->units = it->smooth ? first->units : NULL;
        if (it->smooth && !it->units &&
            !shd_triangle_units(&it->triangles, cancelled, arena, &it->units))
            return fail_object(error, SHD_MEMORY, index, FULL);
    } else if (mesh && mesh->kept) {
        tree = mesh->kept->tree;
        it->units = mesh->kept->units;
    } else {
        shd_status status = shd_mesh_tree_new(&it->triangles, cancelled, arena, &tree, error);
        if (status != SHD_OK) return status;
        sight->has_built = true;
        if (it->smooth && !shd_triangle_units(&it->triangles, cancelled, arena, &it->units))
            return fail_object(error, SHD_MEMORY, index, FULL);
    }
    it->blind = SHD_BLIND * sight->plan->objects[index].radius;
    const size_t slivers = tree->turn_count ? tree->leaf_count : 0; /* each less than a vertex */
    const bool is_whole = sees_whole(sight, it->triangles.vertex_count + slivers, arena);
    if (!shd_mesh_view_make(it, tree, &sight->lens, is_whole, cancelled, arena))
        return fail_object(error, SHD_MEMORY, index, FULL);
    return SHD_OK;
}

/* Sees a sphere that stays one, which has an inverse in any case. False: it is none. */
static bool see_ball(const shd_plan *plan, size_t index, shd_seen_object *one) {
    const shd_object *object = &plan->scene->objects[index];
    double axes[3];
    one->is_ball = false;
    if (object->shape != SHD_SPHERE || object->interpolation != SHD_PHONG) return false;
    const shd_affine to_world = shd_object_to_world(object);
    if (!shd_is_similar(&to_world, axes) || !isfinite(1 / axes[0])) return false;
    const shd_vec3 at = to_world.origin,
                   eye = shd_scale(shd_sub(plan->scene->camera.position, at), 1 / axes[0]);
    /* Of many objects, most share a few of the plan's materials, which are in caches. */
    const shd_plan_material *material = &plan->materials[plan->objects[index].material];
    one->is_ball = true;
    one->ball.eye = eye; /* one by one: a copy of the whole would wait for its parts */
    one->ball.center = shd_scale(shd_sub(at, plan->origin), plan->scale);
    one->ball.size = axes[0];
    one->ball.turned = material->front_only ? 1 : -1;
    one->ball.far = !(shd_length(eye) < 16);
    return true;
}

const shd_item *shd_item_of(const shd_sight *sight, size_t object, shd_item *room) {
    if (sight->items[object]) return sight->items[object];
    const shd_seen_ball *ball = &sight->seen[object].ball;
    const double grow = ball->size * sight->plan->scale;
    *room = (shd_item){.shape = SHD_SPHERE,
                       .front_only = ball->turned > 0,
                       .similar = true,
                       .ball = ball,
                       .to_frame = scaling_map(grow, ball->center),
                       .to_world = scaling_map(ball->size, sight->plan->objects[object].center),
                       .from_world = scaling_map(1 / ball->size, (shd_vec3){0, 0, 0}),
                       .normal_map = scaling_map(1, (shd_vec3){0, 0, 0})};
    return room;
}

static shd_status make_item(shd_sight *sight, size_t index, shd_arena *arena, shd_error *error) {
    const shd_plan *plan = sight->plan;
    const shd_object *object = &plan->scene->objects[index];
    sight->items[index] = NULL;
    if (see_ball(plan, index, &sight->seen[index])) {
        sight->has_balls = true;
        return SHD_OK;
    }
    shd_item *it = shd_arena_zalloc(arena, 1, sizeof *it);
    if (!it) return fail_object(error, SHD_MEMORY, index, FULL);
    sight->items[index] = it;
    it->shape = object->shape;
    it->tube = object->tube / object->radius;
    it->front_only = plan->materials[object->material].front_only;
    bool faceted = object->interpolation != SHD_PHONG;
    if (!shd_object_frame(object, &it->to_world, &it->from_world))
        return fail_object(error, SHD_INTERNAL, index,
                           "this object's size and transform are singular");
    it->normal_map = shd_normal_map(&it->to_world);
    double axes[3];
    if (it->shape == SHD_SPHERE && shd_plan_is_draft(plan)) {
        it->widest = shd_norm(&it->from_world);
        it->longest = shd_norm(&it->to_world);
    }
    it->similar = shd_is_similar(&it->to_world, axes);
    it->size = axes[0];
    if (it->similar)
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++)
                it->normal_map.linear[r][c] = it->to_world.linear[r][c] / it->size;
    place_eye(plan, it);

    if (object->shape == SHD_MESH) {
        it->triangles = shd_triangles_of(object->mesh);
        it->smooth = object->mesh->normals && !faceted;
    } else if (faceted) {
        if (!shd_tessellate(object->shape, it->tube, object->segments, arena, &it->triangles))
            return fail_object(error, SHD_MEMORY, index, FULL);
        it->shape = SHD_MESH;
    }
    if (faceted && !make_facets(sight, object->interpolation == SHD_FLAT, arena, it))
        return fail_object(error, SHD_MEMORY, index, FULL);
    if (it->shape == SHD_MESH) return make_mesh(sight, index, it, arena, error);
    if (it->shape != SHD_PLANE)
        it->blind = SHD_BLIND * fmax(axes[0], fmax(axes[1], axes[2])) *
                    (it->shape == SHD_TORUS ? 1 + it->tube : 1);
    return SHD_OK;
}

bool shd_sight_has_built(const shd_sight *sight) {
    return sight->has_built;
}

/* Where shots go through their pixels. */
static void set_offsets(shd_sight *sight, int samples) {
    for (int i = 0; i < samples; i++)
        shd_sample_offset(i, samples, &sight->offset_x[i], &sight->offset_y[i]);
    const size_t center = shd_center_sample((size_t)samples);
    sight->offset_x[center] = sight->offset_y[center] = 0.5;
    shd_rule rules[SHD_RULES];
    const size_t count = shd_plan_rules(sight->plan, sight->plan->tier);
    if (count) shd_rules_of(samples, rules);
    for (size_t r = 0; r < count; r++)
        for (size_t i = 0; i < rules[r].count && !rules[r].rim; i++) {
            const size_t at = shd_rule_sample((size_t)samples, r) + i;
            sight->offset_x[at] = 0.5 + rules[r].x[i];
            sight->offset_y[at] = 0.5 + rules[r].y[i];
        }
}

/* Asks for an object ahead of its use: of many, few are in caches. */
static void fetch_object(const shd_object *object) {
    for (size_t line = 0; line < sizeof *object; line += 64)
        __builtin_prefetch((const char *)object + line);
}

shd_status shd_sight_new(const shd_plan *plan, const atomic_bool *cancelled, shd_arena *arena,
                         shd_sight **out, shd_error *error) {
    const shd_scene *scene = plan->scene;
    const double x = 0.5 * scene->raster.width, y = 0.5 * scene->raster.height;
    const double half_y = shd_half_height(&scene->camera), half_x = half_y * (2 * x) / (2 * y);
    shd_sight *sight = shd_arena_alloc(arena, 1, sizeof *sight);
    const shd_item **items = shd_arena_alloc(arena, scene->object_count, sizeof *items);
    shd_seen_object *objects = shd_arena_alloc(arena, scene->object_count, sizeof *objects);
    uint32_t *order = shd_arena_alloc(arena, scene->object_count, sizeof *order);
    shd_distance *distances = shd_arena_alloc(arena, scene->object_count, 2 * sizeof *distances);
    if (!sight || !items || !objects || !order || !distances)
        return shd_fail(error, SHD_MEMORY, "/objects", "the limit `memory` is reached");
    *sight = (shd_sight){
        .plan = plan,
        .cancelled = cancelled,
        .lens = {&scene->camera, 2 * x, 2 * y, half_x, half_y, x, y, half_x / x, half_y / y},
        .items = items,
        .seen = objects,
        .order = order,
        .distances = distances,
        .count = scene->object_count};
    set_offsets(sight, scene->raster.samples);
    enum { AHEAD = 12 };
    for (size_t i = 0; i < scene->object_count; i++) {
        if (i + AHEAD < scene->object_count) fetch_object(&scene->objects[i + AHEAD]);
        shd_status status = make_item(sight, i, arena, error);
        if (status != SHD_OK) return status;
        if (shd_is_cancelled(cancelled))
            return shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
        shd_sight_outline(sight, i);
    }
    if (!shd_sight_order(sight, arena))
        return shd_fail(error, SHD_MEMORY, "/objects", "the limit `memory` is reached");
    *out = sight;
    return SHD_OK;
}
