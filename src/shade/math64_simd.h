/* f64 functions on vectors (base/simd.h), without fused products. Their errors are measured in
 * tests/unit/shade_vectors.c. */
#pragma once

#include "base/simd.h"

/* c[0] + x (c[1] + ... x c[n - 1]) */
SHD_INLINE shd_vd shd_polynomial64(shd_vd x, const double *c, int n) {
    shd_vd sum = shd_vd_set(c[n - 1]);
#pragma GCC unroll 16
    for (int i = n - 2; i >= 0; i--) sum = sum * x + shd_vd_set(c[i]);
    return sum;
}

/* exp(x) for x in [-700, 0]; 1 at 0 and never more. x = k log 2 + r, |r| <= log(2)/2, and e^r is
 * 1 + r + r^2/2 + r^3 times a minimax polynomial, off by 6e-18. */
SHD_INLINE shd_vd shd_exp64(shd_vd x) {
    static const double tail[] = {
        0x1.5555555555501p-3,  0x1.5555555553206p-5,  0x1.1111111128879p-7,
        0x1.6c16c17cc34bbp-10, 0x1.a01a011c23842p-13, 0x1.a019ab2cdd096p-16,
        0x1.71df553fcb12ap-19, 0x1.289f8b35256ddp-22, 0x1.ad201aa9111b4p-26};
    const shd_vd magic = shd_vd_set(0x1.8p52); /* rounds to an integer */
    shd_vd shifted = x * shd_vd_set(0x1.71547652b82fep0) + magic;
    shd_vd k = shifted - magic;
    /* log 2 in two parts; the first times k is exact */
    shd_vd r = x - k * shd_vd_set(0x1.62e42feep-1) - k * shd_vd_set(0x1.a39ef35793c76p-33);
    shd_vd r2 = r * r;
    shd_vd sum = shd_polynomial64(r, tail, 9) * (r2 * r);
    shd_vd power = shd_vd_set(1) + (r + (r2 * shd_vd_set(0.5) + sum));
    return (shd_vd)((shd_vul)power + ((shd_vul)shifted << 52));
}

/* log(1 - d) for d in [0, 1 - 2^-53]. 1 - d = 2^k (1 + f) with 1 + f in [sqrt(1/2), sqrt(2)); f
 * comes from d itself, so that nothing is lost near 0. log(1 + f) is that of FreeBSD's msun,
 * e_log.c, whose polynomial is off by 2^-58. */
SHD_INLINE shd_vd shd_log1m64(shd_vd d) {
    static const double odd[] = {0x1.5555555555593p-1, 0x1.999999997fa04p-2, 0x1.2492494229359p-2,
                                 0x1.c71c51d8e78afp-3, 0x1.7466496cb03dep-3, 0x1.39a09d078c69fp-3,
                                 0x1.2f112df3e5244p-3};
    const shd_vd one = shd_vd_set(1);
    /* k + 1024 from the exponent of (1 - d) / sqrt(1/2), and the double of it by way of 2^52 */
    const shd_vul half_root = (shd_vul)shd_vl_set(0x3fe6a09e667f3bcd);
    shd_vul biased = ((shd_vul)(one - d) - half_root + (shd_vul)shd_vl_set(1024LL << 52)) >> 52;
    shd_vd k =
        (shd_vd)(biased | (shd_vul)shd_vl_set(0x4330000000000000)) - shd_vd_set(0x1p52 + 1024);
    shd_vd scale = (shd_vd)((shd_vul)shd_vl_set((1024LL + 1023) << 52) - (biased << 52)); /* 2^-k */
    shd_vd f = (scale - one) - d * scale;
    shd_vd s = f / (shd_vd_set(2) + f), z = s * s;
    shd_vd half = f * f * shd_vd_set(0.5), tail = z * shd_polynomial64(z, odd, 7);
    shd_vd low = s * (half + tail) + k * shd_vd_set(0x1.a39ef35793c76p-33);
    return k * shd_vd_set(0x1.62e42feep-1) - ((half - low) - f);
}
