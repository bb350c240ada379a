/* f32 functions on vectors (base/simd.h) without fused products, which are the same bits, and as
 * fast, where no instruction fuses them. Their errors are those of math_simd.h, about. Only for
 * *.simd.c of shade/. */
#pragma once

#include "base/simd.h"
#include "plan/tier.h"

SHD_INLINE shd_vf dot_lanes(const shd_vf a[3], const shd_vf b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

SHD_INLINE shd_vf smaller_of(shd_vf a, shd_vf b) {
    return shd_vf_select(shd_vf_gt(a, b), b, a);
}

SHD_INLINE shd_vf polynomial(shd_vf x, const float *c, int n) {
    shd_vf sum = shd_vf_set(c[n - 1]);
#pragma GCC unroll 16
    for (int i = n - 2; i >= 0; i--) sum = sum * x + shd_vf_set(c[i]);
    return sum;
}

/* 2^t, of t up to 0; from 2^-125 on all are as small as that. As shd_exp2. */
SHD_INLINE shd_vf power_of_two(shd_vf t) {
    static const float c[] = {1.0f,          0.6931469776f,   0.2402224209f,
                              0.0555073374f, 0.009671512633f, 0.001326472802f};
    const shd_vf magic = shd_vf_set(12582912.0f), /* 1.5 2^23: rounds to an integer */
        some = shd_vf_max(t, shd_vf_set((float)SHD_LEAST_LOG2)), shifted = some + magic;
    const shd_vf power = polynomial(some - (shifted - magic), c, 6);
    return (shd_vf)((shd_vu)power + ((shd_vu)shifted << 23));
}

/* log2(1 - d). As shd_log2_1m. */
SHD_INLINE shd_vf log_below(shd_vf d) {
    static const float c[] = {1.44269500489f,   -0.721347199237f, 0.480910279278f,
                              -0.360716269815f, 0.287939110109f,  -0.238675565748f,
                              0.215212027758f,  -0.208934470376f, 0.12926559262f};
    const shd_vf one = shd_vf_set(1), some = smaller_of(d, shd_vf_set(0x1.fffffep-1f));
    const shd_vu above = (shd_vu)(one - some) - shd_vu_set(0x3f3504f3); /* sqrt(1/2) */
    const shd_vi k23 = (shd_vi)above & shd_vi_set(-0x00800000);
    const shd_vf scale = (shd_vf)(shd_vu_set(0x3f800000) - (shd_vu)k23), /* 2^-k */
        f = (scale - one) - some * scale;
    return shd_vf_from_vi(k23) * shd_vf_set(0x1p-23f) + f * polynomial(f, c, 9);
}
