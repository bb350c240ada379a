/* f32 functions on vectors (base/simd.h). Polynomials are minimax, with coefficients rounded to
 * f32. tests/unit/shade_vectors.c measures their errors. */
#pragma once

#include "base/simd.h"
#include "shade/packed.h"

/* a b + c, fused, but in files that say SHD_LOOSE where there is no instruction for it. */
SHD_INLINE shd_vf shd_mad(shd_vf a, shd_vf b, shd_vf c) {
#if defined(SHD_LOOSE) && !SHD_FUSES
    return a * b + c;
#else
    return shd_vf_fma(a, b, c);
#endif
}

/* c[0] + x (c[1] + ... x c[n - 1]) */
SHD_INLINE shd_vf shd_polynomial(shd_vf x, const float *c, int n) {
    shd_vf sum = shd_vf_set(c[n - 1]);
#pragma GCC unroll 16
    for (int i = n - 2; i >= 0; i--) sum = shd_mad(sum, x, shd_vf_set(c[i]));
    return sum;
}

/* 2^t for t in [SHD_LEAST_LOG2, 0], to 1.8e-7 relative; 1 at 0 and never more. t = k + r, |r| <=
 * 1/2. */
SHD_INLINE shd_vf shd_exp2(shd_vf t) {
    static const float c[] = {1.0f,          0.6931469776f,   0.2402224209f,
                              0.0555073374f, 0.009671512633f, 0.001326472802f};
    const shd_vf magic = shd_vf_set(12582912.0f); /* 1.5 2^23: rounds to an integer */
    shd_vf shifted = t + magic;
    shd_vf power = shd_polynomial(t - (shifted - magic), c, 6);
    return (shd_vf)((shd_vu)power + ((shd_vu)shifted << 23));
}

/* log2(1 - d) for d in [0, 1 - 2^-24]. u = 1 - d = 2^k (1 + f) with 1 + f in [sqrt(1/2), sqrt(2)).
 * f comes from d and not from u: the rounding of u would cost the digits near d = 0. */
SHD_INLINE shd_vf shd_log2_1m(shd_vf d) {
    static const float c[] = {1.44269500489f,   -0.721347199237f, 0.480910279278f,
                              -0.360716269815f, 0.287939110109f,  -0.238675565748f,
                              0.215212027758f,  -0.208934470376f, 0.12926559262f};
    const shd_vf one = shd_vf_set(1);
    shd_vu above = (shd_vu)(one - d) - shd_vu_set(0x3f3504f3); /* sqrt(1/2) */
    shd_vi k23 = (shd_vi)above & shd_vi_set(-0x00800000);
    shd_vf scale = (shd_vf)(shd_vu_set(0x3f800000) - (shd_vu)k23); /* 2^-k */
    shd_vf f = shd_mad(-d, scale, scale - one);
    return shd_mad(shd_vf_from_vi(k23), shd_vf_set(0x1p-23f), f * shd_polynomial(f, c, 9));
}

/* (1 - d)^exponent for d in [0, 1 - 2^-24]. */
SHD_INLINE shd_vf shd_power_1m(shd_vf d, shd_vf exponent) {
    shd_vf t = shd_vf_max(shd_log2_1m(d) * exponent, shd_vf_set(SHD_LEAST_LOG2));
    return shd_exp2(t);
}
