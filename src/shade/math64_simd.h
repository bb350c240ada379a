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

/* e^r - 1 and k of exp(x) = 2^k e^r, |r| <= log(2)/2, x in [-700, 0]: r + r^2/2 + r^3 times a
 * minimax polynomial, off by 6e-18. k comes shifted to a double's last bits. */
SHD_INLINE shd_vd shd_split_exp64(shd_vd x, shd_vd *shifted) {
    static const double tail[] = {
        0x1.5555555555501p-3,  0x1.5555555553206p-5,  0x1.1111111128879p-7,
        0x1.6c16c17cc34bbp-10, 0x1.a01a011c23842p-13, 0x1.a019ab2cdd096p-16,
        0x1.71df553fcb12ap-19, 0x1.289f8b35256ddp-22, 0x1.ad201aa9111b4p-26};
    const shd_vd magic = shd_vd_set(0x1.8p52); /* rounds to an integer */
    *shifted = x * shd_vd_set(0x1.71547652b82fep0) + magic;
    shd_vd k = *shifted - magic;
    /* log 2 in two parts; the first times k is exact */
    shd_vd r = x - k * shd_vd_set(0x1.62e42feep-1) - k * shd_vd_set(0x1.a39ef35793c76p-33);
    shd_vd r2 = r * r;
    shd_vd sum = shd_polynomial64(r, tail, 9) * (r2 * r);
    return r + (r2 * shd_vd_set(0.5) + sum);
}

/* exp(x) for x in [-700, 0]; 1 at 0 and never more. */
SHD_INLINE shd_vd shd_exp64(shd_vd x) {
    shd_vd shifted, power = shd_vd_set(1) + shd_split_exp64(x, &shifted);
    return (shd_vd)((shd_vul)power + ((shd_vul)shifted << 52));
}

/* 1 - exp(x) for x in [-700, 0], whose digits are all its own: 1 - 2^k - 2^k (e^r - 1). */
SHD_INLINE shd_vd shd_fall64(shd_vd x) {
    const shd_vd one = shd_vd_set(1);
    shd_vd shifted, rest = shd_split_exp64(x, &shifted);
    const shd_vd scale = (shd_vd)((shd_vul)one + ((shd_vul)shifted << 52));
    return (one - scale) - scale * rest;
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

/* The angle of (x, y), in [-pi, pi]; 0 where both are 0. atan is that of the Cephes library
 * (S. Moshier, Methods and Programs for Mathematical Functions, 1989), x + x^3 P(x^2) / Q(x^2) up
 * to 0.66, which is off by 2e-16. */
SHD_INLINE shd_vd shd_atan2_64(shd_vd y, shd_vd x) {
    static const double p[] = {-64.85021904942025, -122.88666844901361, -75.00855792314705,
                               -16.157537187333652, -0.8750608600031904},
                        q[] = {194.5506571482614,  485.3903996359137,  432.88106049129027,
                               165.02700983169885, 24.858464901423062, 1};
    const shd_vd zero = shd_vd_set(0), ax = shd_vd_max(x, -x), ay = shd_vd_max(y, -y);
    const shd_md steep = shd_vd_gt(ay, ax);
    const shd_vd large = shd_vd_select(steep, ay, ax), small = shd_vd_select(steep, ax, ay);
    const shd_md past = shd_vd_gt(small, large * shd_vd_set(0.66)); /* of pi / 4 */
    const shd_vd over = shd_vd_select(past, small - large, small),
                 under =
                     shd_vd_max(shd_vd_select(past, small + large, large), shd_vd_set(0x1p-1000));
    const shd_vd t = over / under, z = t * t,
                 rest = z * shd_polynomial64(z, p, 5) / shd_polynomial64(z, q, 6);
    shd_vd angle = shd_vd_select(past, shd_vd_set(0x1.921fb54442d18p-1), zero) + (t + t * rest);
    angle = shd_vd_select(steep, shd_vd_set(0x1.921fb54442d18p0) - angle, angle);
    angle = shd_vd_select(shd_vd_gt(zero, x), shd_vd_set(0x1.921fb54442d18p1) - angle, angle);
    return shd_vd_select(shd_vd_gt(zero, y), -angle, angle);
}

/* The sine and cosine of x in [-1000, 1000], by the polynomials of FreeBSD's msun, k_sin.c and
 * k_cos.c, up to pi/4. */
SHD_INLINE void shd_sincos64(shd_vd x, shd_vd *sine, shd_vd *cosine) {
    static const double odd[] = {-1.66666666666666324348e-01, 8.33333333332248946124e-03,
                                 -1.98412698298579493134e-04, 2.75573137070700676789e-06,
                                 -2.50507602534068634195e-08, 1.58969099521155010221e-10},
                        even[] = {4.16666666666666019037e-02, -1.38888888888741095749e-03,
                                  2.48015872894767294178e-05, -2.75573143513906633035e-07,
                                  2.08757232129817482790e-09, -1.13596475577881948265e-11};
    const shd_vd magic = shd_vd_set(0x1.8p52); /* rounds to an integer */
    const shd_vd shifted = x * shd_vd_set(0x1.45f306dc9c883p-1) + magic, k = shifted - magic;
    /* pi/2 in two parts; the first times k is exact */
    const shd_vd r = x - k * shd_vd_set(0x1.921fb544p0) - k * shd_vd_set(0x1.0b4611a626331p-34);
    const shd_vd z = r * r, s = r + r * z * shd_polynomial64(z, odd, 6),
                 c = shd_vd_set(1) - (z * shd_vd_set(0.5) - z * z * shd_polynomial64(z, even, 6));
    const shd_vul turns = (shd_vul)shifted, one = (shd_vul)shd_vl_set(1);
    const shd_md odds = shd_vd_gt((shd_vd)((turns & one) << 62), shd_vd_set(1)); /* 2 or 0 */
    const shd_vul down = (turns & (one << 1)) << 62, back = ((turns + one) & (one << 1)) << 62;
    *sine = (shd_vd)((shd_vul)shd_vd_select(odds, c, s) ^ down);
    *cosine = (shd_vd)((shd_vul)shd_vd_select(odds, s, c) ^ back);
}
