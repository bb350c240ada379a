#include "shade/far.h"

#include <math.h>

#include "base/simd.h"
#include "shade/far_terms.h"

/* ---- What is left out. ---- */

/* x^m, m from 3 on. */
static double power_of(double x, int m) {
    double power = x * x * x;
    for (int k = 3; k < m; k++) power *= x;
    return power;
}

/* x^m and what follows in sums of (k + n) x^k. */
static double tail_of(double x, double n, int m) {
    const double left = 1 - x;
    return power_of(x, m) * ((m + n) * left + x) / (left * left);
}

/* Any attenuation, by majorants: |v| / D of 1 + x / (1 - x), |v|^2 / D^2 of (1 + x)^2, 1 / |v| of 1
 * / (D (1 - x)), v of D (1 + x); and one over what is 1 and more of one over 1 less that more. From
 * x^4 on nothing is left out of it. */
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
    if (!light->attenuated) return 2 * power_of(x, degree) / (1 - x) + ROUNDING;
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
static void expand_fall(const shd_plan_light *light, double d, double g[6]) {
    const double a = light->attenuated ? light->a * d : d,
                 b = light->attenuated ? light->b * d * d : 0,
                 c = light->attenuated ? light->c * d * d * d : 0;
    double y[6];
    for (int k = 0; k < 6; k++) y[k] = a * shd_far_root[k] + (k < 2 ? b : 0) + c * shd_far_cube[k];
    g[0] = light->gain / y[0];
    for (int k = 1; k < 6; k++) {
        double sum = 0;
        for (int i = 1; i <= k; i++) sum += y[i] * g[k - i];
        g[k] = -sum / y[0];
    }
}

/* The potential is a function of e / 2, whose derivatives are those of g: with h in units of D, and
 * R_j(a) the derivative by h of degrees a of the j-th derivative by e / 2,
 *     R_j(0) = -2^(j-1) (j-1)! g_(j-1), R_j(a) = -n_c R_(j+1)(a - 1_c) + (a_c - 1) R_(j+1)(a - 2_c)
 * for any axis c in a (McMurchie and Davidson 1978). R_0 is what is looked for. */
SHD_INLINE void derive_to(int last, const shd_plan_light *light, shd_vec3 path,
                          double to[SHD_FAR_TERMS]) {
    const double d = shd_length(path), inverse = 1 / d;
    const double n[3] = {path.x * inverse, path.y * inverse, path.z * inverse};
    double g[6], all[SHD_FAR_TERMS + 1], unit = d;
    expand_fall(light, d, g);
    all[0] = shd_far_factor[last - 1] * g[last - 1];
    UNROLL(6)
    for (int j = last - 1; j >= 0; j--) {
        UNROLL(6)
        for (int degree = last - j; degree > 0; degree--) UNROLL(7)
        for (int r = 0; r <= degree; r++) UNROLL(7)
        for (int z = 0; z <= r; z++) {
            const shd_far_step step = shd_far_step_of(degree, r, z);
            double sum = -n[step.axis] * all[step.once];
            if (step.times) sum += step.times * all[step.twice];
            all[shd_monomials_below(degree) + shd_monomial(r, z)] = sum;
        }
        if (j) all[0] = shd_far_factor[j - 1] * g[j - 1];
    }
    for (int degree = 1; degree <= last; degree++, unit *= inverse)
        for (size_t k = shd_monomials_below(degree); k < shd_monomials_below(degree + 1); k++)
            to[k - 1] = unit * all[k];
}

static void derive_potential(const shd_plan_light *light, shd_vec3 path, int last,
                             double to[SHD_FAR_TERMS]) {
    BY_DEGREE(last, derive_to, light, path, to);
}

void shd_far_add(const shd_plan_light *light, shd_far *to) {
    double d[SHD_FAR_TERMS] = {light->toward.x, light->toward.y, light->toward.z};
    if (!light->directional)
        derive_potential(light, shd_sub(light->position, to->center), to->degree, d);
    for (int c = 0; c < to->channels; c++)
        for (int k = 0; k < SHD_FAR_TERMS; k++) to->terms[c][k] += light->color[c] * d[k];
    to->lights++;
}

/* Adds moments times derivatives of degree up to `last` to those of lower degrees. */
SHD_INLINE void shift_to(int last, const double *moments, const double *derived, double *to) {
    UNROLL(6)
    for (int from = 1; from <= last; from++) UNROLL(6)
    for (int g = 0; from + g <= last; g++) UNROLL(6)
    for (int r = 0; r <= g; r++) UNROLL(6)
    for (int z = 0; z <= r; z++) UNROLL(7)
    for (int q = 0; q <= from; q++) UNROLL(7)
    for (int k = 0; k <= q; k++)
        to[shd_monomials_below(from) - 1 + shd_monomial(q, k)] +=
            moments[shd_monomials_below(g) + shd_monomial(r, z)] *
            derived[shd_monomials_below(from + g) - 1 + shd_monomial(q + r, k + z)];
}

static void shift_terms(const double *moments, const double *derived, int last, double *to) {
    double sums[SHD_FAR_TERMS] = {0};
    BY_DEGREE(last, shift_to, moments, derived, sums);
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

/* ---- Kernels. ---- */

const shd_far_kernel *shd_far_kernel_of(shd_isa isa) {
    static const shd_far_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_far_kernel);
    return kernels[isa];
}
