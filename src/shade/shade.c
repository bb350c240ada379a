/* Colors: weights times lights times materials, summed in f64 in one order, so that ten thousand
 * lights lose nothing and any split of a picture gives the same bytes. */
#include "shade/shade.h"

#include <string.h>

#include "shade/math32.h"

struct shd_shader {
    const shd_plan *plan;
    const shd_light32 *lights32; /* as plan->lights; standard tier */
    shd_prepared block;
    shd_weights weights;
    double diffuse[3][SHD_BLOCK];     /* sum of wd Il */
    double (*specular)[3][SHD_BLOCK]; /* per lobe, sum of ws Il */
};

shd_shader *shd_shader_new(const shd_plan *plan, shd_arena *arena) {
    shd_shader *shader = shd_arena_zalloc(arena, 1, sizeof *shader);
    if (!shader) return NULL;
    shader->plan = plan;
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

/* Mirrors V about N once a point, in f64 for every tier: R.V = L.W. */
static void prepare(const shd_plan *plan, const shd_points *points, shd_prepared *block) {
    block->points = points;
    block->lanes = (points->count + SHD_LANES - 1) / SHD_LANES * SHD_LANES;
    for (size_t i = 0; i < block->lanes; i++) {
        const double *n[3] = {points->normal[0], points->normal[1], points->normal[2]};
        const double *v[3] = {points->view[0], points->view[1], points->view[2]};
        double facing = n[0][i] * v[0][i] + n[1][i] * v[1][i] + n[2][i] * v[2][i];
        for (int c = 0; c < 3; c++) block->mirror[c][i] = 2 * facing * n[c][i] - v[c][i];
    }
    if (plan->tier != SHD_STANDARD) return;
    const double origin[3] = {plan->origin.x, plan->origin.y, plan->origin.z};
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < block->lanes; i++) {
            double p = (points->position[c][i] - origin[c]) * plan->scale;
            shd_split32(p, &block->high[c][i], &block->low[c][i]);
            block->normal32[c][i] = (float)points->normal[c][i];
            block->mirror32[c][i] = (float)block->mirror[c][i];
        }
    }
}

static void add_scaled(double *restrict sum, const double *restrict weight, double color,
                       size_t lanes) {
    for (size_t i = 0; i < lanes; i++) sum[i] += weight[i] * color;
}

/* One light's own picture: kd wd Il + sum of ks ws Il. */
static void shade_light_plane(const shd_shader *shader, const shd_plan_light *light,
                              const shd_plan_material *material, double (*out)[SHD_BLOCK]) {
    const size_t lanes = shader->block.lanes;
    for (int c = 0; c < 3; c++) {
        add_scaled(out[c], shader->weights.diffuse, light->color[c] * material->diffuse[c], lanes);
        for (size_t k = 0; k < material->lobe_count; k++)
            add_scaled(out[c], shader->weights.specular[k],
                       light->color[c] * material->lobes[k].specular[c], lanes);
    }
}

static void fill(double *out, double value, size_t lanes) {
    for (size_t i = 0; i < lanes; i++) out[i] = value;
}

/* The planes that are terms of the equation, from the sums over the lights. */
static void shade_term_planes(const shd_shader *shader, const shd_plan_material *material,
                              double (*radiance)[3][SHD_BLOCK]) {
    const shd_plan *plan = shader->plan;
    const size_t lanes = shader->block.lanes;
    for (size_t p = 0; p < plan->plane_count; p++) {
        const shd_layer_kind kind = plan->planes[p].kind;
        const bool beauty = kind == SHD_LAYER_BEAUTY;
        if (kind == SHD_LAYER_LIGHT) continue;
        for (int c = 0; c < 3; c++) {
            double *out = radiance[p][c];
            double constant = 0;
            if (beauty || kind == SHD_LAYER_EMISSIVE) constant += material->emissive[c];
            if (beauty || kind == SHD_LAYER_AMBIENT) constant += material->ambient[c];
            fill(out, constant, lanes);
            if ((beauty || kind == SHD_LAYER_DIFFUSE) && material->has_diffuse)
                add_scaled(out, shader->diffuse[c], material->diffuse[c], lanes);
            if (beauty || kind == SHD_LAYER_SPECULAR)
                for (size_t k = 0; k < material->lobe_count; k++)
                    add_scaled(out, shader->specular[k][c], material->lobes[k].specular[c], lanes);
        }
    }
}

void shd_shade(shd_shader *shader, const shd_plan_material *material, const shd_points *points,
               double (*radiance)[3][SHD_BLOCK]) {
    const shd_plan *plan = shader->plan;
    const size_t lobes = material->lobe_count;
    prepare(plan, points, &shader->block);
    const size_t lanes = shader->block.lanes;

    memset(shader->diffuse, 0, sizeof shader->diffuse);
    memset(shader->specular, 0, lobes * sizeof *shader->specular);
    for (size_t p = 0; p < plan->plane_count; p++)
        if (plan->planes[p].kind == SHD_LAYER_LIGHT) memset(radiance[p], 0, sizeof radiance[p]);

    const bool lit = material->has_diffuse || lobes;
    for (size_t j = 0; lit && j < plan->light_count; j++) {
        const shd_plan_light *light = &plan->lights[j];
        if (plan->tier == SHD_STANDARD)
            shd_weigh_standard(&shader->lights32[j], light, material->lobes, lobes, &shader->block,
                               &shader->weights);
        else
            shd_weigh_exact(light, material->lobes, lobes, &shader->block, &shader->weights);

        for (int c = 0; c < 3; c++) {
            add_scaled(shader->diffuse[c], shader->weights.diffuse, light->color[c], lanes);
            for (size_t k = 0; k < lobes; k++)
                add_scaled(shader->specular[k][c], shader->weights.specular[k], light->color[c],
                           lanes);
        }
        for (size_t p = 0; p < plan->plane_count; p++)
            if (plan->planes[p].kind == SHD_LAYER_LIGHT && plan->planes[p].light == light->index)
                shade_light_plane(shader, light, material, radiance[p]);
    }
    shade_term_planes(shader, material, radiance);
}
