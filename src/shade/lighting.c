#include "shade/lighting.h"

#include <assert.h>

#include "plan/textures.h"
#include "shade/brdf.h"
#include "shade/exact.h"
#include "shade/extended.h"
#include "shade/packed.h"
#include "shade/quick.h"
#include "shade/shadowed.h"
#include "shade/sketch.h"
#include "shade/split32.h"
#include "shade/westin_table.h"

static int32_t kind_of(const shd_plan_light *light) {
    if (light->directional) return SHD_KIND_DIRECTIONAL;
    if (light->spot) return SHD_KIND_SPOT;
    return light->attenuated ? SHD_KIND_ATTENUATED : SHD_KIND_POINT;
}

/* `origin` is that of the frame. The constants are in units of the plan's frame and divided by the
 * largest of the three again, so that a scene of any size gives f32 the same numbers. */
static shd_wide_light pack_wide(const shd_plan *plan, const shd_plan_light *light,
                                shd_vec3 origin) {
    const double s = plan->scale;
    const shd_vec3 at =
        light->directional ? light->toward : shd_scale(shd_sub(light->position, origin), s);
    const double a = light->a, b = light->b / s, c = light->c / s / s;
    const double largest = light->directional ? 1 : fmax(a, fmax(b, c));
    shd_wide_light out = {.at = {at.x, at.y, at.z},
                          .a = a / largest,
                          .b = b / largest,
                          .c = c / largest,
                          .least = light->min_distance * s,
                          .axis = {light->axis.x, light->axis.y, light->axis.z},
                          .outer = light->outer,
                          .inner = light->inner,
                          .exponent = light->exponent,
                          .gain = light->gain / largest,
                          .kind = kind_of(light)};
    if (light->outer > light->inner) out.inverse_fade = 1 / (light->outer - light->inner);
    double brightest = 0;
    for (int k = 0; k < 3; k++) {
        out.color[k] = light->color[k] * out.gain;
        brightest = fmax(brightest, fabs(out.color[k]));
    }
    const double reach = shd_max_abs(at);
    if (light->environment ||
        !(brightest > 1e-250 && brightest < 1e30 && reach < 1e90 && out.least < 1e90))
        out.kind = SHD_KIND_WIDE;
    return out;
}

/* Whether f32 is enough for this light. Steep lights need f64, and so do constants for which f32's
 * products in the plan's frame are not finite. */
static bool fits_f32(const shd_packed_light *light, const shd_plan_light *from) {
    if (from->steep) return false;
    float brightest = 0, reach = 0;
    for (int c = 0; c < 3; c++) {
        brightest = fmaxf(brightest, fabsf(light->color[c]));
        reach = fmaxf(reach, fabsf(light->at[c]));
    }
    if (!(brightest > 1e-18f && brightest < 1e18f)) return false;
    return from->directional || (light->least < 1e12f && reach < 1e12f);
}

shd_packed_light shd_pack_light(const shd_plan *plan, const shd_plan_light *light) {
    const shd_wide_light wide = pack_wide(plan, light, plan->origin);
    /* 2^-43 and 2^80: beyond these, f32's squares and their products have lost bits. */
    const uint32_t nearest = 0x2a000000, farthest = 0x67800000;
    shd_packed_light out = {.a = (float)wide.a,
                            .b = (float)wide.b,
                            .c = (float)wide.c,
                            .least = (float)wide.least,
                            .nearest = nearest,
                            .span = farthest - nearest,
                            .group = (uint32_t)(light->index / SHD_LIGHT_GROUP),
                            .outer = (float)wide.outer,
                            .inner = (float)wide.inner,
                            .inverse_fade = (float)wide.inverse_fade,
                            .exponent = (float)wide.exponent};
    for (int k = 0; k < 3; k++) {
        shd_split32(wide.at[k], &out.at[k], &out.low[k]);
        out.axis[k] = (float)wide.axis[k];
        out.color[k] = (float)wide.color[k];
    }
    if (shd_has_hard_rim(light)) out.rim = (float)(SHD_RIM * sqrt(light->outer));
    out.kind = fits_f32(&out, light) ? kind_of(light) : SHD_KIND_WIDE;
    return out;
}

/* log2(1 - d) = -d (c[0] + d (c[1] + ...)) for d up to 1/2. The coefficients make the least error
 * of 2^(ns log2(1 - d)) of the short lobes. */
static const double LOG[SHD_LOG_TERMS] = {1.44269508759, 0.721330732974, 0.481848665832,
                                          0.342813376071, 0.413331551016};

