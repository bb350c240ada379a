#include "bound/light/extended.h"

#include "bound/light/brightest.h"
#include "bound/light/drift.h"
#include "bound/light/error.h"
#include "bound/light/misplaced.h"
#include "bound/light/pieces.h"
#include "bound/light/weights.h"

static double smaller_of(double a, double b) {
    return a < b ? a : b;
}

/* ---- Lights at a piece. ---- */

/* What is found of an object's pieces. */
typedef struct finding {
    const shd_plan *plan;
    const shd_plan_material *material;
    const double *noise; /* of a material's microgeometry; NULL: it has none */
    double steps;        /* on straight rays, by as much more f64 misplaces points */
    shd_misplaced misplaced;
    shd_place place;
    double most[3], error[3]; /* of the piece in question */
} finding;

/* The direction to the eye from the piece's middle; those from its other points are within the
 * spread. */
static shd_vec3 toward_eye(const shd_scene *scene, const shd_piece *piece, shd_angle *spread) {
    const shd_camera *camera = &scene->camera;
    *spread = (shd_angle){1, 0};
    if (camera->projection == SHD_ORTHOGRAPHIC) return camera->back;
    const shd_vec3 path = shd_sub(camera->position, piece->center);
    const double distance = shd_plan_length(path);
    *spread = distance > 0 && isfinite(piece->radius) ? shd_seen_from(piece->radius, 1 / distance)
                                                      : SHD_ANY_ANGLE;
    return distance > 0 ? shd_scale(path, 1 / distance) : camera->back;
}

/* ---- Lights where rays from mirrors and glass end. ---- */

/* What rays meet of an object after some steps: any of its points, from anywhere. */
typedef struct met_place {
    const shd_drift *drift;
    const shd_extent *extent;
    double bend; /* of the object */
} met_place;

/* `nearest`: how near the light may be to the object's points. Beyond `wide` of all that is
 * bounded, on infinite planes, a light is at least 3/4 as far away as the ray was long. */
static void see_anywhere(const finding *f, const met_place *at, const shd_plan_light *light,
                         double nearest, shd_glance *g) {
    const shd_drift *d = at->drift;
    const double known = d->known ? 1 / d->least : INFINITY;
    double moved = 0;
    *g = (shd_glance){.view = d->known ? d->least : SHD_LEAST_PATH, .drifts = true};
    g->lit = (shd_lit){
        .nearest = nearest, .facing_high = 1, .shine_high = 1, .axis_low = -1, .axis_high = 1};
    g->lit.fall_high = g->lit.factor_high =
        shd_attenuation(light, nearest) * (1 + SHD_PIECE_MARGIN);
    if (!light->directional) {
        const double far = 4 * (at->extent->wide +
                                shd_length(shd_sub(light->position, at->extent->middle))),
                     beside = d->beside + far * d->turned;
        const bool bounded = f->place.bounds->bounded;
        moved = known * (bounded ? d->beside : beside) / nearest;
        if (!bounded) moved = shd_larger(moved, known * 2 * (d->beside / far + d->turned));
    }
    /* Lengths and directions change by no more than twice that, while it is small. */
    g->place = smaller_of(2 * moved, 2);
    g->direction = smaller_of(
        SHD_WEIGHT_DIRECTION + g->place + known * (d->turned + 2.2 * at->bend * d->beside), 2);
    g->half = g->view / 2;
}

static void see_piece(const finding *f, const shd_piece *piece, const shd_plan_light *light,
                      shd_glance *g) {
    shd_angle eyes, lights = {1, 0};
    const shd_vec3 eye = toward_eye(f->plan->scene, piece, &eyes);
    shd_vec3 toward = light->toward;
    if (!light->directional) {
        const shd_vec3 path = shd_sub(light->position, piece->center);
        const double distance = shd_plan_length(path);
        lights = distance > 0 && isfinite(piece->radius)
                     ? shd_seen_from(piece->radius, 1 / distance)
                     : SHD_ANY_ANGLE;
        toward = distance > 0 ? shd_scale(path, 1 / distance) : eye;
    }
    g->drifts = false;
    const double between =
        shd_cosine_more(shd_angle_of(shd_dot(eye, toward)), shd_angle_sum(eyes, lights));
    const double facing = shd_cosine_more(shd_angle_of(shd_dot(piece->axis, eye)),
                                          shd_angle_sum(eyes, piece->spread));
    g->view = shd_larger(facing, f->misplaced.grazing > 0 ? f->misplaced.grazing : 1e-4);
    /* |L + V| is 2 V.H, and no less than N.V where the light is before the surface. */
    g->half = shd_larger(sqrt(shd_larger((1 + between) / 2, 0)), g->view / 2);
    double beyond;
    g->place = f->steps * shd_misplaced_at(f->plan->scene, &f->misplaced, piece, light,
                                           g->lit.nearest, &beyond);
    beyond *= f->steps;
    /* Normals are turned by as much less as rays meet the surface more upright. */
    const double turned = f->misplaced.turned * smaller_of(1, f->misplaced.grazing / g->view);
    g->direction = SHD_WEIGHT_DIRECTION + g->place + beyond + 2 * turned;
}

