#include "trace/bounce.h"

#include <string.h>

#include "plan/parts.h"
#include "shade/backdrop.h"
#include "shade/beam.h"
#include "shade/bump.h"
#include "trace/stray.h"

enum { DEPTH = 16, WAITING = 2 * DEPTH + 4 };

/* A ray that is still to be followed. */
typedef struct step {
    shd_ray ray;
    int depth;     /* steps, this one among them */
    bool straight; /* it goes on from the eye */
    double length; /* of the way from the eye to where it begins */
    shd_stray_ray stray;
} step;

typedef struct path {
    const shd_bouncing *b;
    void *scratch;
    size_t channels;
    double *weight; /* [channels]: of the step in hand: the product of coefficients */
    double *mirrored, *refracted, *behind; /* [channels]: the same of rays that go on from it */
    double (*local)[3];                    /* [channels]; but for bins, the first is all */
    double *weights;                       /* [WAITING][channels] */
    step waiting[WAITING];
    shd_sharp_point sharp; /* of the hit in hand, if its lobes are not the material's */
    int waits;
    double through; /* the mean share of a transparent background */
    shd_bounced out;
} path;

static const shd_material *material_of(const shd_plan *plan, size_t object) {
    return plan->materials[plan->objects[object].material].from;
}

const bool *shd_bouncing_objects(const shd_plan *plan, shd_arena *arena) {
    const size_t count = plan->scene->object_count;
    bool *bounces = shd_arena_alloc(arena, count, sizeof *bounces);
    for (size_t i = 0; bounces && i < count; i++) {
        const shd_coefficients k = shd_coefficients_of(plan, i);
        bounces[i] = !(shd_is_all(k.opacity, k.count, 1) && shd_is_all(k.reflection, k.count, 0) &&
                       shd_is_all(k.transmission, k.count, 0));
    }
    return bounces;
}

/* ---- Directions. ---- */

static shd_vec3 mirror(shd_vec3 ray, shd_vec3 n) {
    return shd_madd(ray, n, -2 * shd_dot(ray, n));
}

/* The direction behind a surface whose normal faces the ray. False: there is none. */
static bool refract(shd_vec3 ray, shd_vec3 n, double eta, shd_vec3 *out) {
    const double in = -shd_dot(ray, n), square = 1 - eta * eta * (1 - in * in);
    if (!(square >= 0)) return false;
    *out = shd_madd(shd_scale(ray, eta), n, eta * in - sqrt(square));
    return true;
}

/* A surface as a ray meets it. */
typedef struct facing {
    shd_vec3 own, normal; /* unit, on the ray's side */
    bool inside;          /* the ray comes from behind */
} facing;

static facing face_ray(shd_vec3 ray, shd_vec3 own, shd_vec3 normal) {
    facing f = {own, normal, shd_dot(ray, own) > 0};
    if (f.inside) f.own = shd_scale(own, -1);
    if (shd_dot(ray, normal) > 0) f.normal = shd_scale(normal, -1);
    return f;
}

static shd_vec3 find_mirrored(shd_vec3 ray, const facing *f) {
    shd_vec3 way = mirror(ray, f->normal);
    if (!(shd_dot(way, f->own) > 0)) way = mirror(ray, f->own);
    shd_normalize(way, &way);
    return way;
}

/* *at: the normal at which the ray is bent. */
static bool find_refracted(shd_vec3 ray, const facing *f, double eta, shd_vec3 *out, shd_vec3 *at) {
    *at = f->normal;
    if (!refract(ray, *at, eta, out)) return false;
    if (!(shd_dot(*out, f->own) < 0)) {
        *at = f->own;
        if (!refract(ray, *at, eta, out)) return false;
    }
    return shd_normalize(*out, out);
}

/* ---- Steps. ---- */

static void keep(const path *p, const double *from, double *to) {
    if (p->channels == 3)
        for (int c = 0; c < 3; c++) to[c] = from[c];
    else
        memcpy(to, from, p->channels * sizeof *to);
}

static double *weights_of(const path *p, int waiting) {
    return p->weights + (size_t)waiting * p->channels;
}

static double most_of(const path *p, const double *weight) {
    if (p->channels == 3)
        return shd_larger(fabs(weight[0]), shd_larger(fabs(weight[1]), fabs(weight[2])));
    double most = 0;
    for (size_t c = 0; c < p->channels; c++) most = shd_larger(fabs(weight[c]), most);
    return most;
}

/* Products of coefficients that are equal to minContribution but for their rounding are not below
 * it.
 */
static const double ABOUT_ONE = 1 - 1e-14;

/* A ray that goes on. */
typedef struct going {
    shd_vec3 direction;
    const double *weight; /* [channels] */
    bool straight;
    shd_stray_ray stray;
} going;

