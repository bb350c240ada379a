#include "bound/light/sums.h"

#include "bound/light/brightest.h"
#include "bound/light/error.h"
#include "plan/around.h"

void shd_begin_errors(shd_lit_errors *f, const shd_object *object) {
    const shd_plan_material *m = f->material;
    const shd_light *emitter = object->emitter;
    const double shines = emitter ? SHD_PI / shd_light_area(emitter) : 0;
    for (int c = 0; c < 3; c++) {
        f->error[c] = 0;
        f->most[c] = fabs(m->emissive[c]) + fabs(m->ambient[c]);
        /* A mirror may see the side that the eye does not. */
        if (emitter) f->most[c] = shd_larger(f->most[c], shines * fabs(emitter->color[c]));
        if (f->plan->tinted) f->most[c] = shd_tinted_most(f->plan, m, emitter);
    }
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
        const bool apart = plan->tinted || light->environment ||
                           m->textures /* whose colors are any up to these */ ||
                           (term && m->model == SHD_MODEL_COOK_TORRANCE);
        p.most[c] = apart ? most[c] : fabs(sum[c]);
        p.error[c] = SUM * most[c];
    }
    return p;
}

static void add_product(shd_lit_errors *f, product p, double most, double error) {
    for (int c = 0; c < 3; c++) {
        if (p.most[c] == 0 && p.error[c] == 0) continue;
        f->most[c] += p.most[c] * most;
        f->error[c] += p.most[c] * error + p.error[c] * most;
    }
}

static void add_error(shd_lit_errors *f, product p, double error) {
    for (int c = 0; c < 3; c++)
        if (p.most[c] > 0) f->error[c] += p.most[c] * error;
}

/* What f32 adds to a weight's error, and to that of what multiplies it. */
static void add_narrow(shd_lit_errors *f, product p, const shd_plan_light *light,
                       const shd_glance *g, shd_weight w) {
    const double distance = g->relative + (light->attenuated ? 2 * g->place : 0),
                 spot = light->spot ? shd_spot_error(SHD_ROUNDS_FUSED, light, g->lit.axis_low,
                                                     g->lit.axis_high, g->place)
                                    : 0;
    add_error(f, p,
              g->lit.factor_high * (w.error + w.most * distance) +
                  g->lit.fall_high * spot * w.most);
}

static void add_weight(shd_lit_errors *f, product p, const shd_plan_light *light,
                       const shd_glance *g, shd_weight w) {
    /* Attenuation and cones multiply, and err by distances and directions. */
    const double distance = light->attenuated ? 2 * g->place : 0,
                 spot = light->spot ? shd_spot_error(SHD_ROUNDS_64, light, g->lit.axis_low,
                                                     g->lit.axis_high, g->place)
                                    : 0;
    const double factor = g->lit.factor_high,
                 error = factor * (w.error + w.most * (distance + SHD_WEIGHT_FUNCTION)) +
                         g->lit.fall_high * spot * w.most;
    /* Neither what is computed nor what should be is more than the most. */
    const double most = factor * w.most;
    add_product(f, p, most, g->drifts && most < INFINITY ? shd_smaller(error, most) : error);
}

/* Phong's lobes and Lambert's light are integrals along the boundary of a light with a shape. */
static bool is_along_boundary(shd_model model, size_t term) {
    if (term == 0) return model != SHD_MODEL_OREN_NAYAR && model != SHD_MODEL_WESTIN;
    return model == SHD_MODEL_PHONG;
}

/* The most that a light with a shape makes of a term. */
static double term_most(const shd_lit_errors *f, const shd_plan_light *light, size_t term,
                        const shd_stance *at) {
    const shd_plan_material *m = f->material;
    if (!is_along_boundary(m->model, term)) return shd_shape_most_at(light->shape, m, term, at);
    const shd_peak peak = shd_peak_of(m, term);
    return shd_shape_most(light->shape, &peak, shd_shape_distance(&f->place, light->shape));
}

/* What quadrature of a term may be off by, of which a light adds `most`; `largest`: of all terms.
 * That of Phong's lobes and of Lambert's light goes along boundaries and knows its error, which is
 * allowed four times. Other weights are summed by cells that are halved until sums of more and of
 * fewer points agree, to a part of the largest term: an estimate, and no bound, as a peak may hide
 * between points. But no sum is taken for more than the light can add (shade/extended.c), so that
 * it is off by no more than that. */
static double quadrature_error(const shd_lit_errors *f, size_t term, double most, double largest) {
    if (is_along_boundary(f->material->model, term)) return 4 * SHD_AREA_TOLERANCE * most;
    return f->estimated ? 4 * SHD_AREA_MODEL_TOLERANCE * largest : most;
}