/* A term's color times a light's, and what rounding leaves of it. The colors of a spectral scene
 * are sums of rounded products, whose errors go with their absolute values:
 * tests/unit/base_spectrum.c asks for as much. */
typedef struct product {
    double most[3], error[3];
} product;

static product product_of(const shd_plan *plan, const shd_plan_material *m,
                          const shd_plan_light *light, size_t term, const double color[3]) {
    static const double SUM = 1e-12;
    product p = {.error = {0}};
    double scratch[3], most[3];
    for (int c = 0; c < 3; c++) p.most[c] = fabs(color[c] * light->color[c]);
    if (!plan->bins) return p;
    const double *sum = shd_term_color(plan, m, light, term, scratch);
    shd_term_most(plan, m, light, term, most);
    for (int c = 0; c < 3; c++) {
        p.most[c] = term && m->model == SHD_MODEL_COOK_TORRANCE ? most[c] : fabs(sum[c]);
        p.error[c] = SUM * most[c];
    }
    return p;
}

static void add_product(finding *f, product p, double most, double error) {
    for (int c = 0; c < 3; c++) {
        if (p.most[c] == 0 && p.error[c] == 0) continue;
        f->most[c] += p.most[c] * most;
        f->error[c] += p.most[c] * error + p.error[c] * most;
    }
}

static void add_error(finding *f, product p, double error) {
    for (int c = 0; c < 3; c++)
        if (p.most[c] > 0) f->error[c] += p.most[c] * error;
}

static void add_weight(finding *f, product p, const shd_plan_light *light, const shd_glance *g,
                       shd_weight w) {
    /* Attenuation and cones multiply, and err by distances and directions. */
    const double distance = light->attenuated ? 2 * g->place : 0,
                 spot = light->spot ? shd_spot_error(SHD_EXACT, light, g->lit.axis_low,
                                                     g->lit.axis_high, g->place)
                                    : 0;
    const double factor = g->lit.factor_high,
                 error = factor * (w.error + w.most * (distance + SHD_WEIGHT_FUNCTION)) +
                         g->lit.fall_high * spot * w.most;
    /* Neither what is computed nor what should be is more than the most. */
    const double most = factor * w.most;
    add_product(f, p, most, g->drifts && most < INFINITY ? smaller_of(error, most) : error);
}

/* Quadrature is allowed four times what it aims at. That of Phong's lobes goes along boundaries and
 * knows its error. That of other models compares sums of more and of fewer points, of which it aims
 * at a part of the largest term: an estimate, and no bound (shd_linear_estimate). */
static void add_shape(finding *f, const shd_plan_light *light) {
    const shd_plan_material *m = f->material;
    const bool phong = m->model == SHD_MODEL_PHONG;
    const double near = shd_shape_distance(&f->place, light->shape);
    double largest = 0;
    for (size_t t = 0; t < 1 + m->lobe_count; t++) {
        const shd_peak peak = shd_peak_of(m, t);
        largest = shd_larger(largest, shd_shape_most(light->shape, &peak, near));
    }
    for (size_t t = 0; t < 1 + m->lobe_count; t++) {
        const double *color = t ? m->lobes[t - 1].specular : m->diffuse;
        const shd_peak peak = shd_peak_of(m, t);
        const double most = shd_shape_most(light->shape, &peak, near);
        const double summed =
            phong ? 4 * SHD_AREA_TOLERANCE * most : 4 * SHD_AREA_MODEL_TOLERANCE * largest;
        add_product(f, product_of(f->plan, m, light, t, color), most,
                    summed + f->plan->point_off * most);
    }
}

