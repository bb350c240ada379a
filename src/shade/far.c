#include "shade/far.h"

#include <math.h>

#include "base/simd.h"

/* ---- What is left out. ---- */

/* x^m and what follows in sums of (k + n) x^k. */
static double tail_of(double x, double n, int m) {
    const double left = 1 - x, cube = x * x * x;
    return (m > 3 ? cube * x : cube) * ((m + n) * left + x) / (left * left);
}

/* Any attenuation, by majorants: |v| / D of 1 + x / (1 - x), |v|^2 / D^2 of (1 + x)^2, 1 / |v| of 1
 * / (D (1 - x)), v of D (1 + x); and one over what is 1 and more of one over 1 less that more. */
static double mixed_tail(double linear, double square, double x, int m) {
    const double q1 = linear + 2 * square, q2 = linear + square, q3 = linear,
                 q = linear * x / (1 - x) + square * x * (2 + x);
    if (!(q < 0.9)) return INFINITY;
    const double i1 = q1, i2 = q2 + q1 * q1, i3 = q3 + 2 * q1 * q2 + q1 * q1 * q1;
    const double p1 = 1 + i1, p2 = p1 + i2, p3 = p2 + i3;
    const double whole = (1 + x) / ((1 - x) * (1 - q));
    const double cube = m > 3 ? p2 + p3 : 0;
    return whole - (1 + x * (1 + p1 + x * (p1 + p2 + x * cube))) + 1e-14 * whole;
}

double shd_far_rest(const shd_plan_light *light, double distance, double radius, int degree) {
    static const double ROUNDING = 1e-12, WIDEST = 0.4;
    if (light->directional) return ROUNDING;
    const double x = radius / distance * (1 + 1e-9);
    if (!(x < WIDEST)) return INFINITY;
    if (!light->attenuated)
        return 2 * (degree > 3 ? x * x * x * x : x * x * x) / (1 - x) + ROUNDING;
    if (!(distance - radius > light->min_distance * (1 + 1e-9)) ||
        !(shd_attenuation(light, distance - radius) < SHD_LARGEST_FALL))
        return INFINITY;
    if (light->a == 0 && light->b == 0) return tail_of(x, 1.5, degree) + ROUNDING;
    if (light->a == 0 && light->c == 0) return 2 * tail_of(x, 0.5, degree) + ROUNDING;
    const double linear = distance * light->b, square = distance * distance * light->c,
                 all = light->a + linear + square;
    return mixed_tail(linear / all, square / all, x, degree) + ROUNDING;
}

/* ---- Derivatives. ---- */

/* The first terms of f(|v|) / |v| in e / D^2, where |v|^2 is D^2 + e. */
static void expand_fall(const shd_plan_light *light, double d, double g[4]) {
    /* |v| / D is the root of 1 + u, and |v|^3 / D^3 its third power. */
    static const double root[] = {1, 0.5, -0.125, 0.0625}, cube[] = {1, 1.5, 0.375, -0.0625};
    const double a = light->attenuated ? light->a * d : d,
                 b = light->attenuated ? light->b * d * d : 0,
                 c = light->attenuated ? light->c * d * d * d : 0;
    double y[4];
    for (int k = 0; k < 4; k++) y[k] = a * root[k] + (k < 2 ? b : 0) + c * cube[k];
    g[0] = light->gain / y[0];
    for (int k = 1; k < 4; k++) {
        double sum = 0;
        for (int i = 1; i <= k; i++) sum += y[i] * g[k - i];
        g[k] = -sum / y[0];
    }
}

/* Where the derivatives of degree 1 to 4 begin. */
enum { FIRST = 0, SECOND = 3, THIRD = 9, FOURTH = 19 };

/* With n = v / D and e = h.h - 2 D n.h, the potential is -1/2 the integral of g by e, whose parts
 * are, by degree,
 *     g0 D n.h;  -g0/2 h.h - g1 (n.h)^2;  (g1 (n.h) (h.h) + 4/3 g2 (n.h)^3) / D;
 *     -(g1/4 (h.h)^2 + 2 g2 (n.h)^2 (h.h) + 2 g3 (n.h)^4) / D^2.
 * A derivative of (n.h)^k is k! n^a, and each h.h takes a pair of equal axes out of a: it may be
 * one of a (a - 1) / 2 pairs. */
