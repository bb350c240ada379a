#include "shade/extended.h"

#include <string.h>

#include "plan/peaks.h"
#include "shade/area.h"
#include "shade/exact.h"
#include "shade/surrounded.h"
#include "shade/ways.h"
#include "shade/westin_table.h"

/* What its microgeometry does to light. False: it is not simulated. */
static bool weigh_westin(const shd_plan *plan, const shd_surface *at, shd_vec3 toward,
                         double row[SHD_BRDF_ROWS]) {
    const size_t material = (size_t)(at->material - plan->materials);
    const shd_westin *table = plan->westin ? plan->westin[material] : NULL;
    if (!table) return false;
    shd_westin_weigh(table, &plan->scene->objects[at->object], at, toward, row);
    return true;
}

/* The weights of light from one direction. False: it adds nothing. */
static bool weigh_toward(const shd_plan *plan, const shd_surface *at, shd_vec3 toward,
                         double row[SHD_BRDF_ROWS]) {
    const bool westin = at->material->model == SHD_MODEL_WESTIN;
    return westin ? weigh_westin(plan, at, toward, row) : shd_brdf_weigh(at, toward, row);
}

typedef struct lit_point {
    const shd_plan *plan;
    const shd_surface *at;
} lit_point;

static void weigh_direction(const void *context, shd_vec3 toward, double *row) {
    const lit_point *p = context;
    if (!weigh_toward(p->plan, p->at, toward, row))
        memset(row, 0, (3 + 3 * p->at->material->lobe_count) * sizeof *row);
}

/* How sharp a model's lobe is, as the exponent of a Phong lobe. Beckmann's is exp(-tan^2 / m^2) of
 * H. */
static double sharpness_of(const shd_plan_material *m) {
    double most = m->model == SHD_MODEL_WESTIN ? 400 : 2;
    for (size_t k = 0; k < m->lobe_count; k++) {
        const double n = m->lobes[k].shininess;
        most = shd_larger(m->model == SHD_MODEL_COOK_TORRANCE ? 2 / (n * n) : n, most);
    }
    return most;
}

/* How a point sees a light with a shape. Directions to it are in the cone of the sphere around it,
 * whose cosine with V is least where it leans away. */
static shd_stance find_stance(const shd_light *shape, const shd_surface *at) {
    const shd_vec3 path = shd_sub(shape->position, at->position);
    const double distance = shd_length(path), reach = shd_light_reach(shape),
                 before = shape->type == SHD_LIGHT_SPHERE ? 0 : -shd_dot(path, shape->direction);
    shd_stance out = {.nearest = shd_larger(distance - reach, before),
                      .view = shd_dot(at->normal, at->view)};
    if (!(distance > reach)) return out;
    const double sine = reach / distance, wide = sqrt((1 - sine) * (1 + sine)),
                 cosine = shd_smaller(shd_larger(shd_dot(at->view, path) / distance, -1), 1);
    if (cosine > -wide) {
        const double least = cosine * wide - sqrt((1 - cosine) * (1 + cosine)) * sine;
        out.half = sqrt(shd_larger((1 + least) / 2, 0));
    }
    return out;
}

/* What sums the model in vectors, of `out`; NULL: nothing does. */
static shd_area_sum_function *find_sum(const shd_lighting *kernels, const shd_surface *at,
                                       shd_westin_seen *seen, shd_way_point *out) {
    static shd_area_sum_function *const sums[SHD_ISA_COUNT] = SHD_VARIANTS(shd_sum_ways);
    if (!kernels) return NULL;
    const shd_plan *plan = kernels->plan;
    const size_t material = (size_t)(at->material - plan->materials);
    *out = (shd_way_point){.at = at, .energies = kernels->energies[material]};
    if (at->material->model != SHD_MODEL_WESTIN) return sums[plan->isa];
    const shd_westin *table = kernels->westin ? kernels->westin[material].table : NULL;
    if (!table) return NULL;
    const shd_tangents tangents = shd_westin_tangents(table, &plan->scene->objects[at->object]);
    out->westin = &kernels->westin[material];
    out->seen = seen;
    seen->made = false;
    out->tangent = shd_tangent_at(&tangents, at->position, at->normal);
    return sums[plan->isa];
}

