#include "bound/light/extended.h"

#include "bound/light/brightest.h"
#include "bound/light/error.h"
#include "bound/light/misplaced.h"
#include "bound/light/pieces.h"

/* What rounding in f64 does to unit vectors that some dozen operations have made, and to the
 * functions of a model. */
static const double DIRECTION = 16 * 0x1p-53, FUNCTION = 1e-13;

/* A light at a piece, and how the piece is seen. */
typedef struct glance {
    shd_lit lit;
    double direction; /* the error of L, V and N together, as a chord */
    double place;     /* the part of it by which points are beside */
    double view;      /* no N.V that counts is less */
    double half;      /* nor is any V.H */
} glance;

/* Of one lobe, or of the diffuse term, at a light of 1 before attenuation. */
typedef struct weight {
    double most, error;
} weight;

static double smaller_of(double a, double b) {
    return a < b ? a : b;
}

/* ---- Models. ---- */

static weight weigh_diffuse(const shd_plan_material *m, const glance *g) {
    const double facing = g->lit.facing_high;
    const weight lambert = {facing, g->direction + FUNCTION * facing};
    if (m->model != SHD_MODEL_OREN_NAYAR) return lambert;
    /* N.L (a + b s), where s is max(0, L.V - N.L N.V) / max(N.L, N.V), and N.L s is at most 1. */
    const double square = m->from->sigma * m->from->sigma, b = 0.45 * square / (square + 0.09);
    return (weight){facing + b * smaller_of(1, facing / g->view),
                    lambert.error + b * (4 * g->direction / g->view + FUNCTION)};
}

static weight weigh_phong(double shininess, const glance *g, size_t lights) {
    const shd_lobe_error e = shd_lobe_error_of(SHD_EXACT, shininess, lights);
    const double most = shd_shine_most(g->lit.shine_high, shininess);
    return (weight){most, shd_lobe_sum(shd_lobe_turned(&e, g->lit.shine_high, most, g->direction),
                                       shd_lobe_functions(&e, most)) +
                              shd_lobe_faint(&e, most)};
}

/* H = (L + V) / |L + V| errs by as much as L and V, divided by 2 V.H, twice. */
static double half_error(const glance *g) {
    return smaller_of(g->direction / g->half, 1);
}

static weight weigh_blinn(double shininess, const glance *g, size_t lights) {
    const shd_lobe_error e = shd_lobe_error_of(SHD_EXACT, shininess, lights);
    return (weight){1, shd_lobe_sum(shd_lobe_turned(&e, 1, 1, g->direction + half_error(g)),
                                    shd_lobe_functions(&e, 1)) +
                           shd_lobe_faint(&e, 1)};
}

/* The factor pi N.L / E is at most (n + 2) / 2, because E, without the part of the lobe below the
 * horizon, which is negative there, is N.L 2 pi / (n + 2). Its slope is at most 3 pi / E(0), where
 * E(0) >= 2 sqrt(pi / (2 (n + 1))) / (n + 2). E is computed to 1e-10. */
static weight weigh_normalized(double shininess, const glance *g, size_t lights) {
    const weight lobe = weigh_phong(shininess, g, lights);
    const double factor = (shininess + 2) / 2,
                 level = 2 * sqrt(SHD_PI / (2 * (shininess + 1))) / (shininess + 2);
    return (weight){factor * lobe.most, factor * (lobe.error + 1e-10 * lobe.most) +
                                            3 * SHD_PI / level * g->direction * lobe.most};
}

static double largest_index(const shd_fresnel *f, double most) {
    for (int c = 0; c < 3; c++)
        if (isfinite(f->n[c])) most = shd_larger(most, f->n[c] * f->n[c] + f->k[c] * f->k[c]);
    return most;
}

/* n^2 + k^2 is at most that, in any channel or bin. */
static double index_of(const shd_plan_material *m) {
    const size_t bins = m->indices ? m->bin_count / (1 + m->lobe_count) : 0;
    double most = largest_index(&m->from->fresnel, 1);
    for (size_t b = 0; b < bins; b += 3) most = largest_index(&m->indices[b / 3], most);
    return most;
}

/* By how much g = G / N.V of Cook and Torrance errs, but for what N.H does: g is the least of 1 /
 * v, 2 u / h and 2 u c / (h v), with c = N.L, v = N.V, u = N.H and h = V.H, of which each errs by
 * what directions do. As u = (c + v) / (2 h), slopes have no 1 / v. Where the first is the least, v
 * is h / 2 or more, and its slope 4 / h^2. That of the second by h is 2 / h^2. The third is the
 * least only where c < v, so that u <= v / h, and each of its three slopes is at most 2 / h^2.
 * Twice their sum holds what slopes are beside the point, unless directions err by as much as v or
 * h. */
