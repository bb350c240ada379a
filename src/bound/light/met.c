/* What a ray brings is off by what the light of its hit is off by, and by what further rays bring.
 *
 * By planning, rays drift as drift.c says after each number of steps. Tracing knows the cosines and
 * lengths of each path, and so how far it is off, which `shd_strays` turns into light. */
#include "bound/light/met.h"

#include "bound/light/brightest.h"
#include "bound/light/error.h"
#include "bound/light/misplaced.h"
#include "bound/light/sums.h"
#include "plan/around.h"

/* What rays meet of an object: any of its points, from anywhere. Infinite: nothing is known. */
typedef struct met_place {
    const shd_extent *extent;
    double moved;  /* points, along the surface */
    double leg;    /* the same for each length of the ray, on an infinite plane */
    double turned; /* directions to the eye, and twice the normal */
    double normal; /* the normal, by how the surface bends */
    double view;   /* no N.V is less */
} met_place;

/* Beyond that on infinite planes a light is at least 3/4 as far away as the ray was long. */
static double how_far(const shd_extent *extent, const shd_plan_light *light) {
    return 4 * (extent->wide + shd_length(shd_sub(light->position, extent->middle)));
}

/* The light may be as near to the object's points as `nearest`. */
static void see_anywhere(const shd_lit_errors *f, const met_place *at, const shd_plan_light *light,
                         double nearest, shd_glance *g) {
    double moved = 0;
    *g = (shd_glance){.view = at->view, .half = at->view / 2, .drifts = true};
    g->lit = (shd_lit){
        .nearest = nearest, .facing_high = 1, .shine_high = 1, .axis_low = -1, .axis_high = 1};
    g->lit.fall_high = g->lit.factor_high =
        shd_attenuation(light, nearest) * (1 + SHD_PIECE_MARGIN);
    if (!light->directional) {
        const double far = how_far(at->extent, light);
        moved = at->moved / nearest;
        if (!f->place.bounds->bounded)
            moved = shd_larger(moved + far * at->leg / nearest, 2 * (at->moved / far + at->leg));
    }
    /* Lengths and directions change by no more than twice that, while it is small. */
    g->place = shd_smaller(2 * moved, 2);
    g->direction = shd_smaller(SHD_WEIGHT_DIRECTION + g->place + at->turned, 2);
    g->around = shd_turned_around(&f->place, f->material->normal, at->moved, at->normal);
}

static void add_light(shd_lit_errors *f, const met_place *at, const shd_plan_light *light) {
    shd_glance g;
    const double nearest = light->directional ? 0
                           : light->shape     ? shd_shape_distance(&f->place, light->shape)
                                              : shd_least_distance(&f->place, light->position);
    see_anywhere(f, at, light, nearest, &g);
    if (light->environment)
        shd_add_environment(f, light, &g);
    else if (light->shape)
        shd_add_drifted_shape(f, light, &g);
    else
        shd_add_terms(f, light, &g);
}

/* What an object shows by itself. Facets are lit as the camera sees them, where they are; between
 * their corners light changes as if over a tenth of the object. */
static shd_brought meet_object(const shd_plan *plan, size_t index, const met_place *at,
                               double rounding, bool estimated) {
    const shd_plan_object *bounds = &plan->objects[index];
    const shd_object *object = &plan->scene->objects[index];
    shd_lit_errors f = {.plan = plan,
                        .material = &plan->materials[bounds->material],
                        .place = shd_place_of(object, bounds),
                        .estimated = estimated};
    met_place here = *at;
    shd_brought out = {0, 0};
    shd_begin_errors(&f, object);
    if (object->interpolation != SHD_PHONG) {
        here.moved = SHD_HIT_ROUNDING * at->extent->sizes;
        here.turned = here.leg = here.normal = 0;
    }
    for (size_t j = 0; j < bounds->light_count && !shd_is_cancelled(plan->cancelled); j++)
        add_light(&f, &here, &plan->lights[bounds->lights[j]]);
    double between = 0;
    if (object->interpolation == SHD_GOURAUD)
        between = shd_smaller(10 * at->moved / bounds->radius, 1);
    for (int c = 0; c < 3; c++) {
        out.most = shd_larger(out.most, f.most[c]);
        out.error = shd_larger(out.error, f.error[c] + (rounding + between) * f.most[c]);
    }
    return out;
}

/* The same for rays that have drifted. */
static shd_brought meet_drifted(const shd_plan *plan, size_t index, const shd_extent *extent,
                                const shd_drift *drift, double rounding, bool estimated) {
    const shd_place place = shd_place_of(&plan->scene->objects[index], &plan->objects[index]);
    const double bend = shd_misplaced_of(plan->scene, &place).bend, by = 1 / drift->least;
    met_place at = {extent, INFINITY, INFINITY, 2, 2, SHD_LEAST_PATH};
    if (drift->known) {
        const double normal = 1.1 * by * bend * drift->beside;
        at = (met_place){extent,
                         1.1 * by * drift->beside,
                         1.1 * by * drift->turned,
                         by * drift->turned + 2 * normal,
                         normal,
                         drift->least};
    }
    return meet_object(plan, index, &at, rounding, estimated);
}

/* Rays that meet nothing: `turned` is how far off their directions are. */
static shd_brought meet_nothing(const shd_plan *plan, double turned, double rounding) {
    const double most = shd_background_most(plan);
    return (shd_brought){most,
                         rounding * most + shd_smaller(shd_backdrop_slope(plan) * turned, most)};
}

bool shd_lets_through(const shd_plan *plan, size_t object) {
    const shd_coefficients k = shd_coefficients_of(plan, object);
    return plan->scene->trace.depth && !shd_is_all(k.opacity, k.count, 1);
}

