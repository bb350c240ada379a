#include "shade/far.h"

#include <string.h>

/* Monomials of degree g in (x, y, z) are x^(g - r) y^(r - z) z^z at r (r + 1) / 2 + z, whatever g
 * is: a factor x changes no place, y adds 1 to r, and z adds 1 to both. */
static size_t place_of(int r, int z) {
    return (size_t)(r * (r + 1) / 2 + z);
}

/* Where the moments begin that belong to monomials of degree 0 to 4. */
enum {
    FLAT = 0,     /* [3]  g0 D */
    SPREAD = 3,   /* [1]  g0 */
    TILT = 4,     /* [6]  g1 */
    BEND = 10,    /* [3]  g1 / D */
    TURN = 13,    /* [10] g2 / D */
    SPREAD2 = 23, /* [1]  g1 / D^2 */
    TILT2 = 24,   /* [6]  g2 / D^2 */
    TWIST = 30,   /* [15] g3 / D^2 */
    LENGTH = TWIST + 15
};
_Static_assert((int)LENGTH == (int)SHD_FAR_MOMENTS, "all moments have their places");

/* ---- What is left out. ---- */

/* x^4 and what follows in sums of (k + n) x^k. */
static double tail_of(double x, double n) {
    const double left = 1 - x;
    return x * x * x * x * ((4 + n) * left + x) / (left * left);
}

/* Any attenuation, by majorants: |v| / D of 1 + x / (1 - x), |v|^2 / D^2 of (1 + x)^2, 1 / |v| of 1
 * / (D (1 - x)), v of D (1 + x); and one over what is 1 and more of one over 1 less that more. */
static double mixed_tail(double linear, double square, double x) {
    const double q1 = linear + 2 * square, q2 = linear + square, q3 = linear,
                 q = linear * x / (1 - x) + square * x * (2 + x);
    if (!(q < 0.9)) return INFINITY;
    const double i1 = q1, i2 = q2 + q1 * q1, i3 = q3 + 2 * q1 * q2 + q1 * q1 * q1;
    const double p1 = 1 + i1, p2 = p1 + i2, p3 = p2 + i3;
    const double whole = (1 + x) / ((1 - x) * (1 - q));
    return whole - (1 + x * (1 + p1 + x * (p1 + p2 + x * (p2 + p3)))) + 1e-14 * whole;
}

double shd_far_rest(const shd_plan_light *light, double distance, double radius) {
    static const double ROUNDING = 1e-12, WIDEST = 0.4;
    if (light->directional) return ROUNDING;
    const double x = radius / distance * (1 + 1e-9);
    if (!(x < WIDEST)) return INFINITY;
    if (!light->attenuated) return 2 * x * x * x * x / (1 - x) + ROUNDING;
    if (!(distance - radius > light->min_distance * (1 + 1e-9)) ||
        !(shd_attenuation(light, distance - radius) < SHD_LARGEST_FALL))
        return INFINITY;
    if (light->a == 0 && light->b == 0) return tail_of(x, 1.5) + ROUNDING;
    if (light->a == 0 && light->c == 0) return 2 * tail_of(x, 0.5) + ROUNDING;
    const double linear = distance * light->b, square = distance * distance * light->c,
                 all = light->a + linear + square;
    return mixed_tail(linear / all, square / all, x) + ROUNDING;
}

/* ---- Moments. ---- */

/* Monomials of the next degree from those of degree g. */
static void raise_monomials(const double *from, int g, shd_vec3 n, double *to) {
    for (int r = 0; r <= g; r++)
        for (int z = 0; z <= r; z++) to[place_of(r, z)] = from[place_of(r, z)] * n.x;
    for (int z = 0; z <= g; z++) to[place_of(g + 1, z)] = from[place_of(g, z)] * n.y;
    to[place_of(g + 1, g + 1)] = from[place_of(g, g)] * n.z;
}

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

static void put_moments(double *to, const double *monomials, int count, double weight) {
    for (int k = 0; k < count; k++) to[k] = weight * monomials[k];
}

void shd_far_add(const shd_plan_light *light, shd_far *to) {
    double m[SHD_FAR_MOMENTS] = {0};
    if (light->directional) {
        m[FLAT] = light->toward.x, m[FLAT + 1] = light->toward.y, m[FLAT + 2] = light->toward.z;
    } else {
        const shd_vec3 path = shd_sub(light->position, to->center);
        const double d = shd_length(path), inverse = 1 / d;
        const shd_vec3 n = shd_scale(path, inverse);
        const double one[] = {n.x, n.y, n.z};
        double two[6], three[10], four[15], g[4];
        raise_monomials(one, 1, n, two);
        raise_monomials(two, 2, n, three);
        raise_monomials(three, 3, n, four);
        expand_fall(light, d, g);
        put_moments(m + FLAT, one, 3, g[0] * d);
        m[SPREAD] = g[0];
        put_moments(m + TILT, two, 6, g[1]);
        put_moments(m + BEND, one, 3, g[1] * inverse);
        put_moments(m + TURN, three, 10, g[2] * inverse);
        m[SPREAD2] = g[1] * inverse * inverse;
        put_moments(m + TILT2, two, 6, g[2] * inverse * inverse);
        put_moments(m + TWIST, four, 15, g[3] * inverse * inverse);
    }
    for (int c = 0; c < to->channels; c++)
        for (int k = 0; k < SHD_FAR_MOMENTS; k++) to->moments[c][k] += light->color[c] * m[k];
    to->lights++;
}

