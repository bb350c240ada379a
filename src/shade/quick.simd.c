/* Light sums in f32 of many lamps: points of a plan that leaves something out, to which their error
 * is added (shd_quick_off). As fast.simd.c, but for sums that stay in f32 longer, and powers that
 * are products. Compiled once for each instruction set; those that fuse give the same bits.
 * tests/unit/shade_quick.c measures errors. */
#define SHD_LOOSE /* where nothing fuses, products are rounded */
#include <float.h>
#include <math.h>

#include "base/cpu.h"
#include "shade/fast_simd.h"
#include "shade/quick.h"

/* Lights at once, so that a power's digits are looked at once for all of them, and lights that are
 * summed in f32. */
enum { AT_ONCE = 4, BALL = SHD_QUICK_BALL, GROUP = 8 * AT_ONCE, ROWS = SHD_WIDE_ROWS };

/* Normals and mirrored views are turned around, as paths lead from lights: what is subtracted from
 * points needs no register. */
typedef struct points {
    shd_vf p[3], n[3], w[3];
} points;

/* What is summed, which is constant. */
typedef struct shape {
    int channels;
    bool lobed, square; /* light falls off as the square alone */
} shape;

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
    shd_vf cosine[AT_ONCE], lobe[AT_ONCE];
} arrivals;

/* What is the same for all lights and points. */
typedef struct setting {
    shd_vf limit; /* the most that light falls off as a square */
    shd_vf dim;   /* a cosine whose power is less is nothing */
    unsigned power;
} setting;

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

SHD_INLINE void find_path(const shd_packed_lamp *light, const points *at, shd_vf path[3]) {
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) path[c] = at->p[c] - shd_vf_set(light->at[c]);
}

SHD_INLINE shd_vf find_size(shd_vf x) {
    return (shd_vf)((shd_vu)x & shd_vu_set(0x7fffffff));
}

/* The attenuation at a distance whose square is d2, 0 out of `lit`. Without constants but that of
 * the square, which is 1 then, `r` 1 / d tells it. */
SHD_INLINE shd_vf find_fall(const shd_packed_light *light, bool square, shd_mf lit, shd_vf d2,
                            shd_vf r, shd_vf limit) {
    if (square) return shd_vf_min(shd_vf_mul_in(lit, r, r), limit);
    const shd_vf d = shd_vf_max(d2 * r, shd_vf_set(light->least)),
                 slope = shd_mad(d, shd_vf_set(light->c), shd_vf_set(light->b)),
                 fall = shd_vf_set(1) / shd_mad(d, slope, shd_vf_set(light->a));
    return shd_vf_mul_in(lit, fall, shd_vf_set(1));
}

