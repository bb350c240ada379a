/* Spectral scenes. Weights of light hold no color, so what a light does on a term of a material is
 * one color for all points: the sum over the bins of the light's color there times the term's
 * reflectance. */
#include <string.h>

#include "plan/parts.h"

/* Colors of terms that are kept: 6 MB at most. Others are summed up where they are needed. */
enum { MOST_KEPT = 1 << 18 };

bool shd_plan_bins(shd_plan *plan, double (**ambient)[3], shd_arena *arena) {
    const shd_scene *scene = plan->scene;
    const shd_spectral *spectral = &scene->spectral;
    *ambient = NULL;
    if (!spectral->channels) return true;
    const size_t count = (size_t)spectral->channels;
    shd_bins *bins = shd_arena_alloc(arena, 1, sizeof *bins);
    *ambient = shd_arena_zalloc(arena, count, sizeof **ambient);
    if (!bins || !*ambient ||
        !shd_bins_make(count, spectral->from, spectral->to, &scene->to_working, arena, bins))
        return false;
    plan->bins = bins;
    if (scene->ambient_curve)
        shd_bins_add_light(bins, scene->ambient_curve, *ambient);
    else
        shd_bins_add_lifted(bins, scene->ambient, *ambient);
    return true;
}

bool shd_plan_ambient_bins(const shd_plan *plan, const shd_light *light, double (*ambient)[3]) {
    if (!plan->bins) return true;
    if (shd_is_cancelled(plan->cancelled)) return false;
    if (light->ambient_curve)
        shd_bins_add_light(plan->bins, light->ambient_curve, ambient);
    else
        shd_bins_add_lifted(plan->bins, light->ambient, ambient);
    return true;
}

bool shd_plan_light_bins(const shd_plan *plan, shd_plan_light *lights, size_t count,
                         shd_arena *arena) {
    const shd_bins *bins = plan->bins;
    for (size_t j = 0; bins && j < count; j++) {
        const shd_light *light = &plan->scene->lights[lights[j].index];
        double(*colors)[3] = shd_arena_zalloc(arena, bins->count, sizeof *colors);
        if (!colors || shd_is_cancelled(plan->cancelled)) return false;
        if (light->color_curve)
            shd_bins_add_light(bins, light->color_curve, colors);
        else
            shd_bins_add_lifted(bins, light->color, colors);
        lights[j].bins = (const double(*)[3])colors;
        if (light->color_curve) shd_bins_mix(bins->count, NULL, lights[j].bins, lights[j].color);
    }
    return true;
}

static void reflect(const shd_bins *bins, const shd_curve *curve, const double rgb[3],
                    double *out) {
    if (curve)
        shd_bins_reflect(bins, curve, out);
    else
        shd_bins_lift(bins, rgb, out);
}

void shd_bins_lift_most(const shd_bins *bins, const double rgb[3], double *out) {
    double one[SHD_BINS_MOST];
    memset(out, 0, bins->count * sizeof *out);
    for (int i = 0; i < 3; i++) {
        shd_bins_lift(bins, (const double[3]){i == 0, i == 1, i == 2}, one);
        for (size_t b = 0; b < bins->count; b++) out[b] += fabs(rgb[i] * one[b]);
    }
}

static void reflect_term(const shd_bins *bins, const shd_texture *texture, const shd_curve *curve,
                         const double rgb[3], double *out) {
    if (texture)
        shd_bins_lift_most(bins, rgb, out);
    else
        reflect(bins, curve, rgb, out);
}

/* A curve's means in bins, or three channels' values, as reflectances are lifted. */
static void find_index(const shd_bins *bins, const shd_curve *curve, const double rgb[3],
                       double *out) {
    if (curve) {
        shd_bins_reflect(bins, curve, out);
        return;
    }
    for (size_t b = 0; b < bins->count; b++) {
        out[b] = 0;
        for (int c = 0; c < 3; c++) out[b] += rgb[c] * bins->primaries[b][c];
    }
}

/* False: memory is short. */
static bool find_indices(const shd_bins *bins, const shd_fresnel *fresnel, shd_arena *arena,
                         shd_plan_material *material) {
    const size_t groups = (bins->count + 2) / 3;
    double n[SHD_BINS_MOST], k[SHD_BINS_MOST] = {0};
    if (!fresnel->n_curve && !fresnel->k_curve && !fresnel->f0_curve) return true;
    shd_fresnel *indices = shd_arena_zalloc(arena, groups, sizeof *indices);
    if (!indices) return false;
    if (fresnel->f0_curve) {
        shd_bins_reflect(bins, fresnel->f0_curve, n);
        for (size_t b = 0; b < bins->count; b++) n[b] = shd_index_of(n[b]);
    } else {
        find_index(bins, fresnel->n_curve, fresnel->n, n);
        find_index(bins, fresnel->k_curve, fresnel->k, k);
    }
    for (size_t i = 0; i < 3 * groups; i++) {
        const size_t b = i < bins->count ? i : bins->count - 1;
        indices[i / 3].n[i % 3] = n[b];
        indices[i / 3].k[i % 3] = k[b];
    }
    material->indices = indices;
    return true;
}

