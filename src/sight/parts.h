/* Triangles while a tree is made of them: boxes in f32. Only for tree.c. */
#pragma once

#include <math.h>
#include <stdint.h>

#include "base/vec3.h"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

/* Vectors of four, whatever the build is for: x, y, z, and what is passed along. */
typedef float four __attribute__((vector_size(16)));
typedef uint32_t whole_four __attribute__((vector_size(16)));

typedef struct box {
    four low, high;
} box;

/* A triangle while the tree is made: its box, and in the last places its index and the order of its
 * corners, as in a leaf's name. */
typedef struct part {
    four low, high;
} part;

static const box EMPTY = {{INFINITY, INFINITY, INFINITY, INFINITY},
                          {-INFINITY, -INFINITY, -INFINITY, -INFINITY}};

static inline four lesser(four a, four b) {
#ifdef __SSE2__
    return _mm_min_ps(a, b);
#else
    const whole_four less = (whole_four)(a < b);
    return (four)((less & (whole_four)a) | (~less & (whole_four)b));
#endif
}

static inline four greater(four a, four b) {
#ifdef __SSE2__
    return _mm_max_ps(a, b);
#else
    const whole_four more = (whole_four)(a > b);
    return (four)((more & (whole_four)a) | (~more & (whole_four)b));
#endif
}

static inline void enclose_box(box *b, four low, four high) {
    b->low = lesser(low, b->low);
    b->high = greater(high, b->high);
}

static inline float half_area(const box *b) {
    const four s = b->high - b->low;
    return s[0] * s[1] + s[1] * s[2] + s[2] * s[0];
}

static inline four twice_middle(const part *p) {
    return p->low + p->high;
}

static inline uint32_t triangle_of(const part *p) {
    return ((whole_four)p->low)[3];
}

static inline uint32_t order_of(const part *p) {
    return ((whole_four)p->high)[3];
}

/* Below and above x, by more than rounding has made of it in f64. */
static inline float round_down(double x) {
    const float near = (float)x;
    return near - (fabsf(near) * 0x1p-22f + 0x1p-60f);
}

static inline float round_up(double x) {
    return -round_down(-x);
}

static inline part make_part(shd_vec3 low, shd_vec3 high, uint32_t triangle, uint32_t order) {
    part out = {{round_down(low.x), round_down(low.y), round_down(low.z), 0},
                {round_up(high.x), round_up(high.y), round_up(high.z), 0}};
    out.low = (four)((whole_four)out.low | (whole_four){0, 0, 0, triangle});
    out.high = (four)((whole_four)out.high | (whole_four){0, 0, 0, order});
    return out;
}