/* By quadrature over directions, whose sums may be anything if a peak hides between its points:
 * they are held to what the light can add at most, which bounds count on. */
static bool sum_model(const shd_plan *plan, const shd_lighting *kernels, const shd_light *shape,
                      const shd_surface *at, double row[SHD_BRDF_ROWS]) {
    const shd_plan_material *m = at->material;
    /* Lobes of R.V end at W's horizon, and Oren-Nayar's light changes where L and V stand at
     * right angles around the normal. */
    const shd_vec3 crease = m->model == SHD_MODEL_OREN_NAYAR
                                ? shd_madd(at->view, at->normal, -shd_dot(at->normal, at->view))
                                : at->mirror;
    const lit_point point = {plan, at};
    shd_way_point ways;
    shd_westin_seen seen;
    shd_area_model model = {.weigh = weigh_direction,
                            .context = &point,
                            .count = 3 + 3 * m->lobe_count,
                            .sharpness = sharpness_of(m),
                            .creases = {crease},
                            .crease_count = 1};
    model.sum = find_sum(kernels, at, &seen, &ways);
    if (model.sum) model.context = &ways, model.isa = plan->isa;
    if (!(shd_area_integrate(shape, at, plan->point_off, &model, row) >= 0)) return false;
    const shd_stance stance = find_stance(shape, at);
    for (size_t t = 0; t < 1 + m->lobe_count; t++) {
        const double most = shd_shape_most_at(shape, m, t, &stance);
        for (size_t c = 0; c < 3; c++)
            row[3 * t + c] = shd_larger(shd_smaller(row[3 * t + c], most), 0);
    }
    return true;
}

/* Gives a copy of the material the lobes that it has at the point. */
static void sharpen_lobes(const shd_surface *at, shd_plan_lobe *lobes, shd_plan_material *out) {
    for (size_t k = 0; k < out->lobe_count; k++) {
        lobes[k] = out->lobes[k];
        lobes[k].shininess = at->sharp[2 * k][at->sharp_at];
    }
    out->lobes = lobes;
}

/* A light with a shape: Phong's model and Lambert's light by its boundary, the rest by quadrature.
 */
static bool weigh_shape(const shd_plan *plan, const shd_lighting *kernels, const shd_light *shape,
                        const shd_surface *at, double row[SHD_BRDF_ROWS]) {
    const shd_plan_material *m = at->material;
    /* They know of one exponent for all points. Microgeometry has none. */
    if (at->sharp && m->model != SHD_MODEL_WESTIN) kernels = NULL;
    const bool phong = m->model == SHD_MODEL_PHONG,
               own = m->model == SHD_MODEL_OREN_NAYAR || m->model == SHD_MODEL_WESTIN,
               summed = own || (!phong && m->lobe_count);
    if (summed && !sum_model(plan, kernels, shape, at, row)) return false;
    if (own) return true; /* of its diffuse light, which is not Lambert's */
    double diffuse, lobes[1 + SHD_LOBES_MOST];
    shd_plan_lobe sharp[1 + SHD_LOBES_MOST];
    shd_plan_material other = *m;
    shd_surface here = *at;
    if (!phong) other.lobe_count = 0;
    if (phong && at->sharp) sharpen_lobes(at, sharp, &other);
    if (!phong || at->sharp) here.material = &other;
    if (!shd_area_weigh(shape, &here, plan->point_off, &diffuse, lobes, NULL)) return summed;
    for (size_t c = 0; c < 3; c++) {
        row[c] = diffuse;
        for (size_t k = 0; phong && k < m->lobe_count; k++)
            row[3 + 3 * k + c] = lobes[k] * (at->sharp ? at->sharp[2 * k + 1][at->sharp_at] : 1);
    }
    return true;
}

