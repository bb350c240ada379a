/* Flat faces whose planes lights are in, or so near to that rounding would decide on which side a
 * light is. The side must be the same all over a face. */
#include <stdlib.h>
#include <string.h>

#include "plan/bundles.h"

/* A light is in a plane if it is nearer than this times |light| + |point| (docs/model.md). */
static const double IN_PLANE = 16 * 0x1p-52;

/* Nearer to a plane than this times its distance and the face's size, f32's normals and positions
 * may have a light on the wrong side. */
static const double NEAR_PLANE = 1e-5;

enum {
    MOST_PAIRS = 1 << 22, /* of a mesh's faces and lights that are looked at */
    FEW_TRIANGLES = 64,   /* in meshes with more, only lights in the planes count */
    MOST_SHEETS = 32      /* of a light: the nearest ones */
};

typedef struct face {
    shd_vec3 normal, point; /* the unit normal and any point, in the world's frame */
    double size;            /* no point is farther from that one */
    double reach;           /* no point is farther from (0,0,0) */
    bool near;              /* lights near the plane count, too */
} face;

/* gcc does not vectorize a plain loop over these. */
typedef double two __attribute__((vector_size(16)));
typedef int64_t truths __attribute__((vector_size(16)));

typedef struct gathering {
    shd_plan *plan;
    shd_sheets *sheets; /* [light_count] */
    shd_bundles *bundles;
    shd_arena *arena;
    bool full; /* or cancelled */
} gathering;

static bool is_same_plane(const shd_sheet *a, const shd_sheet *b) {
    const shd_vec3 turned = shd_sub(a->normal, b->normal), moved = shd_sub(a->point, b->point);
    return shd_dot(turned, turned) < 1e-29 && a->height == b->height &&
           fabs(shd_dot(a->normal, moved)) <= 1e-15 * (a->size + b->size);
}

static void keep_sheet(gathering *g, size_t light, const shd_sheet *sheet) {
    shd_sheets *to = &g->sheets[light];
    if (!to->list && !(to->list = shd_arena_alloc(g->arena, MOST_SHEETS, sizeof *to->list))) {
        g->full = true;
        return;
    }
    size_t farthest = 0;
    for (size_t i = 0; i < to->count; i++) {
        if (is_same_plane(&to->list[i], sheet)) return;
        if (fabs(to->list[i].height) > fabs(to->list[farthest].height)) farthest = i;
    }
    if (to->count < MOST_SHEETS)
        to->list[to->count++] = *sheet;
    else if (fabs(sheet->height) < fabs(to->list[farthest].height))
        to->list[farthest] = *sheet;
}

static void look_at_light(gathering *g, const face *f, size_t j) {
    const shd_plan_light *light = &g->plan->lights[j];
    if (light->shape || light->environment) return; /* it is in no plane */
    shd_vec3 toward = light->toward;
    double in = IN_PLANE, near = NEAR_PLANE;
    if (!light->directional) {
        toward = shd_sub(light->position, f->point);
        in *= shd_plan_length(light->position) + f->reach;
        near *= shd_plan_length(toward) + f->size;
    }
    const double height = shd_dot(f->normal, toward);
    const bool within = fabs(height) <= in;
    if (!within && !(f->near && fabs(height) <= near)) return;
    keep_sheet(g, j, &(shd_sheet){f->normal, f->point, within ? 0 : height, f->reach + f->size});
}

/* ---- Faces. ---- */

/* Of SHD_TOGETHER rows: how far they are from where the face's normal comes to `offset`. Returns
 * whether any is within the margin. */
static bool find_heights(const face *f, const shd_rows *r, size_t first, double offset,
                         double margin, double heights[SHD_TOGETHER]) {
    truths any = {0, 0};
    for (size_t k = 0; k < SHD_TOGETHER; k += 2) {
        two x, y, z;
        memcpy(&x, &r->x[first + k], sizeof x);
        memcpy(&y, &r->y[first + k], sizeof y);
        memcpy(&z, &r->z[first + k], sizeof z);
        const two height = f->normal.x * x + f->normal.y * y + f->normal.z * z - offset;
        any |= (truths)(height <= margin) & (truths)(height >= -margin);
        memcpy(&heights[k], &height, sizeof height);
    }
    return any[0] | any[1];
}

/* Looks at those of some rows, SHD_TOGETHER at most, that are within the margin. */
static void look_at_rows(gathering *g, const face *f, const shd_rows *r, size_t first, size_t count,
                         double offset, double margin) {
    double heights[SHD_TOGETHER];
    if (!find_heights(f, r, first, offset, margin, heights)) return;
    for (size_t k = 0; k < count; k++)
        if (fabs(heights[k]) <= margin) look_at_light(g, f, r->lights[first + k]);
}

/* Looks at lights that are not clear of the face's plane by any measure: by a margin that is more
 * than what counts as near, and than rounding. */
static void look_at_face(gathering *g, const face *f) {
    const shd_bundles *all = g->bundles;
    g->full = g->full || !shd_bundles_need(g->plan, g->arena, g->bundles);
    const double offset = shd_dot(f->normal, f->point),
                 reach = shd_length_at_most(f->point) + f->size + f->reach,
                 part = f->near ? 2 * NEAR_PLANE : 1e-12;
    for (size_t k = 0; k < all->count && !g->full;) {
        const shd_bundle *b = &all->list[k];
        const double height = fabs(shd_dot(f->normal, b->middle) - offset),
                     aside = fabs(f->normal.x) * b->half.x + fabs(f->normal.y) * b->half.y +
                             fabs(f->normal.z) * b->half.z,
                     margin = part * (b->away + reach);
        const bool clear = height > aside + margin;
        if (!clear && b->count <= SHD_TOGETHER)
            look_at_rows(g, f, &all->placed, b->first, b->count, offset, margin);
        k = clear ? b->next : k + 1;
    }
    for (size_t i = 0; i < all->far.count && !g->full; i += SHD_TOGETHER) {
        const size_t left = all->far.count - i, some = left < SHD_TOGETHER ? left : SHD_TOGETHER;
        look_at_rows(g, f, &all->far, i, some, 0, 2 * NEAR_PLANE);
    }
}

