#include "bound/light/crowd.h"

#include <stdlib.h>
#include <string.h>

#include "bound/light/finding.h"
#include "plan/morton.h"

enum {
    TOGETHER = 16, /* objects that have something in common, at most */
    KINDS = 64     /* of objects; more have nothing in common */
};

/* Spots that are nearer to objects than this times the radius of a sphere around them are looked at
 * for each of them. */
static const double NEAR = 2;

typedef struct member {
    uint32_t object, kind, key;
} member;

/* ---- The order. ---- */

static bool is_round(const shd_object *object) {
    double axes[3];
    const shd_affine to_world = shd_object_to_world(object);
    return shd_is_similar(&to_world, axes);
}

/* Whether errors of two objects differ by their places and colors alone; by places alone, if
 * influences are wanted, which are of colors. */
static bool are_alike(const shd_finding *f, size_t x, size_t y) {
    const shd_plan *plan = f->plan;
    const shd_object *a = &plan->scene->objects[x], *b = &plan->scene->objects[y];
    if (a->shape != b->shape || a->interpolation != b->interpolation || is_round(a) != is_round(b))
        return false;
    if (plan->objects[x].group == plan->objects[y].group) return true;
    const shd_plan_material *m = &plan->materials[plan->objects[x].material],
                            *n = &plan->materials[plan->objects[y].material];
    if (f->influences || m->lobe_count != n->lobe_count) return false;
    for (size_t k = 0; k < m->lobe_count; k++)
        if (m->lobes[k].shininess != n->lobes[k].shininess) return false;
    return true;
}

/* 1 and more; 0: it has none. */
static uint32_t kind_of(const shd_finding *f, size_t index, size_t *first, uint32_t *count) {
    if (!shd_is_clustered(f, &f->plan->objects[index])) return 0;
    for (uint32_t k = 0; k < *count; k++)
        if (are_alike(f, first[k], index)) return k + 1;
    if (*count == KINDS) return 0;
    first[(*count)++] = index;
    return *count;
}

static int compare_members(const void *x, const void *y) {
    const member *a = x, *b = y;
    if (a->kind != b->kind) return a->kind < b->kind ? -1 : 1;
    if (a->kind && a->key != b->key) return a->key < b->key ? -1 : 1;
    return a->object < b->object ? -1 : a->object > b->object;
}

bool shd_crowd_new(shd_finding *f, size_t terms, shd_arena *arena) {
    const shd_plan *plan = f->plan;
    const size_t count = plan->scene->object_count;
    shd_crowds *out = &f->crowd;
    member *members = shd_arena_alloc(arena, count, sizeof *members);
    *out = (shd_crowds){.objects = shd_arena_alloc(arena, count, sizeof *out->objects),
                        .kinds = shd_arena_alloc(arena, count, sizeof *out->kinds),
                        .much = shd_arena_alloc(arena, terms, sizeof *out->much)};
    if (!members || !out->objects || !out->kinds || !out->much) return false;
    shd_vec3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < count; i++) {
        if (!plan->objects[i].bounded) continue;
        low = shd_vec3_min(low, plan->objects[i].center);
        high = shd_vec3_max(high, plan->objects[i].center);
    }
    size_t first[KINDS];
    uint32_t kinds = 0;
    for (size_t i = 0; i < count; i++) {
        if (shd_is_cancelled_at(plan->cancelled, i)) return false;
        members[i] = (member){(uint32_t)i, kind_of(f, i, first, &kinds), 0};
        if (members[i].kind)
            members[i].key = shd_morton(plan->objects[i].center, low, shd_sub(high, low));
    }
    qsort(members, count, sizeof *members, compare_members);
    for (size_t i = 0; i < count; i++) {
        out->objects[i] = members[i].object;
        out->kinds[i] = members[i].kind;
    }
    return true;
}

size_t shd_crowd_enter(shd_finding *f, size_t at) {
    shd_crowds *crowd = &f->crowd;
    if (at >= crowd->end) {
        const size_t left = f->plan->scene->object_count - at,
                     most = left < TOGETHER ? left : TOGETHER;
        size_t some = 1;
        while (crowd->kinds[at] && some < most && crowd->kinds[at + some] == crowd->kinds[at])
            some++;
        crowd->first = at;
        crowd->end = at + some;
        crowd->known = false;
    }
    return crowd->objects[at];
}

/* ---- What objects have in common. ---- */

