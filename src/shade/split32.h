/* f64 as two f32, in loops that vectorize. */
#pragma once

/* x as the sum of two floats, to 2^-48 (T. J. Dekker, "A floating-point technique for extending the
 * available precision", 1971, section 5). It is not x - (float)x: GCC 12 at -O3 takes
 * (double)(float)x for x if it vectorizes straight-line code, and `low` would then be 0. */
static inline void shd_split32(double x, float *high, float *low) {
    double t = x * 536870913.0; /* 2^29 + 1 */
    double h = t - (t - x);     /* x rounded to 24 bits */
    *high = (float)h;
    *low = (float)(x - h);
}