/* Puts a ray off until later, unless it adds nothing or too little. */
static void add_step(path *p, const step *from, const going *g) {
    const shd_trace *trace = &p->b->plan->scene->trace;
    const double most = most_of(p, g->weight);
    if (!(most > 0)) return;
    if (from->depth >= trace->depth || most < ABOUT_ONE * trace->min_contribution) {
        p->out.cut += most;
        return;
    }
    keep(p, g->weight, weights_of(p, p->waits));
    step *next = &p->waiting[p->waits++];
    *next = (step){.ray = from->ray,
                   .depth = from->depth + 1,
                   .straight = g->straight,
                   .length = from->length,
                   .stray = g->stray};
    next->ray.direction = g->direction;
}

/* What of the step's share goes on which way. */
static inline void share_out(const path *p, const shd_coefficients *k, bool bends, size_t n) {
    for (size_t c = 0; c < n; c++) {
        const double solid = p->weight[c] * k->opacity[c];
        p->mirrored[c] = solid * (k->reflection[c] + (bends ? 0 : k->transmission[c]));
        p->refracted[c] = bends ? solid * k->transmission[c] : 0;
        p->behind[c] = p->weight[c] * (1 - k->opacity[c]);
    }
}

/* Adds the rays that go on from a surface. `from` has its place, and the share of what is seen
 * there. */
static void go_on(path *p, const step *from, shd_vec3 ray, const facing *f, size_t object,
                  const shd_coefficients *k, shd_stray_hit *hit) {
    const shd_material *m = material_of(p->b->plan, object);
    const double eta = f->inside ? m->ior : 1 / m->ior;
    going mirrored = {.direction = find_mirrored(ray, f), .weight = p->mirrored},
          refracted = {.direction = ray, .weight = p->refracted},
          behind = {.direction = ray,
                    .weight = p->behind,
                    .straight = from->straight,
                    .stray = shd_stray_straight(hit)};
    shd_vec3 at = f->normal;
    const bool any = !shd_is_all(k->transmission, k->count, 0),
               bends = any && find_refracted(ray, f, eta, &refracted.direction, &at);
    if (p->channels == 3)
        share_out(p, k, bends, 3);
    else
        share_out(p, k, bends, p->channels);
    const double in = fabs(shd_dot(ray, at));
    if (any) hit->ray.lost |= shd_stray_turns(hit, eta, in);
    mirrored.stray = shd_stray_mirrored(hit, shd_dot(mirrored.direction, f->own));
    if (bends)
        refracted.stray = shd_stray_refracted(hit, eta, in, fabs(shd_dot(refracted.direction, at)),
                                              shd_dot(refracted.direction, f->own));
    add_step(p, from, &mirrored);
    add_step(p, from, &refracted);
    add_step(p, from, &behind);
}

/* What is seen at a hit, but for what lies beyond. */
static void add_local(path *p, const double *opacity, const double (*local)[3]) {
    const double *weight = p->weight;
    for (size_t b = 0; p->b->plan->tinted && b < p->channels; b++) {
        const double by = weight[b] * opacity[b];
        for (int c = 0; c < 3; c++) p->out.radiance[c] += by * local[b][c];
    }
    for (int c = 0; !p->b->plan->tinted && c < 3; c++)
        if (weight[c] != 0) p->out.radiance[c] += weight[c] * opacity[c] * local[0][c];
}

static void add_background(path *p, const step *s) {
    const shd_plan *plan = p->b->plan;
    const shd_scene *scene = plan->scene;
    if (scene->transparent && s->straight) p->through += shd_mean_share(plan, p->weight);
    double behind[3], lifted[SHD_BINS_MOST];
    memcpy(behind, scene->background, sizeof behind);
    if (scene->backdrop) {
        shd_backdrop_at(scene->backdrop, s->ray.direction, behind);
        p->out.edge |= s->stray.lost;
        p->out.error += most_of(p, p->weight) * p->b->strays->slope * s->stray.turned;
    }
    if (plan->tinted) {
        const double *weight = p->weight;
        if (scene->backdrop) {
            shd_bins_lift(plan->bins, behind, lifted);
            for (size_t b = 0; b < p->channels; b++) lifted[b] *= p->weight[b];
            weight = lifted;
        }
        shd_bins_mix(p->channels, weight,
                     scene->backdrop ? (const double(*)[3])plan->bins->white : plan->background,
                     behind);
        for (int c = 0; c < 3; c++) p->out.radiance[c] += behind[c];
        return;
    }
    for (int c = 0; c < 3; c++) p->out.radiance[c] += p->weight[c] * behind[c];
}

