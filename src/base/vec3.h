/* Vectors and affine maps in f64. Right-handed, +Y up; matrices act on column vectors. */
#pragma once

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

#define SHD_PI 3.14159265358979323846

typedef struct shd_vec3 {
    double x, y, z;
} shd_vec3;

/* p -> linear * p + origin; linear[row][column]. */
typedef struct shd_affine {
    double linear[3][3];
    shd_vec3 origin;
} shd_affine;

static inline shd_vec3 shd_add(shd_vec3 a, shd_vec3 b) {
    return (shd_vec3){a.x + b.x, a.y + b.y, a.z + b.z};
}

static inline shd_vec3 shd_sub(shd_vec3 a, shd_vec3 b) {
    return (shd_vec3){a.x - b.x, a.y - b.y, a.z - b.z};
}

static inline shd_vec3 shd_scale(shd_vec3 a, double s) {
    return (shd_vec3){a.x * s, a.y * s, a.z * s};
}

/* a + b * s */
static inline shd_vec3 shd_madd(shd_vec3 a, shd_vec3 b, double s) {
    return (shd_vec3){a.x + b.x * s, a.y + b.y * s, a.z + b.z * s};
}

static inline double shd_dot(shd_vec3 a, shd_vec3 b) {
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static inline shd_vec3 shd_cross(shd_vec3 a, shd_vec3 b) {
    return (shd_vec3){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline bool shd_is_finite(shd_vec3 a) {
    return isfinite(a.x) && isfinite(a.y) && isfinite(a.z);
}

/* The smaller and the larger of two numbers, b if a is not a number. fmin and fmax are calls. */
static inline double shd_smaller(double a, double b) {
    return a < b ? a : b;
}

static inline double shd_larger(double a, double b) {
    return a > b ? a : b;
}

/* The same of each component: how boxes grow. */
static inline shd_vec3 shd_vec3_min(shd_vec3 a, shd_vec3 b) {
    return (shd_vec3){shd_smaller(a.x, b.x), shd_smaller(a.y, b.y), shd_smaller(a.z, b.z)};
}

static inline shd_vec3 shd_vec3_max(shd_vec3 a, shd_vec3 b) {
    return (shd_vec3){shd_larger(a.x, b.x), shd_larger(a.y, b.y), shd_larger(a.z, b.z)};
}

/* Corner 0 to 7 of a box: bits 0, 1 and 2 are set at the high ends of x, y and z. */
static inline shd_vec3 shd_box_corner(shd_vec3 low, shd_vec3 high, int corner) {
    return (shd_vec3){corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y,
                      corner & 4 ? high.z : low.z};
}

/* Vector `index` of an array of components. */
static inline shd_vec3 shd_vec3_at(const double *values, size_t index) {
    return (shd_vec3){values[3 * index], values[3 * index + 1], values[3 * index + 2]};
}

/* The largest absolute component. */
static inline double shd_max_abs(shd_vec3 a) {
    return shd_larger(shd_larger(fabs(a.x), fabs(a.y)), fabs(a.z));
}

/* Length without overflow or underflow in the squares. */
static inline double shd_length(shd_vec3 a) {
    double m = shd_max_abs(a);
    if (!(m > 0) || !isfinite(m)) return m;
    shd_vec3 s = {a.x / m, a.y / m, a.z / m};
    return m * sqrt(shd_dot(s, s));
}

/* The unit vector along a, of any length. False, with *out untouched: a is zero or not finite. */
static inline bool shd_normalize(shd_vec3 a, shd_vec3 *out) {
    double m = shd_max_abs(a);
    if (!(m > 0) || !shd_is_finite(a)) return false;
    shd_vec3 s = {a.x / m, a.y / m, a.z / m};
    *out = shd_scale(s, 1 / sqrt(shd_dot(s, s)));
    return true;
}

static inline shd_vec3 shd_linear(const shd_affine *m, shd_vec3 v) {
    const double(*a)[3] = m->linear;
    return (shd_vec3){a[0][0] * v.x + a[0][1] * v.y + a[0][2] * v.z,
                      a[1][0] * v.x + a[1][1] * v.y + a[1][2] * v.z,
                      a[2][0] * v.x + a[2][1] * v.y + a[2][2] * v.z};
}

static inline shd_vec3 shd_transform(const shd_affine *m, shd_vec3 p) {
    return shd_add(shd_linear(m, p), m->origin);
}

/* a after b: p -> a(b(p)). */
shd_affine shd_compose(const shd_affine *a, const shd_affine *b);

/* The inverse. False, and *out is untouched, if the linear part is singular: if its determinant,
 * after its columns are scaled to length 1, is below 1e-12 or not finite. */
bool shd_invert(const shd_affine *m, shd_affine *out);

/* The matrix that carries outward normals: the cofactor matrix times the sign of the determinant
 * (Turkowski, "Properties of Surface Normal Transformations", Graphics Gems, 1990). It is scaled so
 * that no component overflows, and its origin is zero. Apply it with shd_linear, then normalize. */
shd_affine shd_normal_map(const shd_affine *m);

/* An upper bound of the linear part's largest singular value, at most 1.1e-7 of it too large: no
 * vector grows by more. For a part that is not finite, the largest component by size. */
double shd_norm(const shd_affine *m);

/* Whether a map turns or mirrors and scales all directions alike, to rounding. `length`: those that
 * it gives to the axes' unit vectors. */
bool shd_is_similar(const shd_affine *m, double length[3]);