static double open_error(const glance *g) {
    const double near = 1 / (g->half * g->half);
    if (8 * g->direction < smaller_of(g->view, g->half)) return 12 * near * g->direction;
    return 16 / g->half * (1 / g->half + 1 / g->view) * g->direction;
}

/* F D g / 4 with F at most 1, and g at most 1 / N.V and 2 / V.H. With x = tan^2 of the angle of H,
 * D = (1 + x)^2 e^(-x / m^2) / m^2 is largest at x = max(0, 2 m^2 - 1), and its slope by that angle
 * is at most 2 (1 + x)^3 sqrt(x) / m^4 + 4 (1 + x)^2 sqrt(x) / m^2 with x <= 3.5 m^2, which is four
 * times D sqrt(x) at least. N.H errs by the sine of that angle times what H does, and 2 / V.H times
 * that is what it does to g. */
static weight weigh_facets(double index, double slope, const glance *g) {
    const double m = slope * slope, x = 1 + 3.5 * m, root = sqrt(3.5 * m);
    const double most = m > 0.5 ? 4 * m * exp(1 / m - 2) : 1 / m;
    const double steep = 2 * x * x * x * root / (m * m) + 4 * x * x * root / m;
    const double over = smaller_of(1 / g->view, 2 / g->half), tilt = 0.5 / g->half;
    const double turned = half_error(g), fresnel = smaller_of(8 * (1 + index) * turned, 1);
    return (weight){most * over / 4, (steep * turned * (over + tilt) + most * open_error(g) +
                                      most * over * (fresnel + FUNCTION / m)) /
                                         4};
}

static weight weigh_lobe(const shd_plan_material *m, size_t lobe, const glance *g, size_t lights) {
    const double shininess = m->lobes[lobe].shininess;
    switch (m->model) {
    case SHD_MODEL_BLINN_PHONG:
        return weigh_blinn(shininess, g, lights);
    case SHD_MODEL_PHONG_NORMALIZED:
        return weigh_normalized(shininess, g, lights);
    case SHD_MODEL_COOK_TORRANCE:
        return weigh_facets(index_of(m), shininess, g);
    case SHD_MODEL_PHONG:
        return weigh_phong(shininess, g, lights);
    default:
        return (weight){INFINITY, INFINITY};
    }
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

static void see_piece(const finding *f, const shd_piece *piece, const shd_plan_light *light,
                      glance *g) {
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
    g->direction = DIRECTION + g->place + beyond + 2 * turned;
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

static void add_weight(finding *f, product p, const shd_plan_light *light, const glance *g,
                       weight w) {
    /* Attenuation and cones multiply, and err by distances and directions. */
    const double distance = light->attenuated ? 2 * g->place : 0,
                 spot = light->spot ? shd_spot_error(SHD_EXACT, light, g->lit.axis_low,
                                                     g->lit.axis_high, g->place)
                                    : 0;
    const double factor = g->lit.factor_high,
                 error = factor * (w.error + w.most * (distance + FUNCTION)) +
                         g->lit.fall_high * spot * w.most;
    add_product(f, p, factor * w.most, error);
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

static void add_light(finding *f, const shd_piece *piece, const shd_plan_light *light) {
    const shd_plan_material *m = f->material;
    const size_t lights = f->plan->scene->light_count;
    glance g;
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
    if (m->has_diffuse)
        add_weight(f, product_of(f->plan, m, light, 0, m->diffuse), light, &g,
                   weigh_diffuse(m, &g));
    for (size_t k = 0; k < m->lobe_count; k++)
        add_weight(f, product_of(f->plan, m, light, 1 + k, m->lobes[k].specular), light, &g,
                   weigh_lobe(m, k, &g, lights));
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
typedef enum unknown { KNOWN, BENT_RAYS, VEILED_ALPHA, SIMULATED, QUADRATURE } unknown;

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
        if (scene->trace.depth &&
            !(is_all(m->from->reflection, 0) && is_all(m->from->transmission, 0)))
            return BENT_RAYS;
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

/* Of all that is lit by weights whose error is known. Of surfaces behind each other, what is seen
 * is a mean, so that no error is more than the largest of one. */
static double picture_error(const shd_plan *plan, const double *noise) {
    const shd_scene *scene = plan->scene;
    /* What rays have met is rounded once more, by what they have gone through. */
    const double rounding = shd_color_error(plan, SHD_EXACT) + (scene->trace.depth ? 0x1p-24 : 0);
    double worst = 0;
    for (int c = 0; c < 3 && !scene->transparent; c++)
        worst = shd_larger(worst, rounding * fabs(scene->background[c]));
    for (size_t i = 0; i < scene->object_count; i++)
        worst = shd_larger(worst, object_error(plan, i, noise, rounding));
    return worst < 1e37 ? worst : INFINITY;
}

const char *shd_no_linear_bound(const shd_plan *plan) {
    switch (find_unknown(plan)) {
    case BENT_RAYS:
        return "mirrors and glass carry rounding on by as much as their surfaces bend";
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
