/* Many lights at one patch, and one polynomial at many points. Loops go over lanes, which compilers
 * make vectors of. Compiled once for each instruction set; all variants give the same bits. */
#include <math.h>
#include <string.h>

#include "base/simd.h"
#include "shade/far.h"

/* Lights and points are taken eight at a time whatever the width of vectors, so that sums are the
 * same. */
enum { LANES = 8, WIDE = SHD_W / 2, SLOWLY = 6 /* squarings of exp */ };

typedef double lanes[LANES];

static const double MARGIN = 1e-6; /* as bound/light/pieces.h has it */

#define EACH for (int i = 0; i < LANES; i++)

static inline double greater(double a, double b) {
    return a > b ? a : b;
}

SHD_INLINE shd_vd vd(double a) {
    return shd_vd_set(a);
}

SHD_INLINE shd_vd lesser_vd(shd_vd a, shd_vd b) {
    return shd_vd_select(shd_vd_gt(b, a), a, b);
}

SHD_INLINE shd_vd greater_vd(shd_vd a, shd_vd b) {
    return shd_vd_select(shd_vd_gt(a, b), a, b);
}

/* `a` where x > y, else `b`. */
SHD_INLINE shd_vd where(shd_vd x, shd_vd y, shd_vd a, shd_vd b) {
    return shd_vd_select(shd_vd_gt(x, y), a, b);
}

/* ---- Lights at a patch. ---- */

typedef struct rows {
    lanes x, y, z, a, b, c, gain, least;
} rows;

static void load_rows(const shd_bunches *from, const uint32_t *which, size_t some, rows *r) {
    double *const out[] = {r->x, r->y, r->z, r->a, r->b, r->c, r->gain, r->least};
    uint32_t at[LANES];
    for (size_t i = 0; i < LANES; i++) at[i] = which[i < some ? i : some - 1];
    for (int k = 0; k < 8; k++) EACH out[k][i] = from->rows[k][at[i]];
}

/* Cosine and sine of a sum of angles: -1 and 0 if it is more than 180 degrees, or not known. */
SHD_INLINE void add_angles(shd_vd cosine, shd_vd sine, shd_angle in, shd_vd known,
                           shd_vd *out_cosine, shd_vd *out_sine) {
    const shd_vd zero = vd(0), c = in.cosine * cosine - in.sine * sine,
                 s = in.sine * cosine + in.cosine * sine;
    shd_vd right = where(zero, s, zero, known);
    right = where(cosine + in.cosine, zero, right, zero);
    *out_cosine = where(right, zero, c, vd(-1));
    *out_sine = where(right, zero, s, zero);
}

/* cos(a - b) and cos(a + b), a and b from 0 to 180 degrees, of a's cosine. */
SHD_INLINE void turn_angle(shd_vd cosine, shd_vd by_cosine, shd_vd by_sine, shd_vd *high,
                           shd_vd *low) {
    const shd_vd a = greater_vd(lesser_vd(cosine, vd(1)), vd(-1)), sine = shd_vd_sqrt(1 - a * a);
    *high = where(by_cosine, a, a * by_cosine + sine * by_sine, vd(1)) + MARGIN;
    *low = where(a, -by_cosine, a * by_cosine - sine * by_sine, vd(-1)) - MARGIN;
}

/* x^4 and what follows: see far.c, which these are of. */
SHD_INLINE shd_vd pure_tail(shd_vd x, double n) {
    const shd_vd left = 1 - x;
    return x * x * x * x * ((4 + n) * left + x) / (left * left);
}

SHD_INLINE shd_vd mixed_tail(shd_vd linear, shd_vd square, shd_vd x) {
    const shd_vd q1 = linear + 2 * square, q2 = linear + square, q3 = linear,
                 q = linear * x / (1 - x) + square * x * (2 + x);
    const shd_vd i1 = q1, i2 = q2 + q1 * q1, i3 = q3 + 2 * q1 * q2 + q1 * q1 * q1;
    const shd_vd p1 = 1 + i1, p2 = p1 + i2, p3 = p2 + i3;
    const shd_vd whole = (1 + x) / ((1 - x) * (1 - q));
    const shd_vd rest = whole - (1 + x * (1 + p1 + x * (p1 + p2 + x * (p2 + p3)))) + 1e-14 * whole;
    return where(vd(0.9), q, rest, vd(INFINITY));
}

typedef struct looks {
    lanes front, certain, rest, most, power[SHD_FAR_LOBES];
} looks;

