/* How lights reach points in f32, and how rows of sums are kept: what the kernels of the standard
 * tier share. Only for *.simd.c of shade/ that fuse products, or are SHD_LOOSE. */
#pragma once

#include "shade/math_simd.h"

SHD_INLINE shd_vf dot_lanes(const shd_vf a[3], const shd_vf b[3]) {
    return shd_mad(a[2], b[2], shd_mad(a[1], b[1], a[0] * b[0]));
}

SHD_INLINE void add_colored(shd_vf *sum, shd_vf weight, const float *color, int channels) {
#pragma GCC unroll 3
    for (int c = 0; c < channels; c++) sum[c] = shd_mad(weight, shd_vf_set(color[c]), sum[c]);
}

/* The factor of a spot: 0 outside of its cone, and those lanes leave `lit`. Lanes so close to a rim
 * without penumbra that f32 cannot tell its sides leave `lit` too, and are set in `rim`. */
SHD_INLINE shd_vf weigh_spot(const shd_packed_light *light, const shd_vf path[3], shd_vf r,
                             shd_mf *lit, shd_mf *rim) {
    shd_vf chord[3];
#pragma GCC unroll 3
    for (int c = 0; c < 3; c++) chord[c] = shd_mad(path[c], r, shd_vf_set(light->axis[c]));
    const shd_vf half = shd_vf_set(0.5f), inner = shd_vf_set(light->inner);
    shd_vf q = dot_lanes(chord, chord) * half; /* 1 - cos t */
    shd_vf within = shd_vf_set(light->outer) - q;
    *rim = shd_mf_and(*lit, shd_vf_gt(shd_vf_set(light->rim), shd_vf_max(within, -within)));
    *lit = shd_mf_and(*lit, shd_mf_not(shd_mf_or(*rim, shd_vf_gt(q, shd_vf_set(light->outer)))));
    if (!shd_mf_any(*lit)) return q;
    shd_vf fade = within * shd_vf_set(light->inverse_fade);
    shd_vf smooth = fade * fade * shd_mad(shd_vf_set(-2), fade, shd_vf_set(3));
    shd_vf factor = shd_vf_select(shd_vf_gt(q, inner), smooth, shd_vf_set(1));
    if (!(light->exponent > 0)) return factor;
    /* From 90 degrees on, cos t is at most 0, and so is its power. */
    const shd_vf largest = shd_vf_set(0x1.fffffep-1f);
    *lit = shd_vf_gt_in(*lit, shd_vf_set(1), q);
    q = shd_vf_select(shd_vf_gt(q, largest), largest, q);
    return factor * shd_power_1m(q, shd_vf_set(light->exponent));
}

/* 1/distance as r, and the attenuation as f. */
SHD_INLINE void weigh_distance(const shd_packed_light *light, shd_light_kind kind, shd_vf d2,
                               shd_vf *r, shd_vf *f) {
    const shd_vf distance = shd_vf_sqrt(d2);
    if (kind == SHD_KIND_POINT) {
        *r = shd_vf_set(1) / distance;
        return;
    }
    /* One division for two. */
    shd_vf d = shd_vf_max(distance, shd_vf_set(light->least));
    shd_vf slope = shd_mad(d, shd_vf_set(light->c), shd_vf_set(light->b));
    shd_vf fall = shd_mad(d, slope, shd_vf_set(light->a));
    shd_vf both = shd_vf_set(1) / (fall * distance);
    *r = both * fall;
    *f = both * distance;
}

SHD_INLINE void add_row(shd_vf *sum, shd_vd total[2]) {
    total[0] += shd_vd_widen(shd_vf_half(*sum, 0));
    total[1] += shd_vd_widen(shd_vf_half(*sum, 1));
    *sum = shd_vf_set(0);
}

SHD_INLINE void store_row(shd_vf sum, const shd_vd total[2], bool any, float *out) {
    if (any)
        sum = shd_vf_join(shd_vh_narrow(total[0] + shd_vd_widen(shd_vf_half(sum, 0))),
                          shd_vh_narrow(total[1] + shd_vd_widen(shd_vf_half(sum, 1))));
    shd_vf_store(out, sum);
}