void shd_add_shape(shd_lit_errors *f, const shd_plan_light *light, const shd_stance *at) {
    const shd_plan_material *m = f->material;
    double largest = 0;
    for (size_t t = 0; t < 1 + m->lobe_count; t++)
        largest = shd_larger(largest, term_most(f, light, t, at));
    for (size_t t = 0; t < 1 + m->lobe_count; t++) {
        const double *color = t ? m->lobes[t - 1].specular : m->diffuse;
        const double most = term_most(f, light, t, at);
        add_product(f, product_of(f->plan, m, light, t, color), most,
                    quadrature_error(f, t, most, largest) + f->plan->point_off * most);
    }
}

/* What walking for a term may be off, of which the map adds `most` at most. */
static double walked_error(const shd_lit_errors *f, double most) {
    const bool quick = f->plan->glows != NULL;
    if (f->only_sums) return quick ? SHD_QUICK_FLOOR * most : 0;
    return (quick ? SHD_QUICK_FLOOR + SHD_QUICK_SHARE : SHD_AROUND_TOLERANCE) * most;
}

/* A weight of light from everywhere is off by no more than that of light from any one direction,
 * times all that the map shines on a half sphere. Facets' has no limit where the view grazes, but
 * their whole has. */
static void add_walked(shd_lit_errors *f, const shd_plan_light *light, const shd_glance *g,
                       size_t term, product p) {
    const shd_light *from = light->environment;
    const bool facets = f->material->model == SHD_MODEL_COOK_TORRANCE;
    shd_glance any = *g;
    any.lit = (shd_lit){
        .nearest = INFINITY, .facing_high = 1, .shine_high = 1, .factor_high = 1, .fall_high = 1};
    any.half = g->view / 2; /* |L + V| / 2 is no less where the light is before the surface */
    const shd_weight w = shd_weight_of(f->material, term, &any, f->plan->scene->light_count);
    const double most = shd_around_most_of(from, f->material, term, w.most),
                 turned = facets ? shd_around_gain(from) * from->map->most *
                                       shd_facets_turned(f->material, term - 1, &any)
                                 : w.error * shd_around_most(from, 0);
    /* Neither is below 0, nor above the most by more than the tolerance. */
    const double summed = walked_error(f, most);
    add_product(f, p, most, f->only_sums ? summed : summed + shd_smaller(turned, most));
}

/* The same of a term that is read from a table or integrated; of a lobe that differs from point to
 * point, by any way that it may be summed. A wider lobe makes no more of any map than its own
 * exponent does, of whose peak it has less, and as much together. */
static double summed_error(const shd_lit_errors *f, const shd_plan_light *light, size_t term,
                           double most) {
    const shd_plan_material *m = f->material;
    const shd_glow *glow = shd_find_glow(f->plan, m, light, term);
    const double own =
        glow ? shd_around_gain(light->environment) * glow->error : SHD_ENVIRONMENT_TOLERANCE * most;
    if (!f->plan->glows || !shd_may_be_walked(m, term)) return own;
    return shd_larger(own + (glow ? SHD_GLOW_WIDENED * most : 0), walked_error(f, most));
}

/* By how much a lobe's light changes if it turns by `off`. Of exponents from p to 2 p, the slope n
 * times what (L.W)^(n - 1) has is no more than twice that at p. */
static double around_turned(const shd_light *from, const shd_plan_material *m, size_t term,
                            double off) {
    const double sharpest = term ? m->lobes[term - 1].shininess : 1,
                 dullest = term ? shd_dullest(m, term - 1) : 1;
    double most = shd_around_turned(from, dullest, off);
    if (dullest == sharpest) return most;
    for (double p = 2 * dullest; p < sharpest; p *= 2)
        most = shd_larger(most, shd_around_turned(from, p, off));
    return 2 * most;
}

/* Neither what is computed nor what should be is below 0, or above the most. */
void shd_add_environment(shd_lit_errors *f, const shd_plan_light *light, const shd_glance *g) {
    const shd_plan_material *m = f->material;
    const shd_light *from = light->environment;
    for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
        const double *color = t ? m->lobes[t - 1].specular : m->diffuse;
        const product p = product_of(f->plan, m, light, t, color);
        if (!shd_is_symmetric(m->model, t)) {
            add_walked(f, light, g, t, p);
            continue;
        }
        const double most = shd_around_most_of(from, m, t, INFINITY),
                     turned = around_turned(from, m, t, shd_smaller(g->direction, 2)) +
                              (t ? shd_sharpness_error(m, t - 1, g) * shd_around_most(from, 0) : 0),
                     summed = summed_error(f, light, t, most),
                     error = f->only_sums ? summed : summed + turned;
        add_product(f, p, most, shd_smaller(error, most));
    }
}

