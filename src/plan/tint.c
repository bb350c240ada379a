/* Rays that carry bins. Where mirrors, glass and opacities are colored, a ray's share of what it
 * meets differs by bins, and so light is kept in bins until it is at the eye: each bin's light is
 * the color that it adds there. Grey coefficients multiply a color as they multiply its bins. */
#include <string.h>

#include "plan/parts.h"
#include "plan/textures.h"

static bool is_tinted(const shd_scene *scene) {
    for (size_t i = 0; i < scene->material_count; i++) {
        const shd_material *m = &scene->materials[i];
        if (m->opacity_curve || !shd_is_grey(m->opacity)) return true;
        if (scene->trace.depth && (m->reflection_curve || m->transmission_curve)) return true;
        if (scene->trace.depth && !(shd_is_grey(m->reflection) && shd_is_grey(m->transmission)))
            return true;
    }
    return false;
}

bool shd_plan_tinted(shd_plan *plan, shd_arena *arena) {
    const shd_scene *scene = plan->scene;
    if (!plan->bins || !shd_is_traced(scene) || !is_tinted(scene)) return true;
    double(*behind)[3] = shd_arena_zalloc(arena, plan->bins->count, sizeof *behind);
    if (!behind) return false;
    if (!scene->transparent) shd_bins_add_lifted(plan->bins, scene->background, behind);
    plan->background = (const double(*)[3])behind;
    plan->tinted = true;
    return true;
}

static void lift(const shd_bins *bins, const shd_curve *curve, const double rgb[3], double *out) {
    if (curve) {
        shd_bins_reflect(bins, curve, out);
        return;
    }
    if (!shd_is_grey(rgb)) {
        shd_bins_lift(bins, rgb, out);
        return;
    }
    for (size_t b = 0; b < bins->count; b++) out[b] = rgb[0];
}

/* The most that a texture whose larger colors are given sends in each bin. */
static void add_most(const shd_bins *bins, const double rgb[3], double (*out)[3]) {
    double one[SHD_BINS_MOST][3];
    for (int i = 0; i < 3; i++) {
        memset(one, 0, bins->count * sizeof *one);
        shd_bins_add_lifted(bins, (const double[3]){i == 0, i == 1, i == 2}, one);
        for (size_t b = 0; b < bins->count; b++)
            for (int c = 0; c < 3; c++) out[b][c] += fabs(rgb[i] * one[b][c]);
    }
}

bool shd_plan_tint(shd_plan *plan, double (*ambient)[3], shd_arena *arena,
                   shd_plan_material *material) {
    static const double SLACK = 1e-9; /* decimals of the primaries */
    if (!plan->tinted) return true;
    const shd_bins *bins = plan->bins;
    const shd_material *from = material->from;
    const size_t n = bins->count;
    double *block = shd_arena_zalloc(arena, 9 * n, sizeof *block);
    double(*colors)[3] = block ? (double(*)[3])(void *)(block + 3 * n) : NULL;
    double reflectance[SHD_BINS_MOST];
    shd_tint *tint = shd_arena_alloc(arena, 1, sizeof *tint);
    if (!block || !tint || shd_is_cancelled(plan->cancelled)) return false;
    lift(bins, from->opacity_curve, from->opacity, block);
    lift(bins, from->reflection_curve, from->reflection, block + n);
    lift(bins, from->transmission_curve, from->transmission, block + 2 * n);
    if (from->emissive_curve)
        shd_bins_add_light(bins, from->emissive_curve, colors);
    else if (from->emissive_texture)
        add_most(bins, from->emissive, colors);
    else
        shd_bins_add_lifted(bins, from->emissive, colors);
    if (from->ambient_curve)
        shd_bins_reflect(bins, from->ambient_curve, reflectance);
    else if (from->ambient_texture)
        shd_bins_lift_most(bins, from->ambient, reflectance);
    else
        shd_bins_lift(bins, from->ambient, reflectance);
    for (size_t b = 0; b < n; b++) {
        plan->beyond |= block[b] < -SLACK || block[b] > 1 + SLACK;
        if (fabs(block[b]) <= SLACK) block[b] = 0;
        if (fabs(block[b] - 1) <= SLACK) block[b] = 1;
        for (int c = 0; c < 3; c++) colors[n + b][c] = reflectance[b] * ambient[b][c];
    }
    *tint = (shd_tint){block, block + n, block + 2 * n, (const double(*)[3])colors,
                       (const double(*)[3])(colors + n)};
    material->tint = tint;
    return true;
}