bool shd_weigh_extended(const shd_plan *plan, const shd_lighting *kernels,
                        const shd_plan_light *light, const shd_surface *at,
                        double row[SHD_BRDF_ROWS]) {
    if (light->environment) {
        shd_weigh_environment(plan, kernels, light, at, row);
        return true;
    }
    if (light->shape) return weigh_shape(plan, kernels, light->shape, at, row);
    shd_vec3 toward;
    const double factor = shd_arriving(light, at->position, &toward);
    if (!(factor > 0) || !weigh_toward(plan, at, toward, row)) return false;
    for (size_t k = 0; k < 3 + 3 * at->material->lobe_count; k++) row[k] *= factor;
    return true;
}

static shd_vec3 lane_of(const double *const v[3], size_t i) {
    return (shd_vec3){v[0][i], v[1][i], v[2][i]};
}

static shd_surface surface_of(const shd_points64 *points, size_t i,
                              const shd_plan_material *material) {
    shd_surface at = {.position = lane_of(points->position, i),
                      .normal = lane_of(points->normal, i),
                      .view = lane_of(points->view, i),
                      .material = material,
                      .object = (size_t)points->object[i],
                      .sharp = points->sharp,
                      .sharp_at = points->sharp_at + i,
                      .facets = points->facets,
                      .facets_at = points->facets_at + i,
                      .known = points->known,
                      .known_at = points->known_at + i};
    if (points->triangle) at.triangle = points->triangle[i];
    at.mirror = shd_sub(shd_scale(at.normal, 2 * shd_dot(at.normal, at.view)), at.view);
    return at;
}

static void add_term(const shd_plan *plan, const shd_surface *at, const shd_plan_light *light,
                     size_t term, const double row[3], const double share[3], double sums[3]) {
    double lit[3];
    if (plan->bins) {
        shd_term_light(plan, at->material, light, term, row, lit);
        for (int c = 0; c < 3; c++) sums[c] += lit[c] * share[c];
    } else {
        for (int c = 0; c < 3; c++) sums[c] += row[c] * (light->color[c] * share[c]);
    }
}

/* The lobes of facets whose index changes with the wavelength, three bins at a time. */
static void add_facets(const shd_plan *plan, const shd_lighting *kernels,
                       const shd_plan_light *light, const shd_surface *at, const double share[3],
                       double *sums) {
    const shd_plan_material *m = at->material;
    const size_t bins = plan->bins->count;
    shd_surface here = *at;
    double row[SHD_BRDF_ROWS];
    for (size_t b = 0; b < bins && !shd_is_cancelled(plan->cancelled); b += 3) {
        here.index = &m->indices[b / 3];
        if (!shd_weigh_extended(plan, kernels, light, &here, row)) return;
        for (size_t k = 1; k <= m->lobe_count; k++)
            for (size_t i = 0; i < 3 && b + i < bins; i++) {
                const double lit = row[3 * k + i] * m->bins[k * bins + b + i];
                for (size_t c = 0; c < 3; c++)
                    sums[3 * k + c] += lit * light->bins[b + i][c] * share[c];
            }
    }
}

/* Lobes that an environment lights bin by bin: adds the light of each to out[bins][3]. */
static void spread_around(const shd_plan *plan, const shd_lighting *kernels,
                          const shd_plan_light *light, const shd_surface *at, size_t k,
                          const double *share, double (*out)[3]) {
    const size_t bins = plan->bins->count;
    double by[SHD_BINS_MOST] = {0};
    shd_weigh_environment_bins(plan, kernels, light, at, k, by);
    for (size_t b = 0; b < bins; b++) {
        const double lit = by[b] * at->material->bins[(1 + k) * bins + b] * (share ? share[b] : 1);
        for (size_t c = 0; c < 3; c++) out[b][c] += lit * light->bins[b][c];
    }
}