shd_packed_lobe shd_pack_lobe(const shd_plan *plan, double shininess) {
    const double cut = shd_lobe_cut(plan->scene->light_count);
    shd_packed_lobe out = {.reach = (float)(2 * fmin(1, cut / shininess)),
                           .is_short = shd_is_short_lobe(shininess, cut),
                           .shininess = (float)shininess};
    double scale = -shininess;
    for (int k = 0; k < SHD_LOG_TERMS; k++) {
        scale /= 2;
        out.log[k] = (float)(scale * LOG[k]);
    }
    return out;
}

/* How near to a plane its points are in f32, and in f64. */
static const double SAME32 = 4e-7, SAME64 = 1e-13;

/* False: memory is short. */
static bool pack_sheets(const shd_plan *plan, size_t index, shd_vec3 origin, double same,
                        shd_wide_light *to, shd_arena *arena) {
    if (!plan->sheets) return true;
    const shd_sheets *from = &plan->sheets[index];
    const bool far = plan->lights[index].directional;
    const double s = plan->scale;
    shd_packed_sheet *sheets = shd_arena_alloc(arena, from->count, sizeof *sheets);
    if (!sheets) return false;
    for (size_t k = 0; k < from->count; k++) {
        const shd_sheet *sheet = &from->list[k];
        const shd_vec3 n = sheet->normal;
        sheets[k] = (shd_packed_sheet){.normal = {n.x, n.y, n.z},
                                       .offset = shd_dot(n, shd_sub(sheet->point, origin)) * s,
                                       .height = far ? sheet->height : sheet->height * s,
                                       .same_normal = same * same,
                                       .same_place = same,
                                       .slack = SAME64 * sheet->size * s};
    }
    to->sheets = sheets;
    to->sheet_count = (uint32_t)from->count;
    return true;
}

/* All lights in f64, for points in a frame that begins at `origin`, which know of a face's plane
 * that they are in to within `same`. NULL: memory is short. */
static const shd_wide_light *pack_all_wide(const shd_plan *plan, shd_vec3 origin, double same,
                                           shd_arena *arena) {
    shd_wide_light *wide = shd_arena_alloc(arena, plan->light_count, sizeof *wide);
    for (size_t j = 0; wide && j < plan->light_count; j++) {
        wide[j] = pack_wide(plan, &plan->lights[j], origin);
        if (!pack_sheets(plan, j, origin, same, &wide[j], arena)) return NULL;
    }
    return wide;
}

/* NULL: memory is short. */
static const shd_packed_energy *const *pack_energies(const shd_plan *plan, shd_arena *arena) {
    const size_t count = plan->extended ? shd_all_materials(plan) : 0;
    const shd_packed_energy **all = shd_arena_zalloc(arena, count, sizeof *all);
    for (size_t m = 0; all && m < count; m++) {
        const shd_plan_material *from = &plan->materials[m];
        if (from->model != SHD_MODEL_PHONG_NORMALIZED) continue;
        shd_packed_energy *energies = shd_arena_alloc(arena, from->lobe_count, sizeof *energies);
        if (!energies) return NULL;
        for (size_t k = 0; k < from->lobe_count && !shd_is_cancelled(plan->cancelled); k++)
            shd_fit_phong_energy(from->lobes[k].shininess, &energies[k]);
        all[m] = energies;
    }
    return all;
}

/* False: memory is short. */
static bool pack_mix(const shd_plan *plan, const shd_plan_material *material, shd_arena *arena,
                     const shd_packed_mix **out) {
    const size_t terms = 1 + material->lobe_count;
    shd_packed_mix *mixes = shd_arena_alloc(arena, plan->light_count, terms * sizeof *mixes);
    *out = mixes;
    for (size_t j = 0; mixes && j < plan->light_count; j++) {
        if (shd_is_cancelled(plan->cancelled)) return false;
        for (size_t k = 0; k < terms; k++)
            for (int i = 0; i < 3; i++)
                shd_term_light(plan, material, &plan->lights[j], k,
                               (const double[3]){i == 0, i == 1, i == 2}, mixes[j * terms + k][i]);
    }
    return mixes;
}

/* 5 MB at most, or none at all. False: memory is short. */
static bool pack_mixes(const shd_plan *plan, shd_arena *arena, const shd_packed_mix *const **out) {
    enum { MOST = 1 << 16 };
    const size_t count = shd_all_materials(plan), terms = 1 + plan->max_lobes;
    *out = NULL;
    if (!plan->term_colors || count > MOST / terms / plan->light_count) return true;
    const shd_packed_mix **all = shd_arena_zalloc(arena, count, sizeof *all);
    for (size_t m = 0; all && m < count; m++) {
        const shd_plan_material *from = &plan->materials[m];
        const bool differ = from->model == SHD_MODEL_WESTIN ||
                            (from->model == SHD_MODEL_COOK_TORRANCE && !from->indices);
        if (differ && !pack_mix(plan, from, arena, &all[m])) return false;
    }
    *out = all;
    return all;
}

