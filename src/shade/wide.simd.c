/* Light sums in f64: the exact tier, and what f32 cannot hold of the other tiers. Compiled once for
 * each instruction set. tests/unit/shade_sums.c measures errors, tests/bench/kernels.c time. */
#include "base/cpu.h"
#include "shade/lights_simd.h"

/* Adds one light to sums[row] in the lanes `asked`. Rows are the channels of the diffuse sum, then
 * 3 + 3 lobe + channel. Returns the lanes that are left to the reference. Lanes on edges to within
 * f32's rounding are added to `edges`, unless that is NULL. */
SHD_INLINE unsigned add_light(const shd_wide_light *light, const points *at,
                              const shd_plan_lobe *lobes, size_t lobe_count, shd_md asked,
                              int channels, shd_vd *sums, unsigned *edges) {
    arrival by;
    const unsigned left = reach_points(light, at, asked, lobe_count ? edges : NULL, &by);
    if (!shd_md_any(by.lit)) return left;
    const shd_md lit = by.lit;
    const shd_vd factor = by.factor;
    shd_vd weight = shd_vd_mul_in(lit, factor, by.facing);
    for (int c = 0; c < channels; c++) sums[c] += weight * shd_vd_set(light->color[c]);

    const shd_vd away[3] = {-at->w[0], -at->w[1], -at->w[2]};
    shd_vd d = half_chords(by.toward, away), log = d; /* 1 - R.V */
    bool has_log = false;
    for (size_t k = 0; k < lobe_count; k++) {
        const double shininess = lobes[k].shininess;
        const double reach = shininess > SHD_EXACT_CUT ? SHD_EXACT_CUT / shininess : 1;
        if (edges && shd_is_sheer(shininess)) {
            const shd_vd shine = shd_vd_set(1) - d, size = shd_vd_max(shine, -shine);
            *edges |= shd_md_bits(shd_vd_gt_in(lit, shd_vd_set(SHD_CLIFF), size));
        }
        shd_md in = shd_vd_gt_in(lit, shd_vd_set(reach), d);
        if (!shd_md_any(in)) continue;
        if (!has_log) log = shd_log1m64(below_one(d));
        has_log = true;
        weight = shd_vd_mul_in(in, power_of(log, shininess), factor);
        for (size_t c = 0; c < (size_t)channels; c++)
            sums[3 + 3 * k + c] += weight * shd_vd_set(light->color[c]);
    }
    return left;
}

/* Computes one light, by the reference, in lanes that vectors cannot hold. */
__attribute__((noinline, cold)) static void add_left(const shd_sums_job *job, uint32_t index,
                                                     size_t first, unsigned left, shd_vd *sums) {
    if (shd_is_cancelled(job->lighting->plan->cancelled)) return;
    for (size_t i = 0; i < VW; i++) {
        if (!(left >> i & 1)) continue;
        double row[ROWS] = {0};
        shd_add_reference(job, index, first + i, row);
        for (size_t k = 0; k < 3 + 3 * job->lobe_count; k++) sums[k][i] += row[k];
    }
}

SHD_INLINE shd_vd widen_load(const float *from) {
    shd_vh half;
    memcpy(&half, from, sizeof half);
    return shd_vd_widen(half);
}

SHD_INLINE void load_narrow(const shd_points32 *from, size_t i, points *to) {
    to->split = from->low[0];
    for (int c = 0; c < 3; c++) {
        to->p[c] = widen_load(from->position[c] + i);
        if (from->low[0]) to->p[c] += widen_load(from->low[c] + i);
        to->n[c] = widen_load(from->normal[c] + i);
        to->w[c] = widen_load(from->mirror[c] + i);
    }
}

SHD_INLINE void sum_lights(const shd_sums_job *job, int channels, size_t lobe_count) {
    const shd_wide_light *lights = job->narrow ? job->lighting->wide : job->lighting->exact;
    const shd_plan_lobe *lobes = job->material->lobes + job->first_lobe;
    const double scale = job->lighting->plan->scale;
    const shd_md all = shd_md_not(shd_vd_gt(shd_vd_set(0), shd_vd_set(0)));
    for (size_t i = job->first; i < job->end; i += VW) {
        points at;
        if (job->narrow) {
            load_narrow(job->narrow, i, &at);
        } else if (__builtin_expect(job->count - i >= VW, 1)) {
            load_points(job->points, i, scale, &at);
        } else {
            points last; /* otherwise `at` would not be in registers */
            load_last(job->points, i, scale, &last);
            at = last;
        }
        shd_vd sums[ROWS];
        unsigned edges = 0;
        for (size_t k = 0; k < ROWS && k < 3 + 3 * lobe_count; k++) sums[k] = shd_vd_set(0);
        for (size_t k = 0; k < job->n; k++) {
            const uint32_t index = job->which[k];
            unsigned left = (1u << VW) - 1;
            if (__builtin_expect(lights[index].kind != SHD_KIND_WIDE, 1))
                left = add_light(&lights[index], &at, lobes, lobe_count, all, channels, sums,
                                 job->edges ? &edges : NULL);
            if (job->count - i < VW) left &= (1u << (job->count - i)) - 1;
            if (__builtin_expect(left, 0)) add_left(job, index, i, left, sums);
        }
        shd_mark_edges(job->edges, i, edges);
        for (size_t c = 0; c < (size_t)channels; c++) {
            store_sums(job, c, i, sums[c]);
            for (size_t k = 0; k < lobe_count; k++)
                store_sums(job, 3 + 3 * k + c, i, sums[3 + 3 * k + c]);
        }
    }
}

void SHD_VARIANT(shd_sums64)(const shd_sums_job *job) {
    const bool grey = job->lighting->plan->grey_lights;
    if (grey && job->lobe_count == 1)
        sum_lights(job, 1, 1);
    else if (job->lobe_count == 1)
        sum_lights(job, 3, 1);
    else
        sum_lights(job, grey ? 1 : 3, job->lobe_count);
}

void SHD_VARIANT(shd_add_wide)(const shd_sums_job *job, uint32_t index, size_t first,
                               unsigned lanes, float *rows) {
    const shd_wide_light *light = &job->lighting->wide[index];
    const shd_plan_lobe *lobes = job->material->lobes + job->first_lobe;
    const int channels = job->lighting->plan->grey_lights ? 1 : 3;
    for (size_t h = 0; h < 2; h++, lanes >>= VW) {
        points at;
        load_narrow(job->narrow, first + h * VW, &at);
        shd_vd sums[ROWS], lane;
        for (size_t k = 0; k < ROWS; k++) sums[k] = shd_vd_set(0);
        for (size_t i = 0; i < VW; i++) lane[i] = (double)(lanes >> i & 1);
        unsigned left = lanes & ((1u << VW) - 1), edges = 0;
        if (light->kind != SHD_KIND_WIDE)
            left = add_light(light, &at, lobes, job->lobe_count, shd_vd_gt(lane, shd_vd_set(0)),
                             channels, sums, &edges);
        shd_mark_edges(job->edges, first + h * VW, edges);
        if (left) add_left(job, index, first + h * VW, left, sums);
        for (size_t k = 0; k < ROWS; k++) {
            shd_vh half = shd_vh_narrow(sums[k]);
            memcpy(rows + k * SHD_W + h * VW, &half, sizeof half);
        }
    }
}