static void add_around(const shd_plan *plan, const shd_lighting *kernels,
                       const shd_plan_light *light, const shd_surface *at, const double share[3],
                       double *sums) {
    double spread[SHD_BINS_MOST][3], lit[3];
    for (size_t k = 0; k < at->material->lobe_count; k++) {
        memset(spread, 0, plan->bins->count * sizeof *spread);
        spread_around(plan, kernels, light, at, k, NULL, spread);
        shd_bins_mix(plan->bins->count, NULL, (const double(*)[3])spread, lit);
        for (size_t c = 0; c < 3; c++) sums[3 + 3 * k + c] += lit[c] * share[c];
    }
}

void shd_color_extended(const shd_plan *plan, const shd_lighting *kernels,
                        const shd_plan_light *light, const shd_surface *at,
                        const double row[SHD_BRDF_ROWS], const double share[3], double *sums) {
    const bool around = shd_is_by_bins(plan, light, at->material);
    const bool facets = around || at->material->indices;
    for (size_t k = 0; k < (facets ? 1 : 1 + at->material->lobe_count); k++)
        add_term(plan, at, light, k, row + 3 * k, share, sums + 3 * k);
    if (around)
        add_around(plan, kernels, light, at, share, sums);
    else if (facets)
        add_facets(plan, kernels, light, at, share, sums);
}

/* ---- In bins. ---- */

static void spread_facets(const shd_plan *plan, const shd_plan_light *light, const shd_surface *at,
                          const shd_terms *terms, const double *share, double (*out)[3]) {
    const shd_plan_material *m = at->material;
    const size_t bins = plan->bins->count;
    shd_surface here = *at;
    double row[SHD_BRDF_ROWS];
    for (size_t b = 0; b < bins && !shd_is_cancelled(plan->cancelled); b++) {
        here.index = &m->indices[b / 3];
        if (b % 3 == 0 && !shd_weigh_extended(plan, NULL, light, &here, row)) return;
        for (size_t k = 1 + terms->first; k <= terms->end; k++) {
            const double lit = row[3 * k + b % 3] * m->bins[k * bins + b] * share[b];
            for (size_t c = 0; c < 3; c++) out[b][c] += lit * light->bins[b][c];
        }
    }
}

static void spread_term(const shd_plan *plan, const shd_plan_light *light,
                        const shd_plan_material *m, size_t term, const double weights[3],
                        const double *share, double (*out)[3]) {
    const size_t bins = plan->bins->count;
    double by[SHD_BINS_MOST];
    const bool grey = weights[0] == weights[1] && weights[1] == weights[2];
    if (!grey) shd_bins_lift(plan->bins, weights, by);
    for (size_t b = 0; b < bins; b++) {
        const double lit = (grey ? weights[0] : by[b]) * m->bins[term * bins + b] * share[b];
        for (size_t c = 0; c < 3; c++) out[b][c] += lit * light->bins[b][c];
    }
}

static void spread_light(const shd_plan *plan, const shd_plan_light *light, const shd_surface *at,
                         const double *row, const shd_terms *terms, const double *share,
                         double (*out)[3]) {
    const shd_plan_material *m = at->material;
    if (terms->diffuse) spread_term(plan, light, m, 0, row, share, out);
    if (shd_is_by_bins(plan, light, m)) {
        for (size_t k = terms->first; k < terms->end; k++)
            spread_around(plan, NULL, light, at, k, share, out);
        return;
    }
    if (m->indices) {
        if (terms->first < terms->end) spread_facets(plan, light, at, terms, share, out);
        return;
    }
    for (size_t k = 1 + terms->first; k <= terms->end; k++)
        spread_term(plan, light, m, k, row + 3 * k, share, out);
}

/* Finds a light's weights. False: it adds nothing. */
static inline bool reach_point(const shd_lighting *lighting, const shd_lighting *kernels,
                               uint32_t index, const shd_surface *at, double row[SHD_BRDF_ROWS]) {
    const shd_plan *plan = lighting->plan;
    const shd_vec3 scaled = shd_scale(at->position, plan->scale);
    if (shd_is_behind_face(&lighting->exact[index], scaled, at->normal)) return false;
    return shd_weigh_extended(plan, kernels, &plan->lights[index], at, row);
}