/* Tables that have their colors, 0.6 MB for each channel: further materials do without, as those do
 * whose facets have a texture. NULL: memory is short. */
static const shd_westin_colored *color_tables(const shd_plan *plan, shd_arena *arena) {
    enum { MOST_CHANNELS = 24 };
    const size_t count = plan->westin ? plan->scene->material_count : 0;
    shd_westin_colored *all = shd_arena_zalloc(arena, count, sizeof *all);
    size_t used = 0;
    for (size_t m = 0; all && m < count; m++) {
        const shd_westin *table = plan->westin[m];
        if (!table || shd_facet_slot(&plan->materials[m])) continue;
        const double *kd = plan->materials[m].from->diffuse;
        const size_t channels = kd[0] == kd[1] && kd[1] == kd[2] ? 1 : 3;
        if (used + channels > MOST_CHANNELS || shd_is_cancelled(plan->cancelled)) break;
        for (size_t c = 0; c < channels; c++) {
            double *rho = shd_arena_alloc(arena, SHD_WESTIN_CHANNEL, sizeof *rho);
            if (!rho) return NULL;
            shd_westin_color(table, kd[c], rho);
            all[m].rho[c] = rho;
        }
        all[m].channels = channels;
        all[m].table = table;
        used += channels;
    }
    return all;
}

/* Finds lights that may be summed quickly, those that fall off as the first of them does. */
static shd_packed_light find_quick(size_t count, shd_packed_light *lights) {
    shd_packed_light all = {.span = 0};
    uint32_t end = 0;
    for (size_t j = 0; j < count; j++) {
        shd_packed_light *l = &lights[j];
        if ((l->kind != SHD_KIND_POINT && l->kind != SHD_KIND_ATTENUATED) || !l->span ||
            !(l->color[0] >= 0 && l->color[1] >= 0 && l->color[2] >= 0))
            continue;
        if (!end) {
            all = *l;
            end = l->nearest + l->span;
        }
        l->quick = l->a == all.a && l->b == all.b && l->c == all.c && l->least == all.least;
        if (!l->quick) continue;
        if (l->nearest > all.nearest) all.nearest = l->nearest;
        if (l->nearest + l->span < end) end = l->nearest + l->span;
    }
    all.span = end > all.nearest ? end - all.nearest : 0;
    return all;
}

shd_lighting *shd_lighting_new(const shd_plan *plan, const shd_shadows *shadows, shd_arena *arena) {
    static shd_sums_function *const sums32[SHD_ISA_COUNT] = SHD_VARIANTS(shd_sums32),
                                    *const sums64[SHD_ISA_COUNT] = SHD_VARIANTS(shd_sums64),
                                    *const brdf64[SHD_ISA_COUNT] = SHD_VARIANTS(shd_brdf64),
                                    *const models32[SHD_ISA_COUNT] = SHD_VARIANTS(shd_models32);
    const bool fast = plan->tier != SHD_EXACT;
    const size_t material_count = fast ? plan->scene->material_count : 0;
    const size_t light_count = plan->light_count;
    shd_lighting *lighting = shd_arena_alloc(arena, 1, sizeof *lighting);
    const shd_wide_light *exact = pack_all_wide(plan, (shd_vec3){0, 0, 0}, SAME64, arena),
                         *wide = fast ? pack_all_wide(plan, plan->origin, SAME32, arena) : exact;
    shd_packed_light *lights = shd_arena_alloc(arena, fast ? light_count : 0, sizeof *lights);
    shd_packed_material *materials = shd_arena_alloc(arena, material_count, sizeof *materials);
    const shd_packed_energy *const *energies = pack_energies(plan, arena);
    const shd_westin_colored *westin = color_tables(plan, arena);
    const shd_packed_mix *const *mixes;
    if (!lighting || !exact || !wide || !lights || !materials || !energies || !westin ||
        !pack_mixes(plan, arena, &mixes))
        return NULL;
    for (size_t j = 0; fast && j < light_count; j++) {
        lights[j] = shd_pack_light(plan, &plan->lights[j]);
        if (wide[j].sheet_count) lights[j].kind = SHD_KIND_WIDE; /* f64 knows the side */
    }
    for (size_t m = 0; m < material_count; m++) {
        const shd_plan_material *from = &plan->materials[m];
        shd_packed_lobe *lobes = shd_arena_alloc(arena, from->lobe_count, sizeof *lobes);
        if (!lobes) return NULL;
        materials[m] = (shd_packed_material){.lobes = lobes, .sums = sums32[plan->isa]};
        for (size_t k = 0; k < from->lobe_count; k++) {
            lobes[k] = shd_pack_lobe(plan, from->lobes[k].shininess);
            if (shd_is_sheer(from->lobes[k].shininess)) materials[m].sums = sums64[plan->isa];
        }
        if (!plan->models32 || from->model == SHD_MODEL_PHONG) continue;
        materials[m].sums = models32[plan->isa];
        materials[m].model = shd_pack_model32(plan, from, energies[m], arena);
        if (!materials[m].model) return NULL;
    }
    *lighting = (shd_lighting){.plan = plan,
                               .sums64 = sums64[plan->isa],
                               .lights = lights,
                               .quick = find_quick(plan->bunches ? light_count : 0, lights),
                               .wide = wide,
                               .exact = exact,
                               .materials = materials,
                               .shadows = shadows,
                               .brdf64 = brdf64[plan->isa],
                               .energies = energies,
                               .westin = plan->westin ? westin : NULL,
                               .mixes = mixes};
    if (plan->sketched && !shd_sketch_prepare(lighting, arena)) return NULL;
    return shd_find_lamps(lighting, arena) ? lighting : NULL;
}

