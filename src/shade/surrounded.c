#include "shade/surrounded.h"

#include <string.h>

#include "plan/around.h"
#include "shade/around.h"
#include "shade/backdrop.h"
#include "shade/environment.h"
#include "shade/prefilter.h"
#include "shade/ways.h"

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

/* The point as it would be with one term alone, in the map's frame. */
static void walk_term(const shd_plan *plan, const shd_lighting *kernels,
                      const shd_plan_light *light, const shd_surface *at, size_t term,
                      double row[3]) {
    static shd_area_sum_function *const sums[SHD_ISA_COUNT] = SHD_VARIANTS(shd_sum_ways);
    const shd_light *from = light->environment;
    const size_t material = (size_t)(at->material - plan->materials);
    shd_plan_material alone = *at->material;
    shd_surface here = *at;
    alone.lobes = term ? at->material->lobes + term - 1 : NULL;
    alone.lobe_count = term > 0;
    here.material = &alone;
    here.sharp = NULL;
    here.normal = shd_to_map(from, at->normal);
    here.view = shd_to_map(from, at->view);
    here.mirror = shd_to_map(from, at->mirror);
    shd_way_point point = {.at = &here};
    if (kernels && kernels->energies[material])
        point.energies = kernels->energies[material] + (term ? term - 1 : 0);
    const shd_around_function f = {kernels ? sums[plan->isa] : sum_by_one, &point,
                                   3 + 3 * (term > 0)};
    const shd_around_lobe lobe = {alone.model, term ? alone.lobes[0].shininess : 0, here.normal,
                                  here.view, here.mirror};
    double all[6][SHD_WAY_SUMS];
    memset(all, 0, sizeof all);
    shd_around_sum(from->map, plan->moments ? plan->moments[light->around] : NULL, &lobe, &f, all);
    for (size_t c = 0; c < 3; c++) {
        double rgb[3];
        shd_from_map(from, all[term ? 3 + c : c], rgb);
        row[c] = rgb[c];
    }
}

void shd_weigh_environment(const shd_plan *plan, const shd_lighting *kernels,
                           const shd_plan_light *light, const shd_surface *at,
                           double row[SHD_BRDF_ROWS]) {
    const shd_plan_material *m = at->material;
    for (int c = 0; c < 3; c++) row[c] = 0;
    for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
        if (shd_is_symmetric(m->model, t))
            weigh_symmetric(plan, light, at, t, row + 3 * t);
        else
            walk_term(plan, kernels, light, at, t, row + 3 * t);
    }
}
