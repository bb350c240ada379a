/* How derivatives of a potential follow from each other: what far.c and far.simd.c share. */
#pragma once

#include "base/simd.h"
#include "plan/bunches.h"

/* Each degree that patches have gets code of its own, with all of its loops laid out. Sanitizer
 * builds would take minutes to compile these: there one body counts as it goes. */
#if defined(SHD_ONE_BODY)
#define UNROLL(times)
#define BY_DEGREE(degree, call, ...) call(shd_far_degree(degree), __VA_ARGS__)
#else
#define PRAGMA(words) _Pragma(#words)
#define UNROLL(times) PRAGMA(GCC unroll times)
#define BY_DEGREE(degree, call, ...)                                                               \
    switch (shd_far_degree(degree)) {                                                              \
    case 6:                                                                                        \
        call(6, __VA_ARGS__);                                                                      \
        break;                                                                                     \
    case 4:                                                                                        \
        call(4, __VA_ARGS__);                                                                      \
        break;                                                                                     \
    default:                                                                                       \
        call(3, __VA_ARGS__);                                                                      \
    }
#endif

/* The least that is at least `degree` and has code of its own. */
static inline int shd_far_degree(int degree) {
    return degree > 4 ? 6 : degree > 3 ? 4 : 3;
}

/* Of the roots of 1 + u, and of their third powers. */
static const double shd_far_root[6] = {1, 0.5, -0.125, 0.0625, -0.0390625, 0.02734375},
                    shd_far_cube[6] = {1, 1.5, 0.375, -0.0625, 0.0234375, -0.01171875},
                    shd_far_factor[6] = {-1, -2, -8, -48, -384, -3840}; /* -2^k k! */

/* A derivative is -n[axis] times the one at `once`, plus `times` the one at `twice`. */
typedef struct shd_far_step {
    int axis, times;
    size_t once, twice;
} shd_far_step;

/* By the axis that takes least of a monomial's degrees, or none. */
SHD_INLINE shd_far_step shd_far_step_of(int degree, int r, int z) {
    const int x = degree - r, y = r - z;
    const int axis = x && (!y || x <= y) && (!z || x <= z) ? 0 : y && (!z || y <= z) ? 1 : 2;
    const int count = axis == 0 ? x : axis == 1 ? y : z, down = axis > 0, in = axis > 1;
    return (shd_far_step){
        axis, count - 1, shd_monomials_below(degree - 1) + shd_monomial(r - down, z - in),
        count > 1 ? shd_monomials_below(degree - 2) + shd_monomial(r - 2 * down, z - 2 * in) : 0};
}