/* The share is sum w s / sum w over the points of a pattern (trace/shadows.h), s of each being what
 * arrives of it, and w = (N.L)+ l / d^2, with l the light's own cosine; of a sphere, (N.L)+. With
 * other weights w' the share changes by sum (w' - w) (s - share) / sum w', which is sum |w' - w| /
 * sum w' at most. Each |w' - w| is at most 1 / d^2 times twice the `off` of N.L, l and d. So
 * the error is 2 off over the mean of (N.L)+ l, weighed by 1 / d^2. Where that is below
 * SHD_LEAST_SHARED, the light is on its horizon, or seen from its edge, as surfaces count that are
 * seen with an N.V below 1e-4: samples there are on an edge, and are not counted. Nor are those of
 * which what stands before a point of the pattern ends there, to within rounding. */
void shd_add_share(shd_lit_errors *f, const shd_plan_light *light, const shd_stance *at,
                   double off) {
    const shd_plan_material *m = f->material;
    const double share = shd_smaller(2 * off / SHD_LEAST_SHARED, 1);
    for (size_t t = 0; t < 1 + m->lobe_count; t++) {
        const double *color = t ? m->lobes[t - 1].specular : m->diffuse;
        add_error(f, product_of(f->plan, m, light, t, color), share * term_most(f, light, t, at));
    }
}

/* Four standard errors of what was simulated. */
void shd_add_noise(shd_lit_errors *f, const shd_piece *piece, const shd_plan_light *light) {
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
    const bool tinted = f->plan->tinted;
    const double most = tinted ? shd_most_in_bins(f->plan->bins, light->bins) : 0;
    for (int c = 0; c < 3; c++)
        f->error[c] += 4 * *f->noise * light_of_one * (tinted ? most : fabs(light->color[c]));
}

void shd_add_narrow_terms(shd_lit_errors *f, const shd_plan_light *light, const shd_glance *g) {
    const shd_plan_material *m = f->material;
    for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
        const double *color = t ? m->lobes[t - 1].specular : m->diffuse;
        add_narrow(f, product_of(f->plan, m, light, t, color), light, g,
                   shd_weight_of(m, t, g, f->plan->scene->light_count));
    }
}

/* A light that is a point, on all terms. */
void shd_add_terms(shd_lit_errors *f, const shd_plan_light *light, const shd_glance *g) {
    const shd_plan_material *m = f->material;
    const size_t lights = f->plan->scene->light_count;
    for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
        const double *color = t ? m->lobes[t - 1].specular : m->diffuse;
        add_weight(f, product_of(f->plan, m, light, t, color), light, g,
                   shd_weight_of(m, t, g, lights));
    }
}

/* The same where points and directions are off. What comes from a point of the shape changes as the
 * light of a point does, and the part of the shape that is before the surface by a strip as wide as
 * directions are off: of all directions, or across the shape. */
void shd_add_drifted_shape(shd_lit_errors *f, const shd_plan_light *light, const shd_glance *g) {
    const shd_plan_material *m = f->material;
    const double area = shd_light_area(light->shape), wide = 4 * sqrt(area / SHD_PI),
                 strip = shd_smaller(2 * SHD_PI, 4 * wide / g->lit.nearest) * g->direction / area;
    /* Corners of facets, and what rays meet of which nothing is known, are seen from anywhere. */
    const bool seen = g->direction < 2 && f->place.object->interpolation == SHD_PHONG;
    const shd_stance at = {g->lit.nearest, seen ? g->view : 0, seen ? g->half : 0};
    shd_add_shape(f, light, &at);
    if (f->plan->scene->trace.shadows) shd_add_share(f, light, &at, 2 * g->direction);
    for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
        const double *color = t ? m->lobes[t - 1].specular : m->diffuse;
        const shd_weight w = shd_weight_of(m, t, g, f->plan->scene->light_count);
        const double most = term_most(f, light, t, &at);
        const double moved =
            most * (2 * g->place + 8 * g->direction) + w.most * strip +
            shd_shape_most(light->shape, &(shd_peak){w.error, 2 * w.error}, g->lit.nearest);
        add_error(f, product_of(f->plan, m, light, t, color), shd_smaller(moved, most));
    }
}