bool shd_plan_part_tint(const shd_plan *plan, const shd_ambience *ambient, size_t part,
                        shd_arena *arena, const shd_plan_material *material,
                        shd_plan_material *out) {
    const shd_bins *bins = plan->bins;
    const shd_material *from = material->from;
    const size_t n = bins->count;
    if (!plan->tinted) return true;
    double(*colors)[3] = shd_arena_zalloc(arena, 2 * n, sizeof *colors), color[3],
    reflectance[SHD_BINS_MOST];
    shd_tint *tint = shd_arena_alloc(arena, 1, sizeof *tint);
    if (!colors || !tint) return false;
    if (from->emissive_texture) {
        shd_texture_part(from->emissive_texture, part, color);
        shd_bins_add_lifted(bins, color, colors);
    } else if (part == 0) {
        memcpy(colors, material->tint->emissive, n * sizeof *colors);
    }
    if (from->ambient_texture) {
        shd_texture_part(from->ambient_texture, part, color);
        shd_bins_lift(bins, color, reflectance);
        for (size_t b = 0; b < n; b++)
            for (int c = 0; c < 3; c++) colors[n + b][c] = reflectance[b] * ambient->bins[b][c];
    } else if (part == 0) {
        memcpy(colors + n, material->tint->ambient, n * sizeof *colors);
    }
    *tint = *material->tint;
    tint->emissive = (const double(*)[3])colors;
    tint->ambient = (const double(*)[3])(colors + n);
    out->tint = tint;
    return true;
}

bool shd_same_tint(const shd_plan_material *x, const shd_plan_material *y) {
    const size_t n = x->tint ? x->bin_count / (1 + x->lobe_count) : 0;
    return !n || !memcmp(x->tint->opacity, y->tint->opacity, 9 * n * sizeof(double));
}

void shd_light_in_bins(const shd_plan *plan, const shd_light *light, double (*out)[3]) {
    const size_t n = plan->bins->count;
    for (size_t j = 0; j < plan->light_count; j++)
        if (plan->lights[j].shape == light) {
            memcpy(out, plan->lights[j].bins, n * sizeof *out);
            return;
        }
    memset(out, 0, n * sizeof *out);
    if (light->color_curve)
        shd_bins_add_light(plan->bins, light->color_curve, out);
    else
        shd_bins_add_lifted(plan->bins, light->color, out);
}

double shd_mean_share(const shd_plan *plan, const double *share) {
    double rgb[3];
    if (!plan->tinted) return (share[0] + share[1] + share[2]) / 3;
    shd_bins_mix(plan->bins->count, share, (const double(*)[3])plan->bins->white, rgb);
    return (rgb[0] + rgb[1] + rgb[2]) / 3;
}

double shd_most_in_bins(const shd_bins *bins, const double (*of)[3]) {
    double sum[3] = {0}, most = 0;
    for (size_t b = 0; b < bins->count; b++)
        for (int c = 0; c < 3; c++) sum[c] += fabs(of[b][c]);
    for (int c = 0; c < 3; c++) most = shd_larger(sum[c], most);
    return most;
}

double shd_lifted_most(const shd_bins *bins) {
    double lifted[3][SHD_BINS_MOST], sum[3] = {0};
    for (int k = 0; k < 3; k++)
        shd_bins_lift(bins, (const double[3]){k == 0, k == 1, k == 2}, lifted[k]);
    for (size_t b = 0; b < bins->count; b++)
        for (int c = 0; c < 3; c++)
            sum[c] += (fabs(lifted[0][b]) + fabs(lifted[1][b]) + fabs(lifted[2][b])) *
                      fabs(bins->white[b][c]);
    return shd_larger(sum[0], shd_larger(sum[1], sum[2]));
}