/* As if they were one object: around all, and with whatever is worst of any. */
typedef struct whole {
    shd_plan_object bounds;
    shd_object object;
    shd_place place;
    shd_misplaced misplaced;
} whole;

static void take_whole(const shd_finding *f, whole *out) {
    const shd_plan *plan = f->plan;
    const uint32_t *objects = &f->crowd.objects[f->crowd.first];
    const size_t count = f->crowd.end - f->crowd.first;
    shd_vec3 low = plan->objects[*objects].center, high = low;
    out->bounds = *f->place.bounds;
    out->object = *f->place.object;
    out->misplaced = f->misplaced;
    double away = 0;
    for (size_t i = 0; i < count; i++) {
        low = shd_vec3_min(low, plan->objects[objects[i]].center);
        high = shd_vec3_max(high, plan->objects[objects[i]].center);
    }
    shd_plan_object *bounds = &out->bounds;
    bounds->center = shd_madd(shd_scale(low, 0.5), high, 0.5);
    bounds->radius = 0;
    for (size_t i = 0; i < count; i++) {
        const shd_object *object = &plan->scene->objects[objects[i]];
        const shd_plan_object *one = &plan->objects[objects[i]];
        const shd_place place = shd_place_of(object, one);
        const shd_misplaced m = shd_misplaced_of(plan->scene, &place);
        const double reach = shd_plan_length(shd_sub(one->center, bounds->center)) + one->radius;
        bounds->radius = shd_larger(bounds->radius, reach);
        away = shd_larger(away, shd_plan_length(object->transform.origin));
        out->misplaced.span = shd_larger(out->misplaced.span, m.span);
        out->misplaced.moved = shd_larger(out->misplaced.moved, m.moved);
        out->misplaced.grazing = shd_smaller(out->misplaced.grazing, m.grazing);
        out->misplaced.turned = shd_larger(out->misplaced.turned, m.turned);
    }
    bounds->radius *= 1 + SHD_PIECE_MARGIN;
    out->object.transform.origin = (shd_vec3){away, 0, 0}; /* of which the length counts */
    out->place = (shd_place){.object = &out->object, .bounds = &out->bounds};
}

/* Counts spots that are far from all, and keeps those that are near to some. */
static void part_spots(shd_finding *f, const whole *all, const shd_piece *piece,
                       double *influences) {
    const shd_plan *plan = f->plan;
    shd_clusters *clusters = &f->clusters;
    const shd_plan_object *bounds = &all->bounds;
    clusters->near_alone_count = 0;
    for (size_t i = 0; i < clusters->alone_count; i++) {
        const uint32_t j = clusters->alone[i];
        const shd_vec3 path = shd_sub(plan->lights[j].position, bounds->center);
        if (shd_outside_cone(&plan->lights[j], path, bounds->radius)) continue;
        const shd_source from = shd_source_of(f, j);
        if (from.least > NEAR * bounds->radius)
            shd_add_light(f, &plan->materials[bounds->material], &from, j, piece, influences);
        else
            clusters->near_alone[clusters->near_alone_count++] = j;
    }
}

static void find_common(shd_finding *f, double *influences) {
    const shd_plan *plan = f->plan;
    const shd_vec3 back = plan->scene->camera.back;
    const shd_place place = f->place;
    const shd_misplaced misplaced = f->misplaced;
    whole all;
    take_whole(f, &all);
    const shd_piece piece = {.center = all.bounds.center,
                             .radius = all.bounds.radius,
                             .axis = back,
                             .mirror = back,
                             .spread = SHD_ANY_ANGLE,
                             .glitter = SHD_ANY_ANGLE};
    f->place = all.place;
    f->misplaced = all.misplaced;
    const shd_cluster_target target = {all.bounds.center, all.bounds.radius,
                                       all.object.interpolation == SHD_PHONG};
    shd_clusters_part(&f->clusters, &target);
    shd_add_cut(f, &all.bounds, &target, &piece);
    part_spots(f, &all, &piece, influences);
    f->place = place;
    f->misplaced = misplaced;
}

void shd_crowd_begin(shd_finding *f, double *influences) {
    shd_crowds *crowd = &f->crowd;
    const size_t size = f->terms.count * sizeof *crowd->much;
    if (crowd->known) {
        memcpy(f->much, crowd->much, size);
        f->ratio = crowd->ratio;
        f->distance = crowd->distance;
        return;
    }
    find_common(f, influences);
    memcpy(crowd->much, f->much, size);
    crowd->ratio = f->ratio;
    crowd->distance = f->distance;
    crowd->known = true;
}