static shd_vec3 lane_of(const float *const v[3], size_t i) {
    return (shd_vec3){(double)v[0][i], (double)v[1][i], (double)v[2][i]};
}

static shd_vec3 lane64_of(const double *const v[3], size_t i) {
    return (shd_vec3){v[0][i], v[1][i], v[2][i]};
}

void shd_add_reference(const shd_sums_job *job, uint32_t index, size_t point, double *row) {
    const shd_plan *plan = job->lighting->plan;
    const shd_wide_light *from = &(job->narrow ? job->lighting->wide : job->lighting->exact)[index];
    shd_vec3 at, scaled, normal, mirror; /* `scaled`: as `from` has it */
    if (job->narrow) {
        scaled = lane_of(job->narrow->position, point);
        if (job->narrow->low[0]) scaled = shd_add(scaled, lane_of(job->narrow->low, point));
        at = shd_madd(plan->origin, scaled, 1 / plan->scale);
        normal = lane_of(job->narrow->normal, point);
        mirror = lane_of(job->narrow->mirror, point);
    } else {
        at = lane64_of(job->points->position, point);
        scaled = shd_scale(at, plan->scale);
        normal = lane64_of(job->points->normal, point);
        const shd_vec3 view = lane64_of(job->points->view, point);
        mirror = shd_sub(shd_scale(normal, 2 * shd_dot(normal, view)), view);
    }
    if (shd_is_behind_face(from, scaled, normal)) return;
    const shd_plan_light *light = &plan->lights[index];
    double factor, off;
    const double weight = shd_weigh_light(light, at, normal, mirror, &factor, &off);
    for (int c = 0; c < 3; c++) row[c] += weight * light->color[c];
    for (size_t k = 0; k < job->lobe_count; k++) {
        const double shininess = job->material->lobes[job->first_lobe + k].shininess;
        const double lobe = shd_weigh_lobe(shininess, factor, off);
        for (size_t c = 0; c < 3; c++) row[3 + 3 * k + c] += lobe * light->color[c];
    }
}

void shd_light_sums64(const shd_lighting *lighting, const shd_plan_material *material,
                      const uint32_t *which, size_t n, const shd_points64 *points,
                      double *const diffuse[3], double *const *specular) {
    if (!lighting->plan->extended)
        shd_open_sums(lighting, material, which, n, points, diffuse, specular);
    else if (!shd_has_kernel(lighting, material))
        shd_extended_sums(lighting, material, which, n, points, diffuse, specular);
    else if (lighting->shadows)
        shd_shadowed_sums(lighting, material, which, n, points, diffuse, specular);
    else
        shd_open_sums(lighting, material, which, n, points, diffuse, specular);
}

void shd_light_again(const shd_lighting *lighting, const shd_plan_material *material,
                     const uint32_t *which, size_t n, const shd_points64 *points,
                     const uint32_t *at, float *const diffuse[3], float *const *specular) {
    enum { MOST_ROWS = 3 + 3 * (1 + SHD_LOBES_MOST) };
    double sums[MOST_ROWS][SHD_LANES], *rows[MOST_ROWS];
    const size_t channels = lighting->plan->grey_lights ? 1 : 3;
    assert(points->count <= SHD_LANES && 3 + 3 * material->lobe_count <= MOST_ROWS);
    for (size_t k = 0; k < 3 + 3 * material->lobe_count; k++) rows[k] = sums[k];
    shd_light_sums64(lighting, material, which, n, points, rows, rows + 3);
    if (shd_is_cancelled(lighting->plan->cancelled)) return;
    for (size_t i = 0; i < points->count; i++)
        for (size_t c = 0; c < channels; c++) {
            if (diffuse) diffuse[c][at[i]] = (float)sums[c][i];
            for (size_t k = 0; k < material->lobe_count; k++)
                specular[3 * k + c][at[i]] = (float)sums[3 + 3 * k + c][i];
        }
}