/* Looks at the face of the shape's unit form with this normal and point. */
static void look_at_unit_face(gathering *g, const shd_plan_object *bounds, const shd_affine *map,
                              const shd_affine *normal_map, shd_vec3 normal, shd_vec3 point) {
    face f = {.point = shd_transform(map, point), .size = bounds->radius, .near = true};
    if (!shd_normalize(shd_linear(normal_map, normal), &f.normal)) return;
    if (!bounds->bounded)
        f.size = shd_plan_length(shd_sub(g->plan->scene->camera.position, f.point));
    f.reach = shd_plan_length(f.point) + (bounds->bounded ? f.size : 0);
    look_at_face(g, &f);
}

static void look_at_shape(gathering *g, const shd_object *object, const shd_plan_object *bounds) {
    shd_affine map, inverse;
    if (object->shape == SHD_SPHERE || object->shape == SHD_TORUS) return; /* no face is flat */
    if (!shd_object_frame(object, &map, &inverse)) return;
    const shd_affine normal_map = shd_normal_map(&map);
    static const shd_vec3 axes[] = {{0, 1, 0}, {1, 0, 0}, {0, 0, 1}};
    const int count = object->shape == SHD_BOX        ? 6
                      : object->shape == SHD_CYLINDER ? 2
                      : object->shape == SHD_CONE     ? 1
                                                      : 0;
    for (int i = 0; i < count; i++) { /* the cone's base first */
        const shd_vec3 out = shd_scale(axes[i / 2], i % 2 ? 1 : -1);
        look_at_unit_face(g, bounds, &map, &normal_map, out, shd_scale(out, 0.5));
    }
    if (object->shape == SHD_PLANE || object->shape == SHD_DISC)
        look_at_unit_face(g, bounds, &map, &normal_map, axes[0], (shd_vec3){0, 0, 0});
}

static bool looks_at_mesh(const shd_plan *plan, const shd_mesh *mesh) {
    return mesh->triangle_count <= MOST_PAIRS / (plan->light_count + 1);
}

/* Looks at triangles with normals of their own. */
static void look_at_mesh(gathering *g, const shd_object *object) {
    const shd_mesh *mesh = object->mesh;
    if (mesh->normals && object->interpolation != SHD_FLAT) return;
    if (!looks_at_mesh(g->plan, mesh)) return;
    const shd_affine normal_map = shd_normal_map(&object->transform);
    for (size_t t = 0; t < mesh->triangle_count && !g->full; t++) {
        g->full = shd_is_cancelled_at(g->plan->cancelled, t);
        shd_vec3 p[3];
        face f = {.near = mesh->triangle_count <= FEW_TRIANGLES};
        for (int c = 0; c < 3; c++)
            p[c] = shd_vec3_at(mesh->positions, mesh->indices[3 * t + (size_t)c]);
        const shd_vec3 out = shd_cross(shd_sub(p[1], p[0]), shd_sub(p[2], p[0]));
        if (!shd_normalize(out, &f.normal) ||
            !shd_normalize(shd_linear(&normal_map, f.normal), &f.normal))
            continue;
        for (int c = 0; c < 3; c++) {
            p[c] = shd_transform(&object->transform, p[c]);
            f.reach = shd_larger(f.reach, shd_plan_length(p[c]));
            f.size = shd_larger(f.size, shd_plan_length(shd_sub(p[c], p[0])));
        }
        f.point = p[0];
        look_at_face(g, &f);
    }
}

/* Whether `from`, whose lights are those of the plan and more, has all sheets that these would get:
 * it looked at each mesh that would be looked at. */
static bool has_sheets(const shd_plan *from, const shd_plan *plan) {
    for (size_t i = 0; from && i < plan->scene->object_count; i++) {
        const shd_mesh *mesh = plan->scene->objects[i].mesh;
        if (mesh && looks_at_mesh(plan, mesh) && !looks_at_mesh(from, mesh)) return false;
    }
    return from;
}

bool shd_plan_sheets(shd_plan *plan, const shd_plan *from, shd_bundles *bundles, shd_arena *arena) {
    const shd_scene *scene = plan->scene;
    gathering g = {.plan = plan,
                   .sheets = shd_arena_zalloc(arena, plan->light_count, sizeof *g.sheets),
                   .bundles = bundles,
                   .arena = arena};
    if (!g.sheets) return false;
    const bool known = has_sheets(from, plan);
    for (size_t j = 0, k = 0; known && j < plan->light_count; j++) {
        while (from->lights[k].index != plan->lights[j].index) k++;
        g.sheets[j] = from->sheets[k];
    }
    /* All objects are looked at, whatever lights their lists have, so that lists change no bit. */
    for (size_t i = 0; !known && i < scene->object_count && !g.full; i++) {
        g.full = shd_is_cancelled(plan->cancelled);
        const shd_object *object = &scene->objects[i];
        if (object->shape == SHD_MESH)
            look_at_mesh(&g, object);
        else
            look_at_shape(&g, object, &plan->objects[i]);
    }
    plan->sheets = g.sheets;
    return !g.full;
}