static void derive_potential(const shd_plan_light *light, shd_vec3 path, double to[SHD_FAR_TERMS]) {
    const double d = shd_length(path), inverse = 1 / d;
    const double n[3] = {path.x * inverse, path.y * inverse, path.z * inverse};
    double g[4], power[3][5];
    expand_fall(light, d, g);
    for (int c = 0; c < 3; c++) {
        power[c][0] = 1;
        for (int k = 1; k < 5; k++) power[c][k] = power[c][k - 1] * n[c];
    }
    const double *const x = power[0], *const y = power[1], *const z = power[2];
    const double whole[5] = {0, g[0] * d, -2 * g[1], 8 * g[2] * inverse,
                             -48 * g[3] * inverse * inverse},
                 pair[5] = {0, 0, -g[0], 2 * g[1] * inverse, -8 * g[2] * inverse * inverse},
                 pairs = -2 * g[1] * inverse * inverse;
    for (int degree = 1; degree < 5; degree++)
        for (int r = 0; r <= degree; r++)
            for (int k = 0; k <= r; k++) {
                const int i = degree - r, j = r - k;
                double taken = 0;
                if (i > 1) taken += i * (i - 1) / 2 * (x[i - 2] * y[j] * z[k]);
                if (j > 1) taken += j * (j - 1) / 2 * (x[i] * y[j - 2] * z[k]);
                if (k > 1) taken += k * (k - 1) / 2 * (x[i] * y[j] * z[k - 2]);
                double sum = whole[degree] * (x[i] * y[j] * z[k]) + pair[degree] * taken;
                if (degree == 4 && !(i % 2 || j % 2))
                    sum += pairs * (i == 4 || j == 4 || k == 4 ? 3 : 1);
                to[shd_monomials_below(degree) - 1 + shd_monomial(r, k)] = sum;
            }
}

void shd_far_add(const shd_plan_light *light, shd_far *to) {
    double d[SHD_FAR_TERMS] = {light->toward.x, light->toward.y, light->toward.z};
    if (!light->directional) derive_potential(light, shd_sub(light->position, to->center), d);
    for (int c = 0; c < to->channels; c++)
        for (int k = 0; k < SHD_FAR_TERMS; k++) to->terms[c][k] += light->color[c] * d[k];
    to->lights++;
}

/* Adds moments times derivatives of degree up to `last` to those of lower degrees. */
SHD_INLINE void shift_to(const double *moments, const double *derived, int last, double *to) {
#pragma GCC unroll 4
    for (int from = 1; from <= last; from++)
#pragma GCC unroll 4
        for (int g = 0; from + g <= last; g++)
#pragma GCC unroll 4
            for (int r = 0; r <= g; r++)
#pragma GCC unroll 4
                for (int z = 0; z <= r; z++)
#pragma GCC unroll 5
                    for (int q = 0; q <= from; q++)
#pragma GCC unroll 5
                        for (int k = 0; k <= q; k++)
                            to[shd_monomials_below(from) - 1 + shd_monomial(q, k)] +=
                                moments[shd_monomials_below(g) + shd_monomial(r, z)] *
                                derived[shd_monomials_below(from + g) - 1 +
                                        shd_monomial(q + r, k + z)];
}

static void shift_terms(const double *moments, const double *derived, int last, double *to) {
    double sums[SHD_FAR_TERMS] = {0};
    if (last > 3)
        shift_to(moments, derived, 4, sums);
    else
        shift_to(moments, derived, 3, sums);
    for (int k = 0; k < SHD_FAR_TERMS; k++) to[k] += sums[k];
}

void shd_far_shift(const shd_far *from, shd_far *to) {
    const shd_vec3 way = shd_sub(to->center, from->center);
    double moments[SHD_BUNCH_MOMENTS];
    shd_moments(way, moments);
    to->degree = from->degree > to->degree ? from->degree : to->degree;
    for (int c = 0; c < to->channels; c++)
        shift_terms(moments, from->terms[c], from->degree, to->terms[c]);
    to->lights += from->lights;
}

void shd_far_add_bunch(const shd_bunches *bunches, const shd_bunch *bunch, shd_far *to) {
    double d[SHD_FAR_TERMS];
    derive_potential(&bunches->falls[bunch->fall], shd_sub(bunch->center, to->center), d);
    for (int c = 0; c < to->channels; c++)
        shift_terms(bunch->moments[c], d, to->degree, to->terms[c]);
    to->lights += bunch->end - bunch->first;
}

/* ---- Kernels. ---- */

const shd_far_kernel *shd_far_kernel_of(shd_isa isa) {
    static const shd_far_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_far_kernel);
    return kernels[isa];
}