/* The same where points and directions are off. What comes from a point of the shape changes as the
 * light of a point does, and the part of the shape that is before the surface, or that shadows
 * leave, by a strip as wide as directions are off: of all directions, or across the shape. */
static void add_met_shape(finding *f, const shd_plan_light *light, const shd_glance *g) {
    const shd_plan_material *m = f->material;
    const double area = shd_light_area(light->shape), wide = 4 * sqrt(area / SHD_PI),
                 strip = smaller_of(2 * SHD_PI, 4 * wide / g->lit.nearest) * g->direction / area;
    add_shape(f, light);
    for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
        const double *color = t ? m->lobes[t - 1].specular : m->diffuse;
        const shd_peak peak = shd_peak_of(m, t);
        const shd_weight w = shd_weight_of(m, t, g, f->plan->scene->light_count);
        const double most = shd_shape_most(light->shape, &peak, g->lit.nearest);
        const double moved =
            most * (2 * g->place + 8 * g->direction) + w.most * strip +
            shd_shape_most(light->shape, &(shd_peak){w.error, 2 * w.error}, g->lit.nearest);
        add_error(f, product_of(f->plan, m, light, t, color), smaller_of(moved, most));
    }
}

/* Four standard errors of what was simulated. */
static void add_noise(finding *f, const shd_piece *piece, const shd_plan_light *light) {
    const shd_peak even = {1, 1};
    shd_lit lit = {.factor_high = 1, .facing_high = 1};
    const double least = light->directional ? 0 : shd_least_distance(&f->place, light->position);
    double light_of_one;
    if (light->shape) {
        light_of_one =
            shd_shape_most(light->shape, &even, shd_shape_distance(&f->place, light->shape));
    } else {
        if (!shd_piece_lit(f->plan->scene, piece, light, least, &lit)) return;
        light_of_one = lit.factor_high * lit.facing_high;
    }
    for (int c = 0; c < 3; c++) f->error[c] += 4 * *f->noise * light_of_one * fabs(light->color[c]);
}

/* A light that is a point, on all terms. */
static void add_terms(finding *f, const shd_plan_light *light, const shd_glance *g) {
    const shd_plan_material *m = f->material;
    const size_t lights = f->plan->scene->light_count;
    for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
        const double *color = t ? m->lobes[t - 1].specular : m->diffuse;
        add_weight(f, product_of(f->plan, m, light, t, color), light, g,
                   shd_weight_of(m, t, g, lights));
    }
}

static void add_light(finding *f, const shd_piece *piece, const shd_plan_light *light) {
    const shd_plan_material *m = f->material;
    shd_glance g;
    if (m->model == SHD_MODEL_WESTIN) {
        add_noise(f, piece, light);
        return;
    }
    if (light->shape) {
        add_shape(f, light);
        return;
    }
    const double least = light->directional ? 0 : shd_least_distance(&f->place, light->position);
    if (!shd_piece_lit(f->plan->scene, piece, light, least, &g.lit)) return;
    see_piece(f, piece, light, &g);
    add_terms(f, light, &g);
}

static void add_met_light(finding *f, const met_place *at, const shd_plan_light *light) {
    shd_glance g;
    const double nearest = light->directional ? 0
                           : light->shape     ? shd_shape_distance(&f->place, light->shape)
                                              : shd_least_distance(&f->place, light->position);
    see_anywhere(f, at, light, nearest, &g);
    if (light->shape)
        add_met_shape(f, light, &g);
    else
        add_terms(f, light, &g);
}

/* ---- The picture. ---- */

bool shd_errs_otherwise(const shd_plan *plan) {
    if (!plan->extended) return false;
    if (plan->scene->trace.depth || plan->bins) return true;
    for (size_t j = 0; j < plan->light_count; j++)
        if (plan->lights[j].shape) return true;
    for (size_t m = 0; m < plan->scene->material_count; m++)
        if (plan->materials[m].model != SHD_MODEL_PHONG) return true;
    return false;
}

/* What is not bounded, of what the scene has. */
typedef enum unknown { KNOWN, VEILED_ALPHA, SIMULATED, QUADRATURE } unknown;

static bool is_all(const double rgb[3], double value) {
    return rgb[0] == value && rgb[1] == value && rgb[2] == value;
}

static bool lets_through(const shd_plan *plan, size_t object) {
    const shd_material *m = plan->materials[plan->objects[object].material].from;
    return plan->scene->trace.depth && !is_all(m->opacity, 1);
}