/* I = o (local + r I_m + t I_t) + (1 - o) I_b is off by no more than local and (r + t) times what
 * further rays are off by, or by as much as these. */
void shd_add_beyond(const shd_plan *plan, size_t object, shd_brought local,
                    const shd_brought *beyond, shd_brought *out) {
    const double on = shd_sent_on(plan, object);
    out->most = shd_larger(out->most, local.most + on * beyond->most);
    out->error = shd_larger(out->error, local.error + on * beyond->error);
    if (!shd_lets_through(plan, object)) return;
    out->most = shd_larger(out->most, beyond->most);
    out->error = shd_larger(out->error, beyond->error);
}

double shd_background_most(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    double most = shd_backdrop_most(plan);
    if (plan->tinted) return shd_larger(most, shd_most_in_bins(plan->bins, plan->background));
    for (int c = 0; c < 3 && !scene->transparent; c++)
        most = shd_larger(most, fabs(scene->background[c]));
    return most;
}

static bool is_negative(const double color[3]) {
    return color[0] < 0 || color[1] < 0 || color[2] < 0;
}

/* Whether a surface may show less than nothing. Bins' colors are below 0 in some channel. */
static bool may_be_negative(const shd_plan *plan, size_t index) {
    const shd_plan_object *object = &plan->objects[index];
    const shd_plan_material *m = &plan->materials[object->material];
    const shd_light *emitter = plan->scene->objects[index].emitter;
    const shd_coefficients k = shd_coefficients_of(plan, index);
    bool any = plan->bins || is_negative(m->emissive) || is_negative(m->ambient) ||
               is_negative(m->diffuse) || (emitter && is_negative(emitter->color));
    for (size_t t = 0; t < m->lobe_count; t++) any |= is_negative(m->lobes[t].specular);
    for (size_t j = 0; j < object->light_count; j++)
        any |= is_negative(plan->lights[object->lights[j]].color);
    for (size_t c = 0; c < k.count; c++) any |= k.reflection[c] < 0 || k.transmission[c] < 0;
    return any;
}

/* Two rays that bring no more than `most` differ by that, if neither brings less than nothing. */
static double wrong_by(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    double by = scene->transparent || !is_negative(scene->background) ? 1 : 2;
    for (size_t i = 0; i < scene->object_count && by < 2; i++) {
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        if (may_be_negative(plan, i)) by = 2;
    }
    return by;
}

bool shd_adds_up(const shd_plan *plan) {
    return wrong_by(plan) < 2;
}

/* Where drifts are not known, rays may have met anything else. */
shd_brought shd_find_beyond(const shd_plan *plan, double rounding, bool estimated) {
    const shd_scene *scene = plan->scene;
    const shd_extent extent = shd_extent_of(plan);
    shd_brought beyond = {0, 0};
    bool bends = false;
    for (size_t i = 0; i < scene->object_count && !bends; i++) bends = shd_sent_on(plan, i) > 0;
    if (!bends) return beyond;
    shd_drift drifts[SHD_DRIFTS];
    shd_find_drifts(plan, &extent, drifts);
    const double wrong = wrong_by(plan);
    for (int k = scene->trace.depth; k > 0; k--) {
        shd_brought here = meet_nothing(
            plan, drifts[k].known ? SHD_WEIGHT_DIRECTION + 1.1 * drifts[k].turned : 2, rounding);
        for (size_t i = 0; i < scene->object_count; i++) {
            if (shd_is_cancelled(plan->cancelled)) break;
            const shd_brought local =
                meet_drifted(plan, i, &extent, &drifts[k], rounding, estimated);
            shd_add_beyond(plan, i, local, &beyond, &here);
        }
        if (!drifts[k].known) here.error = wrong * here.most;
        beyond = here;
    }
    return beyond;
}

static void fill_stray(const shd_plan *plan, size_t index, const shd_extent *extent,
                       double rounding, shd_stray *out) {
    const shd_place place = shd_place_of(&plan->scene->objects[index], &plan->objects[index]);
    const shd_model model = plan->materials[plan->objects[index].material].model;
    *out = (shd_stray){.plane = !plan->objects[index].bounded,
                       .bend = shd_misplaced_of(plan->scene, &place).bend,
                       .by_view = model != SHD_MODEL_PHONG && model != SHD_MODEL_PHONG_NORMALIZED};
    for (int v = 0; v < SHD_STRAY_VIEWS; v++)
        for (int k = 0; k < SHD_STRAY_LEVELS; k++) {
            const double off = SHD_STRAY_OFF[k];
            const met_place at = {extent, off * extent->wide, 0, off, off / 2, SHD_STRAY_VIEW[v]};
            if (v && !out->by_view) {
                out->error[v][k] = out->error[0][k];
                continue;
            }
            const shd_brought local = meet_object(plan, index, &at, rounding, false);
            out->error[v][k] = local.error;
            out->most = shd_larger(out->most, local.most);
        }
}

void shd_fill_strays(const shd_plan *plan, double rounding, shd_strays *out) {
    const shd_scene *scene = plan->scene;
    const shd_extent extent = shd_extent_of(plan);
    out->slope = shd_backdrop_slope(plan);
    out->wide = extent.wide;
    out->far = 4 * extent.wide;
    for (size_t j = 0; j < plan->light_count; j++)
        if (!plan->lights[j].directional)
            out->far = shd_larger(out->far, how_far(&extent, &plan->lights[j]));
    out->rounding = SHD_DRIFT_ROUNDING * extent.sizes;
    out->further = 3 * SHD_DRIFT_ROUNDING;
    for (size_t i = 0; i < scene->object_count && !shd_is_cancelled(plan->cancelled); i++)
        fill_stray(plan, i, &extent, rounding, &out->of[i]);
}
