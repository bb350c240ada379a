#include "render/tell/reflectance.h"

#include "shade/extended.h"

const double shd_albedo_angles[SHD_ALBEDO_ANGLES] = {0,  5,  10, 15, 20, 25, 30, 35, 40, 45,
                                                     50, 55, 60, 65, 70, 75, 80, 85, 89};

void shd_reflectance_at(const shd_reflectance *r, shd_vec3 light, shd_vec3 view, double f[3]) {
    const shd_plan_material *m = r->material;
    const shd_vec3 up = {0, 0, 1};
    const shd_plan_light source = {.directional = true,
                                   .toward = light,
                                   .gain = 1,
                                   .color = {1, 1, 1},
                                   .bins = r->plan->bins ? (const double(*)[3])r->plan->bins->white
                                                         : NULL};
    const shd_surface at = {.normal = up,
                            .view = view,
                            .mirror = {-view.x, -view.y, view.z},
                            .material = m,
                            .object = r->object};
    shd_plan plan = *r->plan;
    plan.term_colors = NULL; /* they are of its own lights */
    double row[SHD_BRDF_ROWS], sums[SHD_BRDF_ROWS] = {0};
    f[0] = f[1] = f[2] = 0;
    if (!(light.z > 0 && view.z > 0) || !shd_weigh_extended(&plan, NULL, &source, &at, row)) return;
    shd_color_extended(&plan, NULL, &source, &at, row, (const double[3]){1, 1, 1}, sums);
    for (size_t c = 0; c < 3; c++) {
        double sum = m->diffuse[c] * sums[c];
        for (size_t k = 0; k < m->lobe_count; k++)
            sum += m->lobes[k].specular[c] * sums[3 + 3 * k + c];
        f[c] = sum / (SHD_PI * light.z);
    }
}