static unknown find_unknown(const shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    unknown found = KNOWN;
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        const shd_plan_material *m = &plan->materials[object->material];
        if (scene->transparent && lets_through(plan, i)) return VEILED_ALPHA;
        if (m->model == SHD_MODEL_WESTIN && object->light_count) found = SIMULATED;
        if (m->model == SHD_MODEL_PHONG || found != KNOWN) continue;
        for (size_t j = 0; j < object->light_count; j++)
            if (plan->lights[object->lights[j]].shape) found = QUADRATURE;
    }
    return found;
}

/* How far rays may be beside where they should be, over what is counted for the object: a ray that
 * goes straight on begins where f64 put the last hit, which is off by the lengths on the way to it.
 */
static double find_steps(const shd_plan *plan, const shd_misplaced *own) {
    const shd_scene *scene = plan->scene;
    double span = 0;
    for (size_t i = 0; i < scene->object_count && scene->trace.depth; i++) {
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        if (!lets_through(plan, i)) continue;
        const shd_place place = shd_place_of(&scene->objects[i], &plan->objects[i]);
        const shd_misplaced there = shd_misplaced_of(scene, &place);
        span = shd_larger(span, there.span);
    }
    return span > 0 ? 1 + scene->trace.depth * (1 + span / own->span) : 1;
}

/* The largest error at any piece of the object. */
static double object_error(const shd_plan *plan, size_t index, const double *noise,
                           double rounding) {
    enum { FINENESS = 2 };
    const shd_scene *scene = plan->scene;
    const shd_plan_object *bounds = &plan->objects[index];
    finding f = {.plan = plan,
                 .material = &plan->materials[bounds->material],
                 .noise = noise ? &noise[bounds->material] : NULL,
                 .place = shd_place_of(&scene->objects[index], bounds)};
    f.misplaced = shd_misplaced_of(scene, &f.place);
    f.steps = find_steps(plan, &f.misplaced);
    f.misplaced.turned = smaller_of(f.steps * f.misplaced.turned, 1);
    f.misplaced.grazing *= sqrt(f.steps);
    shd_piece pieces[SHD_MOST_PIECES];
    const size_t count = shd_plan_pieces(scene, index, bounds, FINENESS, plan->cancelled, pieces);
    double worst = 0;
    for (size_t p = 0; p < count && !shd_is_cancelled(plan->cancelled); p++) {
        for (int c = 0; c < 3; c++)
            f.most[c] = fabs(f.material->emissive[c]) + fabs(f.material->ambient[c]),
            f.error[c] = 0;
        for (size_t j = 0; j < bounds->light_count; j++)
            add_light(&f, &pieces[p], &plan->lights[bounds->lights[j]]);
        for (int c = 0; c < 3; c++) worst = shd_larger(worst, f.error[c] + rounding * f.most[c]);
    }
    return worst;
}

/* ---- Mirrors and glass. ---- */

/* The most that rays bring, and how far off that is. */
typedef struct brought {
    double most, error;
} brought;

/* What an object shows by itself to rays that have drifted, in all channels alike. Facets are lit
 * as the camera sees them, and between their corners light changes as if over a tenth of the
 * object. */
static brought meet_object(const shd_plan *plan, size_t index, const shd_extent *extent,
                           const shd_drift *first, const shd_drift *drift, double rounding) {
    const shd_plan_object *bounds = &plan->objects[index];
    const shd_object *object = &plan->scene->objects[index];
    const bool facets = object->interpolation != SHD_PHONG;
    finding f = {.plan = plan,
                 .material = &plan->materials[bounds->material],
                 .place = shd_place_of(object, bounds)};
    const met_place at = {facets ? first : drift, extent,
                          shd_misplaced_of(plan->scene, &f.place).bend};
    const shd_light *emitter = object->emitter;
    brought out = {0, 0};
    for (int c = 0; c < 3; c++) {
        f.most[c] = fabs(f.material->emissive[c]) + fabs(f.material->ambient[c]);
        if (emitter)
            f.most[c] =
                shd_larger(f.most[c], fabs(emitter->color[c]) * (SHD_PI / shd_light_area(emitter)));
    }
    for (size_t j = 0; j < bounds->light_count && !shd_is_cancelled(plan->cancelled); j++)
        add_met_light(&f, &at, &plan->lights[bounds->lights[j]]);
    double between = 0;
    if (object->interpolation == SHD_GOURAUD)
        between = smaller_of(10 * drift->beside / (drift->least * bounds->radius), 1);
    for (int c = 0; c < 3; c++) {
        out.most = shd_larger(out.most, f.most[c]);
        out.error = shd_larger(out.error, f.error[c] + (rounding + between) * f.most[c]);
    }
    return out;
}