/* ---- Points. ---- */

enum { BESIDE = 8 }; /* points that are lit together */

typedef double lanes[BESIDE];

/* Multiplies a form of degree g in n by a linear one: coefficients of monomials. */
static void multiply_form(const lanes *form, int g, const lanes line[3], lanes *to) {
    memset(to, 0, place_of(g + 1, g + 2) * sizeof *to);
    for (int r = 0; r <= g; r++)
        for (int z = 0; z <= r; z++)
            for (int c = 0; c < 3; c++) {
                const double *from = form[place_of(r, z)], *by = line[c];
                double *out = to[place_of(r + (c > 0), z + (c > 1))];
                for (int i = 0; i < BESIDE; i++) out[i] += from[i] * by[i];
            }
}

/* What each moment is multiplied by, so that the sum is N.E: with s = h.h, t = N.h,
 *     FLAT n.N, -SPREAD t, -2 TILT (n.h) (n.N), BEND (s n.N + 2 t n.h), 4 TURN (n.h)^2 (n.N),
 *     -SPREAD2 s t, -4 TILT2 (s (n.h) (n.N) + t (n.h)^2), -8 TWIST (n.h)^3 (n.N). */
static void weigh_moments(const lanes h[3], const lanes n[3], lanes q[SHD_FAR_MOMENTS]) {
    lanes s, t, hh[6], hn[6], hhh[10];
    for (int i = 0; i < BESIDE; i++) {
        s[i] = h[0][i] * h[0][i] + h[1][i] * h[1][i] + h[2][i] * h[2][i];
        t[i] = h[0][i] * n[0][i] + h[1][i] * n[1][i] + h[2][i] * n[2][i];
    }
    multiply_form(h, 1, h, hh);
    multiply_form(h, 1, n, hn);
    multiply_form(hh, 2, h, hhh);
    multiply_form(hh, 2, n, q + TURN);
    multiply_form(hhh, 3, n, q + TWIST);
    for (int i = 0; i < BESIDE; i++) {
        q[SPREAD][i] = -t[i];
        q[SPREAD2][i] = -s[i] * t[i];
        for (int c = 0; c < 3; c++) {
            q[FLAT + c][i] = n[c][i];
            q[BEND + c][i] = s[i] * n[c][i] + 2 * t[i] * h[c][i];
        }
        for (int k = 0; k < 6; k++) {
            q[TILT + k][i] = -2 * hn[k][i];
            q[TILT2 + k][i] = -4 * (s[i] * hn[k][i] + t[i] * hh[k][i]);
        }
        for (int k = 0; k < 10; k++) q[TURN + k][i] *= 4;
        for (int k = 0; k < 15; k++) q[TWIST + k][i] *= -8;
    }
}

void shd_far_light(const shd_plan *plan, const shd_far *far, size_t count,
                   const float *const position[3], const float *const low[3],
                   const float *const normal[3], float *const diffuse[3]) {
    const double world = 1 / plan->scale;
    const shd_vec3 from = shd_sub(plan->origin, far->center);
    const double begin[3] = {from.x, from.y, from.z};
    for (size_t first = 0; first < count; first += BESIDE) {
        const size_t some = count - first < BESIDE ? count - first : BESIDE;
        lanes h[3], n[3], q[SHD_FAR_MOMENTS];
        for (int c = 0; c < 3; c++)
            for (size_t i = 0; i < BESIDE; i++) {
                const size_t at = first + (i < some ? i : some - 1);
                const double p = (double)position[c][at] + (low[0] ? (double)low[c][at] : 0);
                h[c][i] = p * world + begin[c];
                n[c][i] = (double)normal[c][at];
            }
        weigh_moments(h, n, q);
        for (int c = 0; c < far->channels; c++) {
            lanes sum = {0};
            for (int k = 0; k < SHD_FAR_MOMENTS; k++)
                for (int i = 0; i < BESIDE; i++) sum[i] += far->moments[c][k] * q[k][i];
            float *out = diffuse[c] + first;
            for (size_t i = 0; i < some; i++)
                out[i] = (float)((double)out[i] + shd_larger(sum[i], 0));
        }
    }
}
