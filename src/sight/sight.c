#include "sight/sight.h"

#include <stdio.h>

#include "sight/camera.h"
#include "sight/mesh.h"

/* An object as rays meet it. */
typedef struct item {
    shd_shape shape; /* SHD_MESH for tessellated shapes too */
    double tube;
    bool front_only;
    shd_affine to_world, from_world; /* of the unit form; from_world.origin is not used: points
                                        are taken relative to to_world.origin first */
    shd_affine normal_map;
    bool bounded;
    shd_vec3 center;
    double radius;
    shd_triangles triangles; /* SHD_MESH */
    shd_mesh_tree *tree;
    bool smooth; /* interpolate the mesh's normals at each sample */
    const shd_facets *facets;
} item;

struct shd_sight {
    const shd_plan *plan;
    shd_lens lens;
    item *items; /* as shd_scene.objects */
    size_t count;
    double offset_x[64], offset_y[64]; /* the sample pattern */
};

struct shd_cast_scratch {
    size_t *candidates;
};

/* The nearest hit so far of one sample. */
typedef struct hit {
    double t;
    size_t object;
    shd_vec3 point, normal; /* in the item's unit form */
    uint32_t triangle;
    double u, v;
} hit;

static shd_vec3 turned(shd_vec3 normal, shd_vec3 view, bool front_only) {
    return !front_only && shd_dot(normal, view) < 0 ? shd_scale(normal, -1) : normal;
}

/* A direction that shades somehow where a mesh has no normal at all (a sliver of no area). */
static shd_vec3 world_normal(const item *it, shd_vec3 normal, shd_vec3 view) {
    shd_vec3 out = view;
    shd_normalize(shd_linear(&it->normal_map, normal), &out);
    return turned(out, view, it->front_only);
}

/* ---- Facets: where flat and gouraud objects are lit. ---- */

/* A face's centroid and normal; corners of its triangles all name it. Returns the number of
 * faces. The centroid of a polygon is that of its triangles, weighted by their areas. */