SHD_INLINE shd_vd tail_of(shd_vd a, shd_vd b, shd_vd c, shd_vd linear, shd_vd square, shd_vd t) {
    const shd_vd zero = vd(0);
    shd_vd tail = mixed_tail(linear, square, t);
    tail = where(a + c, zero, tail, 2 * pure_tail(t, 0.5));
    tail = where(a + b, zero, tail, pure_tail(t, 1.5));
    return where(b + c, zero, tail, 2 * t * t * t * t / (1 - t));
}

/* What light of `fall` shows of each lobe at most. (R.V)^ns is at most exp(-x), x = ns (1 - R.V),
 * and that (1 + x / 2^n)^-2^n. */
SHD_INLINE void bound_lobes(const shd_far_patch *p, int v, shd_vd shine, shd_vd fall, looks *out) {
    for (size_t k = 0; k < p->lobe_count; k++) {
        shd_vd power = 1 / (1 + p->shininess[k] / (1 << SLOWLY) * greater_vd(1 - shine, vd(0)));
        for (int n = 0; n < SLOWLY; n++) power *= power;
        shd_vd_store(out->power[k] + v, power * (1 + MARGIN) * fall);
    }
}

static void look_at_lanes(const shd_far_patch *p, const rows *r, looks *out) {
    static const double CLEAR = 1e-4, ROUNDING = 1e-12, WIDEST = 0.4, NEAREST = 1e-30,
                        FARTHEST = 1e30;
    const shd_vd zero = vd(0), one = vd(1), none = vd(INFINITY);
    for (int v = 0; v < LANES; v += WIDE) {
        const shd_vd x = shd_vd_load(r->x + v) - p->center.x,
                     y = shd_vd_load(r->y + v) - p->center.y,
                     z = shd_vd_load(r->z + v) - p->center.z,
                     d = shd_vd_sqrt(x * x + y * y + z * z), over = 1 / d, wide = p->radius * over;
        shd_vd known = where(one, wide, one, zero); /* where the patch is not around the light */
        known = where(d, vd(NEAREST), known, zero);
        known = where(vd(FARTHEST), d, known, zero);
        const shd_vd cosine = shd_vd_sqrt(where(known, zero, 1 - wide * wide, zero));
        const shd_vd toward = (x * p->axis.x + y * p->axis.y + z * p->axis.z) * over,
                     mirrored = (x * p->mirror.x + y * p->mirror.y + z * p->mirror.z) * over;
        shd_vd by_cosine, by_sine, high, low, shine, dull;
        add_angles(cosine, wide, p->spread, known, &by_cosine, &by_sine);
        turn_angle(toward, by_cosine, by_sine, &high, &low);
        add_angles(cosine, wide, p->glitter, known, &by_cosine, &by_sine);
        turn_angle(mirrored, by_cosine, by_sine, &shine, &dull);
        high = where(known, zero, lesser_vd(high, one), one);
        low = where(known, zero, low, zero);
        shine = where(known, zero, shine, one);

        const shd_vd a = shd_vd_load(r->a + v), b = shd_vd_load(r->b + v),
                     c = shd_vd_load(r->c + v), gain = shd_vd_load(r->gain + v),
                     bend = shd_vd_load(r->least + v);
        const shd_vd nearest = greater_vd(d - p->radius, zero), near = greater_vd(nearest, bend),
                     far = greater_vd(d + p->radius, bend);
        const shd_vd most = gain / (a + near * (b + near * c)),
                     least = gain / (a + far * (b + far * c)),
                     fall = lesser_vd(most, vd(SHD_LARGEST_FALL)) * (1 + MARGIN);
        const shd_vd q = wide * (1 + 1e-9), t = where(vd(WIDEST), q, q, zero), linear = d * b,
                     square = d * d * c, all = a + linear + square;
        shd_vd rest = (tail_of(a, b, c, linear / all, square / all, t) + ROUNDING) * (gain / all) *
                      (1 + MARGIN);
        rest = where(vd(WIDEST), q, rest, none);
        rest = where(where(b + c, zero, nearest, none), bend * (1 + 1e-9), rest, none);
        rest = where(vd(SHD_LARGEST_FALL), most, rest, none);
        rest = where(low, vd(CLEAR), rest, none);
        rest = where(known, zero, rest, none);
        const shd_vd certain = where(low, vd(CLEAR), least * (1 - MARGIN) * low, zero);
        shd_vd_store(out->front + v, where(high, zero, one, zero));
        shd_vd_store(out->most + v, fall * high);
        shd_vd_store(out->certain + v, certain);
        shd_vd_store(out->rest + v, rest);
        bound_lobes(p, v, shine, fall, out);
    }
}