static void follow_step(path *p, step *s) {
    const shd_bouncing *b = p->b;
    const shd_plan *plan = b->plan;
    shd_meeting met;
    p->out.rays++;
    if (!shd_cast_ray(b->caster, &s->ray, NULL, 0, NULL, &met)) {
        add_background(p, s);
        return;
    }
    const shd_met_at at = shd_met_place(b->caster, &met);
    const shd_vec3 ray = s->ray.direction;
    shd_stray_hit hit =
        shd_stray_meet(b->strays, &s->stray, met.t, met.object, fabs(shd_dot(at.own, ray)));
    const shd_plan_material *material = &plan->materials[plan->objects[met.object].material];
    /* The side is decided by the surface's own normal; an interpolated one is then left as it is.
     */
    const bool turned = !material->front_only && shd_dot(at.own, ray) > 0;
    shd_surface surface = {.position = at.position,
                           .normal = turned ? shd_scale(at.normal, -1) : at.normal,
                           .view = shd_scale(ray, -1),
                           .material = material,
                           .object = met.object,
                           .triangle = met.triangle};
    surface.mirror = mirror(ray, surface.normal);
    s->length += met.t;
    const bool varies = material->textures || material->normal || material->gloss;
    const double width = varies ? shd_beam_width(plan->scene, s->length) : 0;
    const shd_beam beam = {met.object, met.triangle, at.position, at.own, ray, width};
    shd_ray_rows rows;
    const bool rayed = material->textures && material->textures->rayed;
    const shd_coefficients k =
        rayed ? shd_coefficients_at(plan, &beam, rows) : shd_coefficients_of(plan, met.object);
    if (shd_sharpens(plan, met.object)) shd_bump_beam(plan->scene, &beam, &p->sharp, &surface);
    b->local.light(b->local.context, p->scratch, &surface, &met, width, p->local);
    p->out.edge |= hit.ray.lost;
    if (!hit.ray.lost)
        p->out.error +=
            most_of(p, p->weight) *
            shd_stray_error(b->strays, &hit, met.object, shd_dot(surface.normal, surface.view));
    add_local(p, k.opacity, (const double(*)[3])p->local);
    if (!b->bounces[met.object]) return;
    s->ray = (shd_ray){at.position, ray, INFINITY, {(int32_t)met.object, met.triangle, at.own}};
    const facing f = face_ray(ray, at.own, surface.normal);
    go_on(p, s, ray, &f, met.object, &k, &hit);
}

/* Beside what waits: the weights of a step and of what goes on from it, and local light. */
enum { ROWS = WAITING + 4 + 3 };

size_t shd_bounce_room(const shd_plan *plan) {
    return ROWS * shd_ray_channels(plan);
}

static void share_room(path *p, double *room) {
    const size_t n = p->channels = shd_ray_channels(p->b->plan);
    p->local = (double(*)[3])(void *)room;
    p->weight = room + 3 * n;
    p->mirrored = p->weight + n;
    p->refracted = p->mirrored + n;
    p->behind = p->refracted + n;
    p->weights = p->behind + n;
    for (size_t c = 0; c < n; c++) p->weight[c] = 1;
}

shd_bounced shd_bounce(const shd_bouncing *b, void *scratch, double *room, const shd_surface *at,
                       const double (*local)[3]) {
    path p; /* the steps are left as they are: there are many, and few are taken */
    p.b = b;
    p.scratch = scratch;
    p.waits = 0;
    p.through = 0;
    p.out = (shd_bounced){0};
    share_room(&p, room);
    const shd_vec3 ray = shd_scale(at->view, -1),
                   own = shd_outward_normal(b->caster, at->object, at->triangle, at->position,
                                            shd_flat_normal(at));
    const double away = shd_length(shd_sub(at->position, b->plan->scene->camera.position));
    const step first = {
        .ray = {at->position, ray, INFINITY, {(int32_t)at->object, at->triangle, own}},
        .straight = true,
        .length = away,
        .stray = {0, 16 * 0x1p-53, false}};
    const facing f = face_ray(ray, own, at->normal);
    const shd_coefficients k = at->rays ? *at->rays : shd_coefficients_of(b->plan, at->object);
    add_local(&p, k.opacity, local);
    shd_stray_hit hit =
        shd_stray_meet(b->strays, &first.stray, away, at->object, fabs(shd_dot(ray, own)));
    go_on(&p, &first, ray, &f, at->object, &k, &hit);
    while (p.waits && !shd_is_cancelled(b->plan->cancelled)) {
        step next = p.waiting[--p.waits];
        keep(&p, weights_of(&p, p.waits), p.weight);
        follow_step(&p, &next);
    }
    p.out.alpha = 1 - p.through;
    return p.out;
}