/* Looks again for what is rare, and marks it, or adds it and leaves it out of `a`. */
__attribute__((noinline, cold)) static sums look_again(const shd_sums_job *job,
                                                       const uint32_t *which, int count,
                                                       const points *at, size_t first, arrivals *a,
                                                       sums s) {
    for (int k = 0; k < count; k++) {
        const shd_packed_light *light = &job->lighting->lights[which[k]];
        shd_vf path[3];
        find_path(&job->lighting->lamps.packed[which[k]], at, path);
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
        a->cosine[k] = shd_vf_select(wide, zero, a->cosine[k]);
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
    for (int c = 0; c < 3; c++) path[c] = at->p[c] - shd_vf_set(ball[c]);
    const shd_vf most = dot_lanes(at->n, path) + radius, d2 = dot_lanes(path, path),
                 reach2 = shd_mad(d2 + radius * radius, square, square);
    const shd_mf behind = shd_vf_gt_in(shd_vf_gt(shd_vf_set(0), most), most * most, reach2);
    return !shd_mf_any(shd_mf_not(behind));
}

/* Whether a point may be as near to N.L = 0 as f32's rounding, or not in reach, of lights whose
 * N.L are no nearer to it than `cosine`, and whose squared distances are within two others. */
SHD_INLINE bool is_rare(const shd_packed_light *all, bool lobed, shd_vf cosine, shd_vf least,
                        shd_vf most) {
    const double off = SHD_FUSES ? SHD_TURNED : 2 * SHD_TURNED;
    const shd_vf turned = shd_vf_set((float)(off * off * (1 + 0x1p-16)));
    shd_mf rare = shd_mf_or(find_wide(all, least), find_wide(all, most));
    if (lobed)
        rare = shd_mf_or(rare, shd_vf_gt(shd_mad(least, turned, turned), cosine * cosine * least));
    return shd_mf_any(rare);
}

/* `count` and `is` are constants. */
SHD_INLINE void add_lights(const shd_sums_job *job, const uint32_t *which, int count,
                           const points *at, size_t first, shape is, const setting *with, sums *s) {
    const shd_packed_lamp *lights = job->lighting->lamps.packed;
    const shd_packed_light *all = &job->lighting->quick;
    const shd_vf zero = shd_vf_set(0), one = shd_vf_set(1);
    arrivals a;
    shd_vf least = shd_vf_set(FLT_MAX), most = zero, nearest = one;
    shd_mf shine = shd_vf_gt(zero, one);
#pragma GCC unroll 4
    for (int k = 0; k < count; k++) {
        shd_vf path[3];
        find_path(&lights[which[k]], at, path);
        const shd_vf d2 = dot_lanes(path, path), r = one / shd_vf_sqrt(d2);
        a.cosine[k] = dot_lanes(at->n, path) * r;
        least = shd_vf_min(least, d2);
        most = shd_vf_max(most, d2);
        const shd_mf lit = shd_vf_gt(a.cosine[k], zero);
        a.fall[k] = find_fall(all, is.square, lit, d2, r, with->limit);
        if (!is.lobed) continue;
        nearest = shd_vf_min(nearest, find_size(a.cosine[k]));
        a.lobe[k] = dot_lanes(at->w, path) * r;
        const shd_mf bright = shd_vf_gt_in(lit, a.lobe[k], with->dim);
        a.lobe[k] = shd_vf_select(bright, a.lobe[k], zero);
        shine = shd_mf_or(shine, bright);
    }
    if (__builtin_expect(is_rare(all, is.lobed, nearest, least, most), 0))
        *s = look_again(job, which, count, at, first, &a, *s);
    const bool shines = is.lobed && shd_mf_any(shine);
    if (shines) raise(a.lobe, count, with->power);
#pragma GCC unroll 4
    for (int k = 0; k < count; k++)
#pragma GCC unroll 3
        for (int c = 0; c < is.channels; c++) {
            const shd_vf sent = a.fall[k] * shd_vf_set(lights[which[k]].color[c]);
            s->diffuse[c] = shd_mad(a.cosine[k], sent, s->diffuse[c]);
            if (shines) s->specular[c] = shd_mad(a.lobe[k], sent, s->specular[c]);
        }
}

SHD_INLINE void end_group(shape is, sums *s, totals *t) {
#pragma GCC unroll 3
    for (int c = 0; c < is.channels; c++) {
        add_row(&s->diffuse[c], t->diffuse[c]);
        if (is.lobed) add_row(&s->specular[c], t->specular[c]);
    }
}

SHD_INLINE void add_total(const shd_vd total[2], float *out) {
    const shd_vf before = shd_vf_load(out);
    shd_vf_store(out, shd_vf_join(shd_vh_narrow(total[0] + shd_vd_widen(shd_vf_half(before, 0))),
                                  shd_vh_narrow(total[1] + shd_vd_widen(shd_vf_half(before, 1)))));
}

SHD_INLINE void sum_lights(const shd_sums_job *job, shape is) {
    const float nearest = job->lighting->quick.least;
    setting with = {.limit = shd_vf_set(1 / (nearest * nearest)), .dim = shd_vf_set(0)};
    if (is.lobed) {
        with.power = (unsigned)job->lobes->shininess;
        with.dim = shd_vf_set((float)exp2(SHD_QUICK_DIM / with.power));
    }
    for (size_t i = job->first; i < job->end; i += SHD_W) {
        points at;
        sums s;
        totals t;
#pragma GCC unroll 3
        for (int c = 0; c < 3; c++) {
            at.p[c] = shd_vf_load(job->narrow->position[c] + i);
            at.n[c] = -shd_vf_load(job->narrow->normal[c] + i);
            at.w[c] = -shd_vf_load(job->narrow->mirror[c] + i);
            s.diffuse[c] = s.specular[c] = shd_vf_set(0);
            for (int h = 0; h < 2; h++) t.diffuse[c][h] = t.specular[c][h] = shd_vd_set(0);
        }
        size_t k = 0;
        for (; k + AT_ONCE <= job->n; k += AT_ONCE) {
            if (job->balls && k % BALL == 0 && k + BALL <= job->n &&
                is_behind(job->balls[k / BALL], &at))
                k += BALL - AT_ONCE;
            else
                add_lights(job, job->which + k, AT_ONCE, &at, i, is, &with, &s);
            if (k / AT_ONCE % (GROUP / AT_ONCE) == GROUP / AT_ONCE - 1) end_group(is, &s, &t);
        }
        for (; k < job->n; k++) add_lights(job, job->which + k, 1, &at, i, is, &with, &s);
        end_group(is, &s, &t);
        for (int c = 0; c < is.channels; c++) {
            add_total(t.diffuse[c], job->diffuse[c] + i);
            if (is.lobed) add_total(t.specular[c], job->specular[c] + i);
        }
    }
}

SHD_INLINE void sum_alike(const shd_sums_job *job, int channels, bool lobed) {
    const shd_packed_light *all = &job->lighting->quick;
    if (all->a == 0 && all->b == 0)
        sum_lights(job, (shape){channels, lobed, true});
    else
        sum_lights(job, (shape){channels, lobed, false});
}

void SHD_VARIANT(shd_quick32)(const shd_sums_job *job) {
    const bool grey = job->lighting->plan->grey_lights;
    if (job->lobe_count)
        grey ? sum_alike(job, 1, true) : sum_alike(job, 3, true);
    else
        grey ? sum_alike(job, 1, false) : sum_alike(job, 3, false);
}