static void look_at_lights(const shd_bunches *bunches, const shd_far_patch *patch,
                           const uint32_t *which, size_t count, shd_far_look *out) {
    for (size_t first = 0; first < count; first += LANES) {
        const size_t some = count - first < LANES ? count - first : LANES;
        rows r;
        looks l;
        load_rows(bunches, which + first, some, &r);
        look_at_lanes(patch, &r, &l);
        for (size_t i = 0; i < some; i++) {
            /* Infinite is not to be multiplied: 0 times that is not a number. */
            const bool known = l.rest[i] < INFINITY;
            double most = 0, shown = 0, rest = known ? 0 : INFINITY;
            for (int c = 0; c < 3; c++) {
                const double color = bunches->rows[8 + c][which[first + i]];
                double left = known ? patch->diffuse[c] * l.rest[i] : 0;
                for (size_t k = 0; k < patch->lobe_count; k++)
                    left += patch->specular[k][c] * l.power[k][i];
                most = greater(most, color);
                shown = greater(shown, patch->diffuse[c] * color);
                rest = greater(rest, color > 0 ? color * left : 0);
            }
            out[first + i] = (shd_far_look){.behind = !(l.front[i] > 0),
                                            .certain = l.certain[i],
                                            .rest = rest,
                                            .shown = shown * 0.5 * (l.certain[i] + l.most[i]),
                                            .most = most * l.most[i]};
        }
    }
}

/* ---- Derivatives of the potential: see far.c. ---- */

static void derive_lanes(const rows *r, shd_vec3 center, lanes to[SHD_FAR_TERMS]) {
    static const double root[] = {1, 0.5, -0.125, 0.0625}, cube[] = {1, 1.5, 0.375, -0.0625};
    for (int v = 0; v < LANES; v += WIDE) {
        const shd_vd x = shd_vd_load(r->x + v) - center.x, y = shd_vd_load(r->y + v) - center.y,
                     z = shd_vd_load(r->z + v) - center.z, d = shd_vd_sqrt(x * x + y * y + z * z),
                     over = 1 / d;
        const shd_vd a = shd_vd_load(r->a + v) * d, b = shd_vd_load(r->b + v) * d * d,
                     c = shd_vd_load(r->c + v) * d * d * d;
        shd_vd fall[4], g[4],
            power[3][5] = {{vd(1), x * over}, {vd(1), y * over}, {vd(1), z * over}};
        for (int k = 0; k < 4; k++) fall[k] = a * root[k] + (k < 2 ? b : vd(0)) + c * cube[k];
        const shd_vd part = 1 / fall[0];
        g[0] = shd_vd_load(r->gain + v) * part;
        g[1] = -fall[1] * g[0] * part;
        g[2] = -(fall[1] * g[1] + fall[2] * g[0]) * part;
        g[3] = -(fall[1] * g[2] + fall[2] * g[1] + fall[3] * g[0]) * part;
        for (int k = 0; k < 3; k++)
            for (int n = 2; n < 5; n++) power[k][n] = power[k][n - 1] * power[k][1];
        const shd_vd over2 = over * over, pairs = -2 * g[1] * over2,
                     whole[5] = {vd(0), g[0] * d, -2 * g[1], 8 * g[2] * over, -48 * g[3] * over2},
                     pair[5] = {vd(0), vd(0), -g[0], 2 * g[1] * over, -8 * g[2] * over2};
#pragma GCC unroll 4
        for (int degree = 1; degree < 5; degree++)
#pragma GCC unroll 5
            for (int s = 0; s <= degree; s++)
#pragma GCC unroll 5
                for (int k = 0; k <= s; k++) {
                    const int i = degree - s, j = s - k;
                    const shd_vd *px = power[0], *py = power[1], *pz = power[2];
                    shd_vd sum = whole[degree] * (px[i] * py[j] * pz[k]);
                    if (i > 1) sum += i * (i - 1) / 2 * pair[degree] * (px[i - 2] * py[j] * pz[k]);
                    if (j > 1) sum += j * (j - 1) / 2 * pair[degree] * (px[i] * py[j - 2] * pz[k]);
                    if (k > 1) sum += k * (k - 1) / 2 * pair[degree] * (px[i] * py[j] * pz[k - 2]);
                    if (degree == 4 && !(i % 2 || j % 2))
                        sum += (i == 4 || j == 4 || k == 4 ? 3 : 1) * pairs;
                    shd_vd_store(to[shd_monomials_below(degree) - 1 + shd_monomial(s, k)] + v, sum);
                }
    }
}