/* What arrives of a light in each bin. */
static void share_bins(const shd_lighting *lighting, const shd_plan_light *light,
                       const shd_surface *at, double *share) {
    const shd_shadows *shadows = lighting->shadows;
    for (size_t b = 0; b < lighting->plan->bins->count; b++) share[b] = 1;
    if (shadows) shadows->share(shadows->context, light, at, share);
}

void shd_light_bins(const shd_lighting *lighting, uint32_t index, const shd_surface *at,
                    const shd_terms *terms, double (*out)[3]) {
    const shd_plan_light *light = &lighting->plan->lights[index];
    double row[SHD_BRDF_ROWS], share[SHD_BINS_MOST];
    if (!reach_point(lighting, lighting, index, at, row)) return;
    share_bins(lighting, light, at, share);
    spread_light(lighting->plan, light, at, row, terms, share, out);
}

/* The share differs by bins: each term's light goes through it before it becomes a color. */
static void color_shared(const shd_lighting *lighting, const shd_plan_light *light,
                         const shd_surface *at, const double *row, const double *share,
                         double *sums) {
    const shd_plan *plan = lighting->plan;
    double spread[SHD_BINS_MOST][3];
    for (size_t k = 0; k < 1 + at->material->lobe_count; k++) {
        const shd_terms term = {k == 0, k ? k - 1 : 0, k};
        double lit[3];
        memset(spread, 0, plan->bins->count * sizeof *spread);
        spread_light(plan, light, at, row, &term, share, spread);
        shd_bins_mix(plan->bins->count, NULL, (const double(*)[3])spread, lit);
        for (size_t c = 0; c < 3; c++) sums[3 * k + c] += lit[c];
    }
}

static inline void add_light(const shd_lighting *lighting, const shd_lighting *kernels,
                             uint32_t index, const shd_surface *at, double sums[SHD_BRDF_ROWS]) {
    static const double all[3] = {1, 1, 1};
    const shd_plan_light *light = &lighting->plan->lights[index];
    double row[SHD_BRDF_ROWS];
    if (reach_point(lighting, kernels, index, at, row))
        shd_color_extended(lighting->plan, kernels, light, at, row, all, sums);
}

void shd_add_extended(const shd_lighting *lighting, const shd_plan_material *material,
                      uint32_t index, const shd_points64 *points, size_t point, double *sums) {
    const shd_surface at = surface_of(points, point, material);
    add_light(lighting, lighting, index, &at, sums);
}

bool shd_has_kernel(const shd_lighting *lighting, const shd_plan_material *material) {
    const shd_plan *plan = lighting->plan;
    if (plan->bins && (!lighting->mixes || (lighting->shadows && plan->tinted))) return false;
    const size_t at = (size_t)(material - plan->materials);
    if (material->model == SHD_MODEL_WESTIN && !(lighting->westin && lighting->westin[at].table))
        return false;
    return true;
}

/* ---- Behind shadows: points that lie beside each other, light by light. ---- */

enum { CROWD_ROWS = 1024, CROWD_SHARES = 16 * SHD_BINS_MOST };

typedef struct crowded {
    shd_crowd crowd;
    size_t width, channels; /* of a point's rows, and of its share */
    double sums[CROWD_ROWS], rows[CROWD_ROWS], shares[CROWD_SHARES];
} crowded;

/* Takes the points of one object that follow each other. */
static void take_crowd(const shd_lighting *lighting, const shd_plan_material *material,
                       const shd_points64 *points, size_t first, crowded *c) {
    size_t most = SHD_CROWD, count = 0;
    if (most > CROWD_ROWS / c->width) most = CROWD_ROWS / c->width;
    if (most > CROWD_SHARES / c->channels) most = CROWD_SHARES / c->channels;
    if (most > points->count - first) most = points->count - first;
    for (; count < most && points->object[first + count] == points->object[first]; count++)
        c->crowd.at[count] = surface_of(points, first + count, material);
    c->crowd.count = count;
    c->crowd.seconds = points->shadowed;
    lighting->shadows->gather(lighting->shadows->context, &c->crowd);
    memset(c->sums, 0, count * c->width * sizeof *c->sums);
}