bool shd_plan_material_bins(const shd_plan *plan, double (*ambient)[3], shd_arena *arena,
                            shd_plan_material *material) {
    const shd_bins *bins = plan->bins;
    if (!bins) return true;
    if (shd_is_cancelled(plan->cancelled)) return false;
    const shd_material *from = material->from;
    const size_t n = bins->count;
    double *rows = shd_arena_alloc(arena, (1 + material->lobe_count) * n, sizeof *rows);
    shd_lobe *lobes = shd_arena_alloc(arena, material->lobe_count, sizeof *lobes);
    double reflectance[SHD_BINS_MOST], light[SHD_BINS_MOST][3];
    if (!rows || !lobes) return false;
    if (from->emissive_curve) {
        memset(light, 0, n * sizeof *light);
        shd_bins_add_light(bins, from->emissive_curve, light);
        shd_bins_mix(n, NULL, (const double(*)[3])light, material->emissive);
    }
    reflect_term(bins, from->ambient_texture, from->ambient_curve, from->ambient, reflectance);
    shd_bins_mix(n, reflectance, (const double(*)[3])ambient, material->ambient);
    for (size_t b = 0; from->ambient_texture && b < n; b++)
        for (int c = 0; c < 3; c++) /* of colors that may cancel each other, no part does */
            material->ambient[c] += reflectance[b] * (fabs(ambient[b][c]) - ambient[b][c]);
    material->has_ambient = !shd_is_black(material->ambient);
    reflect_term(bins, from->diffuse_texture, from->diffuse_curve, from->diffuse, rows);
    size_t k = 0;
    for (size_t i = 0; i < from->lobe_count; i++) {
        const double *specular = from->lobes[i].specular;
        if (shd_is_black(specular)) continue; /* as in the plan's list */
        reflect_term(bins, from->lobe_textures ? from->lobe_textures[i] : NULL,
                     from->lobe_curves ? from->lobe_curves[i] : NULL, specular, rows + ++k * n);
        lobes[k - 1] = material->lobes[k - 1];
        for (int c = 0; c < 3; c++) lobes[k - 1].specular[c] = 1;
    }
    for (int c = 0; c < 3; c++) {
        material->constant[c] = material->emissive[c] + material->ambient[c];
        if (material->has_diffuse) material->diffuse[c] = 1;
    }
    if (from->model == SHD_MODEL_COOK_TORRANCE &&
        !find_indices(bins, &from->fresnel, arena, material))
        return false;
    material->lobes = lobes;
    material->bins = rows;
    material->bin_count = (1 + material->lobe_count) * n;
    return true;
}

static void mix_term(const shd_plan *plan, const shd_plan_material *material,
                     const shd_plan_light *light, size_t term, double out[3]) {
    const size_t n = plan->bins->count;
    shd_bins_mix(n, material->bins + term * n, light->bins, out);
}

bool shd_plan_term_colors(shd_plan *plan, shd_arena *arena) {
    const size_t materials = shd_all_materials(plan), lights = plan->light_count,
                 terms = 1 + plan->max_lobes;
    plan->term_colors = NULL;
    if (!plan->bins || !materials || !lights || materials > MOST_KEPT / terms / lights) return true;
    double *colors = shd_arena_zalloc(arena, materials * lights * terms, 3 * sizeof *colors);
    if (!colors) return false;
    for (size_t m = 0; m < materials; m++) {
        const shd_plan_material *material = &plan->materials[m];
        if (shd_is_cancelled(plan->cancelled)) return false;
        for (size_t j = 0; j < lights; j++)
            for (size_t k = 0; k < 1 + material->lobe_count; k++)
                mix_term(plan, material, &plan->lights[j], k,
                         colors + 3 * (k + terms * (j + lights * m)));
    }
    plan->term_colors = colors;
    return true;
}

const double *shd_term_color(const shd_plan *plan, const shd_plan_material *material,
                             const shd_plan_light *light, size_t term, double scratch[3]) {
    if (!plan->bins) return light->color;
    if (!plan->term_colors) {
        mix_term(plan, material, light, term, scratch);
        return scratch;
    }
    const size_t m = (size_t)(material - plan->materials), j = (size_t)(light - plan->lights),
                 terms = 1 + plan->max_lobes;
    return plan->term_colors + 3 * (term + terms * (j + plan->light_count * m));
}

void shd_term_light(const shd_plan *plan, const shd_plan_material *material,
                    const shd_plan_light *light, size_t term, const double weights[3],
                    double out[3]) {
    const size_t n = plan->bins->count;
    const double *row = material->bins + term * n;
    double lifted[SHD_BINS_MOST], scratch[3];
    if (shd_is_grey(weights)) {
        const double *color = shd_term_color(plan, material, light, term, scratch);
        for (int c = 0; c < 3; c++) out[c] = weights[0] * color[c];
        return;
    }
    shd_bins_lift(plan->bins, weights, lifted);
    for (size_t b = 0; b < n; b++) lifted[b] *= row[b];
    shd_bins_mix(n, lifted, light->bins, out);
}

void shd_term_most(const shd_plan *plan, const shd_plan_material *material,
                   const shd_plan_light *light, size_t term, double out[3]) {
    const size_t n = plan->bins->count;
    const double *row = material->bins + term * n;
    double one[3][SHD_BINS_MOST];
    for (int i = 0; i < 3; i++)
        shd_bins_lift(plan->bins, (const double[3]){i == 0, i == 1, i == 2}, one[i]);
    memset(out, 0, 3 * sizeof *out);
    for (size_t b = 0; b < n; b++) {
        const double most = fabs(row[b]) * (fabs(one[0][b]) + fabs(one[1][b]) + fabs(one[2][b]));
        for (int c = 0; c < 3; c++) out[c] += most * fabs(light->bins[b][c]);
    }
}
