/* Powers of cosines of one exponent: whole ones by products, others by the library. */
#pragma once

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

typedef struct shd_power {
    double exponent;
    uint32_t whole; /* the exponent if it is a whole number up to 2^24; else UINT32_MAX */
} shd_power;

static inline shd_power shd_power_make(double exponent) {
    const bool whole = exponent == floor(exponent) && exponent <= 1 << 24;
    return (shd_power){exponent, whole ? (uint32_t)exponent : UINT32_MAX};
}

/* x^exponent for x > 0, to a relative error of some 1e-15 times the exponent's digits. */
static inline double shd_power_of(const shd_power *p, double x) {
    if (p->whole == UINT32_MAX) return pow(x, p->exponent);
    double out = 1;
    for (uint32_t n = p->whole; n; n >>= 1) {
        if (n & 1) out *= x;
        x *= x;
    }
    return out;
}
