/* The number that the evaluation of the model computes with, and points of space. */
#ifndef SHD_ATTACK_REAL_H
#define SHD_ATTACK_REAL_H

#include <math.h>

#if defined ATTACK_QUAD && defined __x86_64__ && defined __GNUC__ && !defined __clang__
#include <quadmath.h>
typedef __float128 real;
#define ROOT     sqrtq
#define POWER    powq
#define SINE     sinq
#define COSINE   cosq
#define ANGLE    atan2q
#define SIZE     fabsq
#define EXPONENT expq
#define ARC      acosq
enum { HALVINGS = 130 };
#else
typedef long double real;
#define ROOT     sqrtl
#define POWER    powl
#define SINE     sinl
#define COSINE   cosl
#define ANGLE    atan2l
#define SIZE     fabsl
#define EXPONENT expl
#define ARC      acosl
enum { HALVINGS = 80 };
#endif

typedef struct point {
    real x, y, z;
} point;

static inline point add(point a, point b) {
    return (point){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline point sub(point a, point b) {
    return (point){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline point times(point a, real s) {
    return (point){a.x * s, a.y * s, a.z * s};
}

static inline real dot(point a, point b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline point cross(point a, point b) {
    return (point){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline real larger(real a, real b) {
    return a > b ? a : b;
}

static inline real smaller(real a, real b) {
    return a < b ? a : b;
}

/* Squares of lengths may be beyond the number's range where lengths are not. */
static inline real most_of(point a) {
    return larger(SIZE(a.x), larger(SIZE(a.y), SIZE(a.z)));
}

static inline real length(point a) {
    const real most = most_of(a);
    if (!(most > 0)) return 0;
    a = times(a, 1 / most);
    return most * ROOT(dot(a, a));
}

static inline point unit(point a) {
    const real most = most_of(a);
    if (!(most > 0)) return a;
    a = times(a, 1 / most);
    return times(a, 1 / ROOT(dot(a, a)));
}

static inline real degrees(real angle) {
    return angle * (ANGLE(0, -1) / 180);
}

#endif
