/* Light sums in f32 of many lamps: points of a plan that leaves something out, to which their error
 * is added (shd_quick_off). As fast.simd.c, but for sums that stay in f32 longer, and powers that
 * are products. Compiled once for each instruction set; those that fuse give the same bits.
 * tests/unit/shade_quick.c measures errors. */
#define SHD_LOOSE /* where nothing fuses, products are rounded */
#include <float.h>

#include "base/cpu.h"
#include "shade/fast_simd.h"
#include "shade/quick.h"

/* Lights at once, so that a power's digits are looked at once for all of them, and lights that are
 * summed in f32. */
enum { AT_ONCE = 4, BALL = SHD_QUICK_BALL, GROUP = 8 * AT_ONCE, ROWS = SHD_WIDE_ROWS };

typedef struct points {
    shd_vf p[3], n[3], w[3];
} points;

/* By channel: diffuse light, and the lobe. */
typedef struct sums {
    shd_vf diffuse[3], specular[3];
} sums;

typedef struct totals {
    shd_vd diffuse[3][2], specular[3][2];
} totals;

/* What lights at once do at a vector of points. */
typedef struct arrivals {
    shd_vf fall[AT_ONCE]; /* the attenuation; 0 where it is not lit */
    shd_vf weight[AT_ONCE], lobe[AT_ONCE];
} arrivals;

/* Adds one light in f64, for the lanes `wide`. */
__attribute__((noinline, cold)) static sums add_wide(const shd_sums_job *job, uint32_t index,
                                                     size_t first, unsigned wide, sums s) {
    _Alignas(64) float rows[ROWS][SHD_W];
    SHD_VARIANT(shd_add_wide)(job, index, first, wide, rows[0]);
    const int channels = job->lighting->plan->grey_lights ? 1 : 3;
    for (int c = 0; c < channels; c++) {
        s.diffuse[c] += shd_vf_load(rows[c]);
        if (job->lobe_count) s.specular[c] += shd_vf_load(rows[3 + c]);
    }
    return s;
}

/* Points that are too near to the light or too far away for f32. */
SHD_INLINE shd_mf find_wide(const shd_packed_light *light, shd_vf d2) {
    return shd_vu_ge((shd_vu)d2 - shd_vu_set(light->nearest), shd_vu_set(light->span));
}

/* Points whose N.L is as near to 0 as f32's rounding: see fast.simd.c. */
SHD_INLINE shd_mf find_ends(shd_vf d2, shd_vf facing) {
    const double most = SHD_FUSES ? SHD_TURNED : 2 * SHD_TURNED, turned = most * most;
    const shd_vf off2 = shd_mad(d2, shd_vf_set((float)turned), shd_vf_set((float)turned));
    return shd_vf_gt(off2, facing * facing);
}

SHD_INLINE void find_path(const shd_packed_light *light, const points *at, shd_vf path[3]) {
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) path[c] = shd_vf_set(light->at[c]) - at->p[c];
}

/* Looks again for what is rare, and marks it, or adds it and leaves it out of `a`. */
__attribute__((noinline, cold)) static sums look_again(const shd_sums_job *job,
                                                       const uint32_t *which, int count,
                                                       const points *at, size_t first, arrivals *a,
                                                       sums s) {
    for (int k = 0; k < count; k++) {
        const shd_packed_light *light = &job->lighting->lights[which[k]];
        shd_vf path[3];
        find_path(light, at, path);
        const shd_vf facing = dot_lanes(at->n, path), d2 = dot_lanes(path, path),
                     zero = shd_vf_set(0);
        if (job->lobe_count)
            shd_mark_edges(
                job->edges, first,
                shd_mf_bits(shd_vf_gt_in(find_ends(d2, facing), dot_lanes(at->w, path), zero)));
        const shd_mf wide = find_wide(light, d2);
        if (!shd_mf_any(wide)) continue;
        s = add_wide(job, which[k], first, shd_mf_bits(wide), s);
        a->fall[k] = shd_vf_select(wide, zero, a->fall[k]);
        a->weight[k] = shd_vf_select(wide, zero, a->weight[k]);
        if (job->lobe_count) a->lobe[k] = shd_vf_select(wide, zero, a->lobe[k]);
    }
    return s;
}

/* Raises cosines to a power of one digit or more in place. */
SHD_INLINE void raise(shd_vf *cosines, int count, unsigned power) {
    shd_vf base[AT_ONCE];
    for (int k = 0; k < count; k++) base[k] = cosines[k];
    for (unsigned digit = 1u << (31 - __builtin_clz(power)) >> 1; digit; digit >>= 1) {
#pragma GCC unroll 4
        for (int k = 0; k < count; k++) cosines[k] *= cosines[k];
        if (!(power & digit)) continue;
#pragma GCC unroll 4
        for (int k = 0; k < count; k++) cosines[k] *= base[k];
    }
}

/* Whether all points clearly face away from all lights in a ball, so that none of them adds
 * anything or is near to N.L = 0, however f32 rounds: within 8 times of what that is. */