/* The weights of the points that the light would reach, then what of it arrives there, then both
 * with colors. */
static void add_to_crowd(const shd_lighting *lighting, uint32_t index, crowded *c) {
    const shd_plan_light *light = &lighting->plan->lights[index];
    const shd_shadows *shadows = lighting->shadows;
    uint8_t which[SHD_CROWD];
    size_t reached = 0;
    /* Maps are walked in vectors of directions. */
    const shd_lighting *kernels = light->environment ? lighting : NULL;
    for (size_t i = 0; i < c->crowd.count; i++) {
        double row[SHD_BRDF_ROWS];
        if (!reach_point(lighting, kernels, index, &c->crowd.at[i], row)) continue;
        for (size_t r = 0; r < c->width; r++) c->rows[reached * c->width + r] = row[r];
        which[reached++] = (uint8_t)i;
    }
    if (!reached) return;
    shadows->shares(shadows->context, light, &c->crowd, which, reached, c->shares);
    if (shd_is_cancelled(lighting->plan->cancelled)) return;
    for (size_t i = 0; i < reached; i++) {
        const shd_surface *at = &c->crowd.at[which[i]];
        const double *row = c->rows + i * c->width, *share = c->shares + i * c->channels;
        double *sums = c->sums + which[i] * c->width;
        if (lighting->plan->tinted)
            color_shared(lighting, light, at, row, share, sums);
        else
            shd_color_extended(lighting->plan, kernels, light, at, row, share, sums);
    }
}

static void sum_behind_shadows(const shd_lighting *lighting, const shd_plan_material *material,
                               const uint32_t *which, size_t n, const shd_points64 *points,
                               double *const diffuse[3], double *const *specular) {
    crowded c;
    c.width = 3 + 3 * material->lobe_count;
    c.channels = shd_ray_channels(lighting->plan);
    for (size_t first = 0; first < points->count; first += c.crowd.count) {
        take_crowd(lighting, material, points, first, &c);
        for (size_t j = 0; j < n; j++) {
            if (shd_is_cancelled(lighting->plan->cancelled)) return;
            add_to_crowd(lighting, which[j], &c);
        }
        for (size_t i = 0; i < c.crowd.count; i++) {
            const double *sums = c.sums + i * c.width;
            for (size_t r = 0; r < 3; r++)
                if (diffuse) diffuse[r][first + i] = sums[r];
            for (size_t r = 3; r < c.width; r++) specular[r - 3][first + i] = sums[r];
        }
    }
}

void shd_extended_sums(const shd_lighting *lighting, const shd_plan_material *material,
                       const uint32_t *which, size_t n, const shd_points64 *points,
                       double *const diffuse[3], double *const *specular) {
    const shd_plan *plan = lighting->plan;
    if (lighting->shadows) {
        sum_behind_shadows(lighting, material, which, n, points, diffuse, specular);
        return;
    }
    for (size_t i = 0; i < points->count; i++) {
        const shd_surface at = surface_of(points, i, material);
        double sums[SHD_BRDF_ROWS];
        memset(sums, 0, (3 + 3 * material->lobe_count) * sizeof *sums);
        for (size_t j = 0; j < n; j++) {
            if (shd_is_cancelled(plan->cancelled)) return;
            add_light(lighting, NULL, which[j], &at, sums);
        }
        for (size_t c = 0; c < 3; c++) {
            if (diffuse) diffuse[c][i] = sums[c];
            for (size_t k = 0; k < material->lobe_count; k++)
                specular[3 * k + c][i] = sums[3 + 3 * k + c];
        }
    }
}
