/* Integer samples: the one rule by which a value becomes a code, whatever stores it. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

/* Holds x in [0, max]. The constants are second, so that a NaN gives 0. */
static inline double shd_hold(double x, double max) {
    x = x > 0 ? x : 0;
    return x < max ? x : max;
}

/* The nearest code to x, which is scaled to codes already; ties go upward. In f64, an f32 times 255
 * or 65535 is exact to far below a tie. */
static inline int32_t shd_code(double x, double max) {
    return (int32_t)(shd_hold(x, max) + 0.5);
}

/* Whether x is so far beyond [0, max] that its nearest code would be, too. A NaN is not. */
static inline bool shd_is_clipped(double x, double max) {
    return x < -0.5 || x >= max + 0.5;
}