SHD_INLINE bool is_behind(const float ball[4], const points *at) {
    const double off = 8 * SHD_TURNED;
    const shd_vf radius = shd_vf_set(ball[3]), square = shd_vf_set((float)(off * off));
    shd_vf path[3];
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) path[c] = shd_vf_set(ball[c]) - at->p[c];
    const shd_vf most = dot_lanes(at->n, path) + radius, d2 = dot_lanes(path, path),
                 reach2 = shd_mad(d2 + radius * radius, square, square);
    const shd_mf behind = shd_vf_gt_in(shd_vf_gt(shd_vf_set(0), most), most * most, reach2);
    return !shd_mf_any(shd_mf_not(behind));
}

/* `count`, `channels` and `lobed` are constants. */
SHD_INLINE void add_lights(const shd_sums_job *job, const uint32_t *which, int count,
                           const points *at, size_t first, int channels, bool lobed, sums *s) {
    const shd_packed_light *lights = job->lighting->lights, *all = &job->lighting->quick;
    const shd_vf zero = shd_vf_set(0), one = shd_vf_set(1);
    arrivals a;
    shd_vf least = shd_vf_set(FLT_MAX), most = zero;
    shd_mf ends = shd_vf_gt(zero, one);
#pragma GCC unroll 4
    for (int k = 0; k < count; k++) {
        shd_vf path[3], r;
        find_path(&lights[which[k]], at, path);
        const shd_vf facing = dot_lanes(at->n, path), d2 = dot_lanes(path, path);
        least = shd_vf_select(shd_vf_gt(least, d2), d2, least);
        most = shd_vf_max(most, d2);
        if (lobed) ends = shd_mf_or(ends, find_ends(d2, facing));
        weigh_distance(all, SHD_KIND_ATTENUATED, d2, &r, &a.fall[k]);
        a.fall[k] = shd_vf_mul_in(shd_vf_gt(facing, zero), a.fall[k], one);
        a.weight[k] = facing * (a.fall[k] * r);
        if (lobed) a.lobe[k] = shd_vf_max(dot_lanes(at->w, path) * r, zero);
    }
    ends = shd_mf_or(ends, shd_mf_or(find_wide(all, least), find_wide(all, most)));
    if (__builtin_expect(shd_mf_any(ends), 0))
        *s = look_again(job, which, count, at, first, &a, *s);
    if (lobed) raise(a.lobe, count, (unsigned)job->lobes->shininess);
#pragma GCC unroll 4
    for (int k = 0; k < count; k++) {
        add_colored(s->diffuse, a.weight[k], lights[which[k]].color, channels);
        if (lobed)
            add_colored(s->specular, a.fall[k] * a.lobe[k], lights[which[k]].color, channels);
    }
}

SHD_INLINE void end_group(int channels, bool lobed, sums *s, totals *t) {
#pragma GCC unroll 3
    for (int c = 0; c < channels; c++) {
        add_row(&s->diffuse[c], t->diffuse[c]);
        if (lobed) add_row(&s->specular[c], t->specular[c]);
    }
}

SHD_INLINE void add_total(const shd_vd total[2], float *out) {
    const shd_vf before = shd_vf_load(out);
    shd_vf_store(out, shd_vf_join(shd_vh_narrow(total[0] + shd_vd_widen(shd_vf_half(before, 0))),
                                  shd_vh_narrow(total[1] + shd_vd_widen(shd_vf_half(before, 1)))));
}

SHD_INLINE void sum_lights(const shd_sums_job *job, int channels, bool lobed) {
    for (size_t i = job->first; i < job->end; i += SHD_W) {
        points at;
        sums s;
        totals t;
#pragma GCC unroll 3
        for (int c = 0; c < 3; c++) {
            at.p[c] = shd_vf_load(job->narrow->position[c] + i);
            at.n[c] = shd_vf_load(job->narrow->normal[c] + i);
            at.w[c] = shd_vf_load(job->narrow->mirror[c] + i);
            s.diffuse[c] = s.specular[c] = shd_vf_set(0);
            for (int h = 0; h < 2; h++) t.diffuse[c][h] = t.specular[c][h] = shd_vd_set(0);
        }
        size_t k = 0;
        for (; k + AT_ONCE <= job->n; k += AT_ONCE) {
            if (job->balls && k % BALL == 0 && k + BALL <= job->n &&
                is_behind(job->balls[k / BALL], &at))
                k += BALL - AT_ONCE;
            else
                add_lights(job, job->which + k, AT_ONCE, &at, i, channels, lobed, &s);
            if (k / AT_ONCE % (GROUP / AT_ONCE) == GROUP / AT_ONCE - 1)
                end_group(channels, lobed, &s, &t);
        }
        for (; k < job->n; k++) add_lights(job, job->which + k, 1, &at, i, channels, lobed, &s);
        end_group(channels, lobed, &s, &t);
        for (int c = 0; c < channels; c++) {
            add_total(t.diffuse[c], job->diffuse[c] + i);
            if (lobed) add_total(t.specular[c], job->specular[c] + i);
        }
    }
}

void SHD_VARIANT(shd_quick32)(const shd_sums_job *job) {
    const bool grey = job->lighting->plan->grey_lights;
    if (job->lobe_count)
        grey ? sum_lights(job, 1, true) : sum_lights(job, 3, true);
    else
        grey ? sum_lights(job, 1, false) : sum_lights(job, 3, false);
}
