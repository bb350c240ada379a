#include "shade/surrounded.h"

#include <math.h>
#include <string.h>

#include "plan/around.h"
#include "plan/tier.h"
#include "shade/around_quick.h"
#include "shade/backdrop.h"
#include "shade/environment.h"
#include "shade/prefilter.h"
#include "shade/ways.h"

/* Where a lobe differs from point to point: what it is at this one, in place of the material's.
 * Exponents beside those of tables are walked for. */
typedef struct own_lobe {
    shd_plan_lobe lobe;
    shd_packed_energy energy;
} own_lobe;

/* Gives the lobe of a point that has it alone to the point, and returns its share. */
static double sharpen(const shd_surface *at, size_t k, own_lobe *own, shd_plan_material *alone,
                      shd_way_point *point) {
    const double here = at->sharp[2 * k][at->sharp_at];
    if (here == alone->lobes->shininess) return 1;
    own->lobe = *alone->lobes;
    own->lobe.shininess = here;
    alone->lobes = &own->lobe;
    alone->antialiased = alone->pointwise = false;
    alone->normal = NULL;
    if (point->energies) {
        shd_fit_phong_energy(here, &own->energy);
        point->energies = &own->energy;
    }
    return at->sharp[2 * k + 1][at->sharp_at];
}

/* A term of Phong's model: by a table if the plan has one. */
static void weigh_symmetric(const shd_plan *plan, const shd_plan_light *light,
                            const shd_surface *at, size_t term, double row[3]) {
    const shd_light *from = light->environment;
    const shd_glow *glow = shd_find_glow(plan, at->material, light, term);
    const shd_vec3 normal = shd_to_map(from, at->normal),
                   toward = term ? shd_to_map(from, at->mirror) : normal;
    double sum[3];
    if (glow)
        shd_prefilter_weigh(glow->table, toward, term ? &normal : NULL, sum);
    else
        shd_environment_integrate(from->map, term ? at->material->lobes[term - 1].shininess : 1,
                                  toward, normal, sum);
    shd_from_map(from, sum, row);
}

/* What kernels do, without vectors. */
static void sum_by_one(const void *context, const shd_ways *ways, double (*out)[SHD_WAY_SUMS]) {
    const shd_surface *at = ((const shd_way_point *)context)->at;
    const size_t rows = 3 + 3 * at->material->lobe_count;
    double row[SHD_BRDF_ROWS];
    for (size_t i = 0; i < ways->points; i++) {
        const shd_vec3 toward = {ways->toward[0][i], ways->toward[1][i], ways->toward[2][i]};
        if (!shd_brdf_weigh(at, toward, row)) continue;
        for (size_t r = 0; r < rows; r++)
            for (int k = 0; k < ways->sums; k++) out[r][k] += ways->weight[k][i] * row[r];
    }
}

double shd_walk_floor(const shd_light *from, const shd_plan_material *alone, bool is_lobe,
                      const shd_surface *at) {
    const double viewing = shd_dot(at->normal, at->view);
    double peak = INFINITY;
    if (is_lobe && alone->model == SHD_MODEL_COOK_TORRANCE && viewing > 0)
        peak = shd_facets_most(alone->lobes[0].shininess) *
               shd_mirrored_most(at->material, viewing / 2) / (4 * viewing);
    return SHD_QUICK_FLOOR * shd_around_most_of(from, alone, is_lobe, peak) / shd_around_gain(from);
}

/* The point as it would be with one term alone, in the map's frame. Writes what each channel of the
 * working space makes of each channel of the term: out[map's][term's]. `share`: of quick walks. */
static void walk_term(const shd_plan *plan, const shd_lighting *kernels,
                      const shd_plan_light *light, const shd_surface *at, size_t term, double share,
                      double out[3][3]) {
    static shd_area_sum_function *const sums[SHD_ISA_COUNT] = SHD_VARIANTS(shd_sum_ways);
    const shd_light *from = light->environment;
    const size_t material = (size_t)(at->material - plan->materials);
    shd_plan_material alone = *at->material;
    shd_surface here = *at;
    own_lobe own;
    double gain = 1;
    alone.lobes = term ? at->material->lobes + term - 1 : NULL;
    alone.lobe_count = term > 0;
    alone.gloss = NULL; /* the point has one number */
    here.material = &alone;
    here.sharp = NULL;
    here.normal = shd_to_map(from, at->normal);
    here.view = shd_to_map(from, at->view);
    here.mirror = shd_to_map(from, at->mirror);
    shd_way_point point = {.at = &here};
    if (kernels && kernels->energies[material])
        point.energies = kernels->energies[material] + (term ? term - 1 : 0);
    if (term && at->sharp) gain = sharpen(at, term - 1, &own, &alone, &point);
    const shd_around_function f = {
        kernels ? sums[plan->isa] : sum_by_one, &point, 3 + 3 * (term > 0), plan->isa,
        kernels && shd_ways32_hold(&point, from->map->most) ? &point : NULL};
    const shd_around_lobe lobe = {alone.model, term ? alone.lobes[0].shininess : 0, here.normal,
                                  here.view, here.mirror};
    double all[6][SHD_WAY_SUMS];
    memset(all, 0, sizeof all);
    const shd_moments *moments = plan->moments ? plan->moments[light->around] : NULL;
    if (moments && plan->glows)
        shd_around_sum_quickly(from->map, moments, &lobe, &f, share,
                               shd_walk_floor(from, &alone, term > 0, at), all);
    else
        shd_around_sum(from->map, moments, &lobe, &f, all);
    for (size_t c = 0; c < 3; c++) {
        double rgb[3];
        shd_from_map(from, all[term ? 3 + c : c], rgb);
        for (int k = 0; k < 3; k++) out[k][c] = gain * rgb[k];
    }
}