static void add_lights(const shd_bunches *bunches, const uint32_t *which, size_t count,
                       shd_far *to) {
    lanes sums[3][SHD_FAR_TERMS];
    memset(sums, 0, sizeof sums);
    for (size_t first = 0; first < count; first += LANES) {
        const size_t some = count - first < LANES ? count - first : LANES;
        rows r;
        lanes d[SHD_FAR_TERMS];
        load_rows(bunches, which + first, some, &r);
        derive_lanes(&r, to->center, d);
        for (int c = 0; c < to->channels; c++) {
            lanes color = {0};
            for (size_t i = 0; i < some; i++) color[i] = bunches->rows[8 + c][which[first + i]];
            for (int v = 0; v < LANES; v += WIDE) {
                const shd_vd by = shd_vd_load(color + v);
                for (int k = 0; k < SHD_FAR_TERMS; k++)
                    shd_vd_store(sums[c][k] + v,
                                 shd_vd_load(sums[c][k] + v) + by * shd_vd_load(d[k] + v));
            }
        }
    }
    for (int c = 0; c < to->channels; c++)
        for (int k = 0; k < SHD_FAR_TERMS; k++) EACH to->terms[c][k] += sums[c][k][i];
    to->lights += count;
}

/* ---- Points. ---- */

/* What each derivative is multiplied by, so that the sum is N.E: the derivative along N of a
 * monomial of h over the factorials of its exponents. */
SHD_INLINE void weigh_terms(const shd_vd h[3], const shd_vd n[3], shd_vd q[SHD_FAR_TERMS]) {
    shd_vd w[20] = {vd(1)};
#pragma GCC unroll 3
    for (int g = 1; g < 4; g++)
#pragma GCC unroll 4
        for (int r = 0; r <= g; r++)
#pragma GCC unroll 4
            for (int z = 0; z <= r; z++) {
                const int x = g - r, y = r - z, c = x ? 0 : y ? 1 : 2;
                w[shd_monomials_below(g) + shd_monomial(r, z)] =
                    w[shd_monomials_below(g - 1) + shd_monomial(r - (c > 0), z - (c > 1))] * h[c] *
                    (1.0 / (x   ? x
                            : y ? y
                                : z));
            }
#pragma GCC unroll 4
    for (int g = 1; g < 5; g++)
#pragma GCC unroll 5
        for (int r = 0; r <= g; r++)
#pragma GCC unroll 5
            for (int z = 0; z <= r; z++) {
                const size_t below = shd_monomials_below(g - 1);
                shd_vd sum = vd(0);
                if (g > r) sum += w[below + shd_monomial(r, z)] * n[0];
                if (r > z) sum += w[below + shd_monomial(r - 1, z)] * n[1];
                if (z) sum += w[below + shd_monomial(r - 1, z - 1)] * n[2];
                q[shd_monomials_below(g) - 1 + shd_monomial(r, z)] = sum;
            }
}

static void light_points(const shd_plan *plan, const shd_far *far, size_t count,
                         const float *const position[3], const float *const low[3],
                         const float *const normal[3], float *const diffuse[3]) {
    const double world = 1 / plan->scale;
    const shd_vec3 from = shd_sub(plan->origin, far->center);
    const double begin[3] = {from.x, from.y, from.z};
    for (size_t first = 0; first < count; first += LANES) {
        const size_t some = count - first < LANES ? count - first : LANES;
        lanes h[3], n[3], sums[3];
        for (int c = 0; c < 3; c++)
            for (size_t i = 0; i < LANES; i++) {
                const size_t at = first + (i < some ? i : some - 1);
                const double p = (double)position[c][at] + (low[0] ? (double)low[c][at] : 0);
                h[c][i] = p * world + begin[c];
                n[c][i] = (double)normal[c][at];
            }
        for (int v = 0; v < LANES; v += WIDE) {
            shd_vd q[SHD_FAR_TERMS];
            const shd_vd at[3] = {shd_vd_load(h[0] + v), shd_vd_load(h[1] + v),
                                  shd_vd_load(h[2] + v)},
                         up[3] = {shd_vd_load(n[0] + v), shd_vd_load(n[1] + v),
                                  shd_vd_load(n[2] + v)};
            weigh_terms(at, up, q);
            for (int c = 0; c < far->channels; c++) {
                shd_vd sum = vd(0);
                for (int k = 0; k < SHD_FAR_TERMS; k++) sum += far->terms[c][k] * q[k];
                shd_vd_store(sums[c] + v, sum);
            }
        }
        for (int c = 0; c < far->channels; c++)
            for (size_t i = 0; i < some; i++) {
                float *out = &diffuse[c][first + i];
                *out = (float)((double)*out + greater(sums[c][i], 0));
            }
    }
}

const shd_far_kernel SHD_VARIANT(shd_far_kernel) = {look_at_lights, add_lights, light_points};