/* What of further rays a surface shows, at most. */
static double sends_on(const shd_plan *plan, size_t object) {
    const shd_material *m = plan->materials[plan->objects[object].material].from;
    double most = 0;
    for (int c = 0; c < 3; c++) most = shd_larger(most, m->reflection[c] + m->transmission[c]);
    return plan->scene->trace.depth ? most : 0;
}

/* I = o (local + r I_m + t I_t) + (1 - o) I_b is off by no more than local and (r + t) times what
 * further rays are off by, or by as much as these. Where drifts are not known, rays may have met
 * anything else. */
static void add_beyond(const shd_plan *plan, size_t object, brought local, const brought *beyond,
                       brought *out) {
    const double on = sends_on(plan, object);
    out->most = shd_larger(out->most, local.most + on * beyond->most);
    out->error = shd_larger(out->error, local.error + on * beyond->error);
    if (!lets_through(plan, object)) return;
    out->most = shd_larger(out->most, beyond->most);
    out->error = shd_larger(out->error, beyond->error);
}

static double background_of(const shd_scene *scene) {
    double most = 0;
    for (int c = 0; c < 3 && !scene->transparent; c++)
        most = shd_larger(most, fabs(scene->background[c]));
    return most;
}

/* Of all rays after the first step. Scenes without mirrors and glass have only straight ones, which
 * the errors of what the eye sees count (find_steps). */
static brought find_beyond(const shd_plan *plan, double rounding) {
    const shd_scene *scene = plan->scene;
    const double behind = background_of(scene);
    const shd_extent extent = shd_extent_of(plan);
    brought beyond = {0, 0};
    bool bends = false;
    for (size_t i = 0; i < scene->object_count && !bends; i++) bends = sends_on(plan, i) > 0;
    if (!bends) return beyond;
    shd_drift drifts[SHD_DRIFTS];
    shd_find_drifts(plan, &extent, drifts);
    for (int k = scene->trace.depth; k > 0; k--) {
        brought here = {behind, rounding * behind};
        for (size_t i = 0; i < scene->object_count; i++) {
            if (shd_is_cancelled(plan->cancelled)) break;
            const brought local = meet_object(plan, i, &extent, &drifts[0], &drifts[k], rounding);
            add_beyond(plan, i, local, &beyond, &here);
        }
        if (!drifts[k].known) here.error = 2 * here.most;
        beyond = here;
    }
    return beyond;
}

/* ---- The picture. ---- */

/* Of all that is lit by weights whose error is known. Of surfaces behind each other, what is seen
 * is a mean, so that no error is more than the largest of one. */
static double picture_error(const shd_plan *plan, const double *noise) {
    const shd_scene *scene = plan->scene;
    /* What rays have met is rounded once more, by what they have gone through. */
    const double rounding = shd_color_error(plan, SHD_EXACT) + (scene->trace.depth ? 0x1p-24 : 0);
    const brought beyond = find_beyond(plan, rounding);
    brought all = {0, rounding * background_of(scene)};
    for (size_t i = 0; i < scene->object_count; i++) {
        const brought local = {0, object_error(plan, i, noise, rounding)};
        add_beyond(plan, i, local, &beyond, &all);
    }
    return all.error < 1e37 ? all.error : INFINITY;
}

const char *shd_no_linear_bound(const shd_plan *plan) {
    switch (find_unknown(plan)) {
    case VEILED_ALPHA:
        return "colors over a transparent background are divided by what opacity hides of it";
    case SIMULATED:
        return "simulated microgeometry has noise, and no bound of its rounding";
    case QUADRATURE:
        return "quadrature of this model under a light with a shape tells its error, and no "
               "bound";
    default:
        return "a light may touch a surface, or a value exceed what floats hold";
    }
}

double shd_extended_error(const shd_plan *plan) {
    return find_unknown(plan) == KNOWN ? picture_error(plan, NULL) : INFINITY;
}

double shd_linear_estimate(const shd_plan *plan, const double *noise) {
    const unknown u = find_unknown(plan);
    if (!(u == QUADRATURE || (u == SIMULATED && noise))) return INFINITY;
    return picture_error(plan, noise);
}
