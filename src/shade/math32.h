/* f32 functions whose loops vectorize: no branch, no table, no library call. Their errors are
 * measured in tests/unit/shade_math32.c. */
#ifndef SHD_SHADE_MATH32_H
#define SHD_SHADE_MATH32_H

#include <stdint.h>
#include <string.h>

static inline int32_t shd_bits32(float x) {
    int32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline float shd_float32(int32_t bits) {
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* x as the sum of two floats, to 2^-48 (T. J. Dekker, "A floating-point technique for extending
 * the available precision", 1971, section 5). Not x - (float)x: GCC 12 at -O3 takes
 * (double)(float)x for x where it vectorizes straight-line code, and `low` would be 0. */
static inline void shd_split32(double x, float *high, float *low) {
    double t = x * 536870913.0; /* 2^29 + 1 */
    double h = t - (t - x);     /* x rounded to 24 bits */
    *high = (float)h;
    *low = (float)(x - h);
}

/* log(1 - d) for d in [0, 1 - 2^-24], to 1.7e-7 relative.
 * u = 1 - d is rounded, and what the rounding took is added back: near d = 0 that is the whole
 * precision. Then u = m 2^k with m in [sqrt(1/2), sqrt(2)) and log m = 2 atanh((m-1)/(m+1)). */
static inline float shd_log1m(float d) {
    float u = 1 - d;
    float lost = (1 - u) - d;
    int32_t bits = shd_bits32(u);
    int32_t k = (bits - 0x3f3504f3) >> 23; /* 0x3f3504f3: sqrt(1/2) */
    float m = shd_float32(bits - k * (1 << 23));
    float s = (m - 1) / (m + 1);
    float z = s * s;
    float tail = z * (0.6666666667f + z * (0.4f + z * (0.2857142857f + z * 0.2222222222f)));
    float e = (float)k;
    /* log 2 = 0.693359375 - 2.12194440e-4, the first exact in few bits */
    return e * 0.693359375f + ((s * tail + e * -2.12194440e-4f + lost) + 2 * s);
}

/* exp(x) for x <= 0, to 1.0e-7 relative; 0 below -87, where f32 would be denormal.
 * The polynomial is the Taylor series on [-log(2)/2, log(2)/2], whose next term is 5e-9. */
static inline float shd_exp32(float x) {
    float clamped = x < -87.0f ? -87.0f : x;
    float shifted = clamped * 1.44269504f + 12582912.0f; /* 1.5 * 2^23: rounds to an integer */
    float k = shifted - 12582912.0f;
    float r = clamped - k * 0.693359375f;
    r = r + k * 2.12194440e-4f;
    float tail =
        4.166666667e-2f + r * (8.333333333e-3f + r * (1.388888889e-3f + r * 1.984126984e-4f));
    float p = 1 + r * (1 + r * (0.5f + r * (1.666666667e-1f + r * tail)));
    float y = shd_float32(shd_bits32(p) + (shd_bits32(shifted) - 0x4b400000) * (1 << 23));
    return x < -87.0f ? 0 : y;
}

#endif