/* A lobe of Phong's that may be another one at the point. */
static void weigh_sharpened(const shd_plan *plan, const shd_lighting *kernels,
                            const shd_plan_light *light, const shd_surface *at, size_t term,
                            double row[3]) {
    const shd_light *from = light->environment;
    const double own = at->material->lobes[term - 1].shininess,
                 here = at->sharp[2 * (term - 1)][at->sharp_at];
    if (here == own || (shd_find_glow(plan, at->material, light, term) &&
                        fabs(log((here + 1) / (own + 1))) <= SHD_GLOW_WIDENED)) {
        weigh_symmetric(plan, light, at, term, row);
        return;
    }
    if (plan->glows && plan->moments && plan->moments[light->around]) {
        shd_walk_environment(plan, kernels, light, at, term, SHD_QUICK_SHARE, row);
        return;
    }
    double sum[3];
    shd_environment_integrate(from->map, here, shd_to_map(from, at->mirror),
                              shd_to_map(from, at->normal), sum);
    shd_from_map(from, sum, row);
    for (int c = 0; c < 3; c++) row[c] *= at->sharp[2 * (term - 1) + 1][at->sharp_at];
}

/* Lifting is linear: light of one channel of the working space in each bin. */
static void lift_channels(const shd_bins *bins, double out[3][SHD_BINS_MOST]) {
    for (int k = 0; k < 3; k++)
        shd_bins_lift(bins, (const double[3]){k == 0, k == 1, k == 2}, out[k]);
}

void shd_weigh_environment_bins(const shd_plan *plan, const shd_lighting *kernels,
                                const shd_plan_light *light, const shd_surface *at, size_t k,
                                double *out) {
    const shd_plan_material *m = at->material;
    const size_t bins = plan->bins->count;
    shd_surface here = *at;
    double lifted[3][SHD_BINS_MOST], by[3][3];
    lift_channels(plan->bins, lifted);
    if (!m->indices) walk_term(plan, kernels, light, &here, 1 + k, SHD_QUICK_SHARE, by);
    for (size_t b = 0; b < bins && !shd_is_cancelled(plan->cancelled); b++) {
        here.index = m->indices ? &m->indices[b / 3] : NULL;
        if (m->indices && b % 3 == 0)
            walk_term(plan, kernels, light, &here, 1 + k, SHD_QUICK_SHARE, by);
        out[b] = 0;
        for (int from = 0; from < 3; from++) {
            double mirrored = by[from][b % 3];
            if (!m->indices)
                mirrored = lifted[0][b] * by[from][0] + lifted[1][b] * by[from][1] +
                           lifted[2][b] * by[from][2];
            out[b] += lifted[from][b] * mirrored;
        }
    }
}

void shd_walk_environment(const shd_plan *plan, const shd_lighting *kernels,
                          const shd_plan_light *light, const shd_surface *at, size_t term,
                          double share, double row[3]) {
    double all[3][3];
    walk_term(plan, kernels, light, at, term, share, all);
    for (size_t c = 0; c < 3; c++) row[c] = all[c][c];
}

/* False: nothing is known of the term at the point. */
static bool recall_term(const shd_plan *plan, const shd_plan_light *light, const shd_surface *at,
                        size_t term, double row[3]) {
    const shd_known *known = at->known;
    for (size_t k = 0; known && k < known->count; k++) {
        if (known->term[k] != term || &plan->lights[known->light[k]] != light) continue;
        if (!(known->has[at->known_at] >> k & 1)) return false;
        for (size_t c = 0; c < 3; c++) row[c] = known->rows[3 * k + c][at->known_at];
        return true;
    }
    return false;
}

void shd_weigh_environment(const shd_plan *plan, const shd_lighting *kernels,
                           const shd_plan_light *light, const shd_surface *at,
                           double row[SHD_BRDF_ROWS]) {
    const shd_plan_material *m = at->material;
    const bool by_bins = shd_is_by_bins(plan, light, m);
    memset(row, 0, (3 + 3 * m->lobe_count) * sizeof *row);
    for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
        if (t && at->sharp && shd_is_symmetric(m->model, t))
            weigh_sharpened(plan, kernels, light, at, t, row + 3 * t);
        else if (shd_is_symmetric(m->model, t))
            weigh_symmetric(plan, light, at, t, row + 3 * t);
        else if (!by_bins && !recall_term(plan, light, at, t, row + 3 * t))
            shd_walk_environment(plan, kernels, light, at, t, SHD_QUICK_SHARE, row + 3 * t);
    }
}
