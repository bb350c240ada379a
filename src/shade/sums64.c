/* Light sums of the exact tier, by the reference (exact.c). */
#include "shade/packed.h"
#include "shade/shade.h"

static shd_vec3 lane_of(const double *const v[3], size_t i) {
    return (shd_vec3){v[0][i], v[1][i], v[2][i]};
}

void shd_light_sums64(const shd_lighting *lighting, const shd_plan_material *material,
                      const uint32_t *which, size_t n, const shd_points64 *points,
                      double *const diffuse[3], double *const *specular) {
    const shd_plan *plan = lighting->plan;
    const size_t lobes = material->lobe_count;
    const int channels = plan->grey_lights ? 1 : 3;
    for (size_t i = 0; i < points->count; i++) {
        const shd_vec3 position = lane_of(points->position, i), normal = lane_of(points->normal, i),
                       view = lane_of(points->view, i);
        const shd_vec3 mirror = shd_sub(shd_scale(normal, 2 * shd_dot(normal, view)), view);
        for (int c = 0; c < channels; c++) {
            if (diffuse) diffuse[c][i] = 0;
            for (size_t k = 0; k < lobes; k++) specular[3 * k + (size_t)c][i] = 0;
        }
        for (size_t j = 0; j < n; j++) {
            const shd_plan_light *light = &plan->lights[which[j]];
            double factor, off;
            const double weight = shd_weigh_light(light, position, normal, mirror, &factor, &off);
            for (int c = 0; diffuse && c < channels; c++) diffuse[c][i] += weight * light->color[c];
            for (size_t k = 0; k < lobes; k++) {
                const double lobe = shd_weigh_lobe(material->lobes[k].shininess, factor, off);
                for (int c = 0; c < channels; c++)
                    specular[3 * k + (size_t)c][i] += lobe * light->color[c];
            }
        }
    }
}
