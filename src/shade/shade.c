/* Colors: weights times lights times materials, summed in f64 in one order, so that ten thousand
 * lights lose nothing and any split of a picture gives the same bytes. */
#include "shade/shade.h"

#include <string.h>

struct shd_shader {
    const shd_plan *plan;
    const shd_shade_kernel *kernel;
    const shd_light32 *lights32; /* as plan->lights; standard tier */
    shd_prepared block;
    shd_weights weights;
    double diffuse[3][SHD_BLOCK];     /* sum of wd Il */
    double (*specular)[3][SHD_BLOCK]; /* per lobe, sum of ws Il */
};

const shd_shade_kernel *shd_shade_kernel_of(shd_isa isa) {
    static const shd_shade_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_shade_kernel);
    return kernels[isa];
}

shd_shader *shd_shader_new(const shd_plan *plan, shd_arena *arena) {
    shd_shader *shader = shd_arena_zalloc(arena, 1, sizeof *shader);
    if (!shader) return NULL;
    shader->plan = plan;
    shader->kernel = shd_shade_kernel_of(plan->isa);
    shader->weights.specular =
        shd_arena_zalloc(arena, plan->max_lobes, sizeof *shader->weights.specular);
    shader->specular = shd_arena_zalloc(arena, plan->max_lobes, sizeof *shader->specular);
    if (!shader->weights.specular || !shader->specular) return NULL;
    if (plan->tier == SHD_STANDARD) {
        shd_light32 *lights = shd_arena_alloc(arena, plan->light_count, sizeof *lights);
        if (!lights) return NULL;
        for (size_t j = 0; j < plan->light_count; j++)
            lights[j] = shd_narrow_light(plan, &plan->lights[j]);
        shader->lights32 = lights;
    }
    return shader;
}

/* One light's own picture: kd wd Il + sum of ks ws Il. */
static void shade_light_plane(const shd_shader *shader, const shd_plan_light *light,
                              const shd_plan_material *material, double (*out)[SHD_BLOCK]) {
    const size_t lanes = shader->block.lanes;
    double color[3];
    for (int c = 0; c < 3; c++) color[c] = light->color[c] * material->diffuse[c];
    shader->kernel->add_weight(out, shader->weights.diffuse, color, lanes);
    for (size_t k = 0; k < material->lobe_count; k++) {
        for (int c = 0; c < 3; c++) color[c] = light->color[c] * material->lobes[k].specular[c];
        shader->kernel->add_weight(out, shader->weights.specular[k], color, lanes);
    }
}

/* The planes that are terms of the equation, from the sums over the lights. */
static void shade_term_planes(shd_shader *shader, const shd_plan_material *material,
                              double (*radiance)[3][SHD_BLOCK]) {
    const shd_plan *plan = shader->plan;
    const shd_shade_kernel *kernel = shader->kernel;
    const size_t lanes = shader->block.lanes;
    for (size_t p = 0; p < plan->plane_count; p++) {
        const shd_layer_kind kind = plan->planes[p].kind;
        const bool beauty = kind == SHD_LAYER_BEAUTY;
        if (kind == SHD_LAYER_LIGHT) continue;
        double constant[3] = {0, 0, 0};
        for (int c = 0; c < 3; c++) {
            if (beauty || kind == SHD_LAYER_EMISSIVE) constant[c] += material->emissive[c];
            if (beauty || kind == SHD_LAYER_AMBIENT) constant[c] += material->ambient[c];
        }
        kernel->fill(radiance[p], constant, lanes);
        if ((beauty || kind == SHD_LAYER_DIFFUSE) && material->has_diffuse)
            kernel->add_scaled(radiance[p], shader->diffuse, material->diffuse, lanes);
        if (beauty || kind == SHD_LAYER_SPECULAR)
            for (size_t k = 0; k < material->lobe_count; k++)
                kernel->add_scaled(radiance[p], shader->specular[k], material->lobes[k].specular,
                                   lanes);
    }
}

void shd_shade(shd_shader *shader, const shd_plan_material *material, const shd_points *points,
               double (*radiance)[3][SHD_BLOCK]) {
    const shd_plan *plan = shader->plan;
    const shd_shade_kernel *kernel = shader->kernel;
    const size_t lobes = material->lobe_count;
    kernel->prepare(plan, points, &shader->block);
    const size_t lanes = shader->block.lanes;

    memset(shader->diffuse, 0, sizeof shader->diffuse);
    memset(shader->specular, 0, lobes * sizeof *shader->specular);
    for (size_t p = 0; p < plan->plane_count; p++)
        if (plan->planes[p].kind == SHD_LAYER_LIGHT) memset(radiance[p], 0, sizeof radiance[p]);

    const bool lit = material->has_diffuse || lobes;
    for (size_t j = 0; lit && j < plan->light_count; j++) {
        const shd_plan_light *light = &plan->lights[j];
        if (plan->tier == SHD_STANDARD)
            kernel->weigh(&shader->lights32[j], light, material->lobes, lobes, &shader->block,
                          &shader->weights);
        else
            shd_weigh_exact(light, material->lobes, lobes, &shader->block, &shader->weights);

        kernel->add_weight(shader->diffuse, shader->weights.diffuse, light->color, lanes);
        for (size_t k = 0; k < lobes; k++)
            kernel->add_weight(shader->specular[k], shader->weights.specular[k], light->color,
                               lanes);
        for (size_t p = 0; p < plan->plane_count; p++)
            if (plan->planes[p].kind == SHD_LAYER_LIGHT && plan->planes[p].light == light->index)
                shade_light_plane(shader, light, material, radiance[p]);
    }
    shade_term_planes(shader, material, radiance);
}