static size_t flat_points(const item *it, shd_vec3 *positions, shd_vec3 *normals,
                          uint32_t *corners) {
    const shd_triangles *tri = &it->triangles;
    size_t faces = 0;
    for (size_t i = 0; i < tri->triangle_count; faces++) {
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

/* The vertices where they have normals, else three points a triangle with its own normal. */
static size_t gouraud_points(const item *it, shd_vec3 *positions, shd_vec3 *normals,
                             uint32_t *corners) {
    const shd_triangles *tri = &it->triangles;
    if (tri->normals) {
        for (size_t i = 0; i < tri->vertex_count; i++) {
            const double *p = tri->positions + 3 * i, *n = tri->normals + 3 * i;
            positions[i] = (shd_vec3){p[0], p[1], p[2]};
            normals[i] = (shd_vec3){n[0], n[1], n[2]};
        }
        for (size_t i = 0; i < 3 * tri->triangle_count; i++) corners[i] = tri->indices[i];
        return tri->vertex_count;
    }
    for (size_t i = 0; i < 3 * tri->triangle_count; i++) {
        positions[i] = shd_triangle_corner(tri, i / 3, (int)(i % 3));
        normals[i] = shd_triangle_normal(tri, i / 3);
        corners[i] = (uint32_t)i;
    }
    return 3 * tri->triangle_count;
}

static bool make_facets(const item *it, bool flat, const shd_lens *lens, shd_arena *arena,
                        const shd_facets **out) {
    const shd_triangles *tri = &it->triangles;
    size_t most = 3 * tri->triangle_count;
    if (!flat && tri->normals) most = tri->vertex_count;
    shd_facets *facets = shd_arena_alloc(arena, 1, sizeof *facets);
    shd_vec3 *positions = shd_arena_alloc(arena, most, sizeof *positions);
    shd_vec3 *normals = shd_arena_alloc(arena, most, sizeof *normals);
    shd_vec3 *views = shd_arena_alloc(arena, most, sizeof *views);
    uint32_t *corners = shd_arena_alloc(arena, 3 * tri->triangle_count, sizeof *corners);
    if (!facets || !positions || !normals || !views || !corners) return false;
    size_t count = flat ? flat_points(it, positions, normals, corners)
                        : gouraud_points(it, positions, normals, corners);
    for (size_t i = 0; i < count; i++) {
        positions[i] = shd_transform(&it->to_world, positions[i]);
        views[i] = shd_lens_view(lens, positions[i]);
        normals[i] = world_normal(it, normals[i], views[i]);
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

static shd_status make_item(const shd_plan *plan, const shd_lens *lens, size_t index,
                            shd_tracer *tracer, shd_arena *arena, item *it, shd_error *error) {
    const shd_object *object = &plan->scene->objects[index];
    shd_vec3 size = shd_unit_size(object);
    shd_affine sized = object->transform;
    for (int r = 0; r < 3; r++) {
        sized.linear[r][0] *= size.x;
        sized.linear[r][1] *= size.y;
        sized.linear[r][2] *= size.z;
    }
    it->shape = object->shape;
    it->tube = object->tube / object->radius;
    it->front_only = plan->materials[object->material].front_only;
    it->to_world = sized;
    it->normal_map = shd_normal_map(&sized);
    it->bounded = shd_object_bounds(object, &it->center, &it->radius);
    shd_affine centered = sized;
    centered.origin = (shd_vec3){0, 0, 0};
    if (!shd_invert(&centered, &it->from_world)) {
        char path[64];
        snprintf(path, sizeof path, "/objects/%zu", index);
        return shd_fail(error, SHD_SCENE, path, "this object's size and transform are singular");
    }

    bool faceted = object->interpolation != SHD_PHONG;
    if (object->shape == SHD_MESH) {
        const shd_mesh *m = object->mesh;
        it->triangles = (shd_triangles){m->vertex_count, m->triangle_count, m->positions,
                                        m->normals,      m->indices,        NULL};
        it->smooth = m->normals && !faceted;
    } else if (faceted) {
        if (!shd_tessellate(object->shape, it->tube, object->segments, arena, &it->triangles))
            return no_memory(error, index);
        it->shape = SHD_MESH;
    }
    if (faceted && !make_facets(it, object->interpolation == SHD_FLAT, lens, arena, &it->facets))
        return no_memory(error, index);
    if (it->shape != SHD_MESH) return SHD_OK;
    return shd_mesh_tree_new(&it->triangles, tracer, arena, &it->tree, error);
}

shd_status shd_sight_new(const shd_plan *plan, shd_tracer *tracer, shd_arena *arena,
                         shd_sight **out, shd_error *error) {
    const shd_scene *scene = plan->scene;
    shd_sight *sight = shd_arena_zalloc(arena, 1, sizeof *sight);
    item *items = shd_arena_zalloc(arena, scene->object_count, sizeof *items);
    if (!sight || !items)
        return shd_fail(error, SHD_MEMORY, "/objects", "the limit `memory` is reached");
    sight->plan = plan;
    sight->lens = shd_lens_make(&scene->camera, &scene->raster);
    sight->items = items;
    for (int i = 0; i < scene->raster.samples; i++)
        shd_sample_offset(i, scene->raster.samples, &sight->offset_x[i], &sight->offset_y[i]);
    for (size_t i = 0; i < scene->object_count; i++) {
        shd_status status = make_item(plan, &sight->lens, i, tracer, arena, &items[i], error);
        sight->count = i + 1;
        if (status != SHD_OK) {
            shd_sight_drop(sight);
            return status;
        }
    }
    *out = sight;
    return SHD_OK;
}

void shd_sight_drop(shd_sight *sight) {
    if (!sight) return;
    for (size_t i = 0; i < sight->count; i++) shd_mesh_tree_drop(sight->items[i].tree);
}

shd_cast_scratch *shd_cast_scratch_new(const shd_sight *sight, shd_arena *arena) {
    shd_cast_scratch *scratch = shd_arena_alloc(arena, 1, sizeof *scratch);
    if (!scratch) return NULL;
    scratch->candidates = shd_arena_alloc(arena, sight->count, sizeof *scratch->candidates);
    return scratch->candidates ? scratch : NULL;
}

bool shd_gbuffer_new(size_t count, shd_arena *arena, shd_gbuffer *out) {
    double *values = shd_arena_alloc(arena, 12 * count, sizeof *values);
    int32_t *object = shd_arena_alloc(arena, count, sizeof *object);
    uint32_t *triangle = shd_arena_alloc(arena, count, sizeof *triangle);
    if (!values || !object || !triangle) return false;
    *out = (shd_gbuffer){.depth = values + 9 * count,
                         .u = values + 10 * count,
                         .v = values + 11 * count,
                         .object = object,
                         .triangle = triangle};
    for (int c = 0; c < 3; c++) {
        out->position[c] = values + (size_t)c * count;
        out->normal[c] = values + (size_t)(3 + c) * count;
        out->view[c] = values + (size_t)(6 + c) * count;
    }
    return true;
}

/* ---- Casting. ---- */

/* Whether a sphere may be seen through a tile: against the cone (perspective) or cylinder
 * (orthographic) around the tile's rays, a little widened so that rounding drops nothing. */
static bool may_see(const item *it, const shd_lens *lens, shd_vec3 origin, shd_vec3 axis,
                    double spread) {
    if (!it->bounded) return true;
    shd_vec3 to = shd_sub(it->center, origin);
    double radius = it->radius * (1 + 1e-9);
    double distance = shd_length(to);
    if (!isfinite(distance) || distance <= radius) return true;
    if (lens->camera->projection == SHD_ORTHOGRAPHIC)
        return shd_length(shd_cross(to, axis)) <= (spread + radius) * (1 + 1e-9);
    shd_vec3 side = shd_cross(shd_scale(to, 1 / distance), axis);
    double angle = atan2(shd_length(side), shd_dot(to, axis) / distance);
    return angle <= spread + asin(radius / distance) + 1e-9;
}

static size_t find_candidates(const shd_sight *sight, shd_tile tile, size_t *candidates) {
    const shd_lens *lens = &sight->lens;
    shd_vec3 origin, axis;
    shd_lens_ray(lens, tile.x + tile.w / 2.0, tile.y + tile.h / 2.0, &origin, &axis);
    double spread = 0;
    for (int corner = 0; corner < 4; corner++) {
        shd_vec3 from, toward;
        shd_lens_ray(lens, tile.x + (corner & 1 ? tile.w : 0), tile.y + (corner & 2 ? tile.h : 0),
                     &from, &toward);
        double reach = lens->camera->projection == SHD_ORTHOGRAPHIC
                           ? shd_length(shd_sub(from, origin))
                           : atan2(shd_length(shd_cross(axis, toward)), shd_dot(axis, toward));
        spread = fmax(spread, reach);
    }
    size_t count = 0;
    for (size_t i = 0; i < sight->count; i++)
        if (may_see(&sight->items[i], lens, origin, axis, spread)) candidates[count++] = i;
    return count;
}

/* Meets one object; replaces `best` where it is nearer. At equal distance the object that comes
 * first in the scene stays. */
static void meet(const item *it, size_t object, shd_vec3 origin, shd_vec3 direction, hit *best) {
    shd_ray ray = {shd_linear(&it->from_world, shd_sub(origin, it->to_world.origin)),
                   shd_linear(&it->from_world, direction), 0};
    if (it->shape == SHD_MESH) {
        double t, u, v;
        uint32_t triangle;
        if (!shd_mesh_tree_intersect(it->tree, &ray, &t, &triangle, &u, &v) || !(t < best->t))
            return;
        *best = (hit){.t = t, .object = object, .triangle = triangle, .u = u, .v = v};
        return;
    }
    shd_surface surface;
    if (!shd_intersect(it->shape, it->tube, &ray, &surface) || !(surface.t < best->t)) return;
    *best =
        (hit){.t = surface.t, .object = object, .point = surface.point, .normal = surface.normal};
}

/* The point and normal of a mesh hit, from barycentrics. */
static void place_on_mesh(const item *it, hit *h) {
    const shd_triangles *tri = &it->triangles;
    const double weight[3] = {1 - h->u - h->v, h->u, h->v};
    h->point = h->normal = (shd_vec3){0, 0, 0};
    for (int k = 0; k < 3; k++)
        h->point = shd_madd(h->point, shd_triangle_corner(tri, h->triangle, k), weight[k]);
    if (it->smooth) {
        for (int k = 0; k < 3; k++) {
            const double *n = tri->normals + 3 * (size_t)tri->indices[3 * h->triangle + (size_t)k];
            shd_vec3 unit = {n[0], n[1], n[2]};
            shd_normalize(unit, &unit);
            h->normal = shd_madd(h->normal, unit, weight[k]);
        }
    }
    if (!(shd_max_abs(h->normal) > 0)) h->normal = shd_triangle_normal(tri, h->triangle);
}

static void store(double *const out[3], size_t i, shd_vec3 value) {
    out[0][i] = value.x;
    out[1][i] = value.y;
    out[2][i] = value.z;
}

size_t shd_sight_cast(const shd_sight *sight, shd_tile tile, shd_cast_scratch *scratch,
                      shd_gbuffer *out) {
    const int samples = sight->plan->scene->raster.samples;
    size_t *candidates = scratch->candidates;
    size_t candidate_count = find_candidates(sight, tile, candidates);
    shd_vec3 forward = shd_scale(sight->lens.camera->back, -1);
    size_t i = 0, hits = 0;
    for (int y = tile.y; y < tile.y + tile.h; y++) {
        for (int x = tile.x; x < tile.x + tile.w; x++) {
            for (int s = 0; s < samples; s++, i++) {
                out->object[i] = SHD_NOTHING;
                if (!candidate_count) continue;
                shd_vec3 origin, direction;
                shd_lens_ray(&sight->lens, x + sight->offset_x[s], y + sight->offset_y[s], &origin,
                             &direction);
                hit best = {.t = INFINITY};
                for (size_t k = 0; k < candidate_count; k++)
                    meet(&sight->items[candidates[k]], candidates[k], origin, direction, &best);
                if (best.t == INFINITY) continue;

                const item *it = &sight->items[best.object];
                if (it->shape == SHD_MESH) place_on_mesh(it, &best);
                shd_vec3 view = shd_scale(direction, -1);
                store(out->position, i, shd_transform(&it->to_world, best.point));
                store(out->normal, i, world_normal(it, best.normal, view));
                store(out->view, i, view);
                out->depth[i] = best.t * shd_dot(direction, forward);
                out->object[i] = (int32_t)best.object;
                out->triangle[i] = best.triangle;
                out->u[i] = best.u;
                out->v[i] = best.v;
                hits++;
            }
        }
    }
    out->count = i;
    return hits;
}
