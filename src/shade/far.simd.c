/* Many lights at one patch, and one polynomial at many points. Loops go over lanes, which compilers
 * make vectors of. Compiled once for each instruction set; all variants give the same bits. */
#include <math.h>
#include <string.h>

#include "shade/far_simd.h"

enum { SLOWLY = 6 /* squarings of exp */ };

static const double MARGIN = 1e-6; /* as bound/light/pieces.h has it */

static inline double greater(double a, double b) {
    return a > b ? a : b;
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

/* See far.c, which these are of. */
SHD_INLINE shd_vd power_vd(shd_vd x, int m) {
    shd_vd power = x * x * x;
    for (int k = 3; k < m; k++) power *= x;
    return power;
}

SHD_INLINE shd_vd pure_tail(shd_vd x, double n, int m) {
    const shd_vd left = 1 - x;
    return power_vd(x, m) * ((m + n) * left + x) / (left * left);
}

SHD_INLINE shd_vd mixed_tail(shd_vd linear, shd_vd square, shd_vd x, int m) {
    const shd_vd q1 = linear + 2 * square, q2 = linear + square, q3 = linear,
                 q = linear * x / (1 - x) + square * x * (2 + x);
    const shd_vd i1 = q1, i2 = q2 + q1 * q1, i3 = q3 + 2 * q1 * q2 + q1 * q1 * q1;
    const shd_vd p1 = 1 + i1, p2 = p1 + i2, p3 = p2 + i3;
    const shd_vd whole = (1 + x) / ((1 - x) * (1 - q));
    const shd_vd cube = m > 3 ? p2 + p3 : vd(0),
                 rest = whole - (1 + x * (1 + p1 + x * (p1 + p2 + x * cube))) + 1e-14 * whole;
    return where(vd(0.9), q, rest, vd(INFINITY));
}

typedef struct looks {
    lanes front, rest, told, gleam, certain, most;
} looks;

SHD_INLINE shd_vd tail_of(shd_vd a, shd_vd b, shd_vd c, shd_vd linear, shd_vd square, shd_vd t,
                          int m) {
    const shd_vd zero = vd(0), one = vd(1),
                 mixed = where(a + b, zero, where(a + c, zero, one, zero), zero);
    shd_vd tail = zero;
    if (shd_md_bits(shd_vd_gt(mixed, zero))) tail = mixed_tail(linear, square, t, m);
    tail = where(a + c, zero, tail, 2 * pure_tail(t, 0.5, m));
    tail = where(a + b, zero, tail, pure_tail(t, 1.5, m));
    return where(b + c, zero, tail, 2 * power_vd(t, m) / (1 - t));
}

/* What light of `fall` shows of the lobes at most, by channel. (R.V)^ns is at most exp(-x), x = ns
 * (1 - R.V), and that (1 + x / 2^n)^-2^n. */
SHD_INLINE void bound_lobes(const shd_far_patch *p, shd_vd shine, shd_vd fall, shd_vd to[3]) {
    for (int c = 0; c < 3; c++) to[c] = vd(0);
    for (size_t k = 0; k < p->lobe_count; k++) {
        shd_vd power = 1 / (1 + p->shininess[k] / (1 << SLOWLY) * greater_vd(1 - shine, vd(0)));
        for (int n = 0; n < SLOWLY; n++) power *= power;
        power = power * (1 + MARGIN) * fall;
        for (int c = 0; c < 3; c++) to[c] += p->specular[k][c] * power;
    }
}

/* What the color is off by if N.E is off by `off`, and lobes are left out: that of the channel that
 * is worst off. */
SHD_INLINE shd_vd weigh_colors(const shd_far_patch *p, const rows *r, int v, shd_vd off,
                               const shd_vd lobes[3], shd_vd *gleam) {
    const shd_vd zero = vd(0);
    shd_vd rest = zero;
    *gleam = zero;
    for (int c = 0; c < 3; c++) {
        const shd_vd color = shd_vd_load(r->color[c] + v);
        /* Infinite is not to be multiplied: 0 times that is not a number. */
        const shd_vd left = p->diffuse[c] > 0 ? p->diffuse[c] * off + lobes[c] : lobes[c];
        rest = greater_vd(rest, where(color, zero, color * left, zero));
        *gleam = greater_vd(*gleam, where(color, zero, color * lobes[c], zero));
    }
    return rest;
}

/* What the series leaves out of N.E of a light at distance d that sends `most` at most; infinite:
 * it may not be used. */
SHD_INLINE shd_vd bound_rest(const shd_far_patch *p, const rows *r, int v, shd_vd d, shd_vd wide,
                             shd_vd nearest, shd_vd most) {
    static const double ROUNDING = 1e-12, WIDEST = 0.4;
    const shd_vd a = shd_vd_load(r->a + v), b = shd_vd_load(r->b + v), c = shd_vd_load(r->c + v),
                 gain = shd_vd_load(r->gain + v), bend = shd_vd_load(r->least + v);
    const shd_vd zero = vd(0), none = vd(INFINITY);
    const shd_vd q = wide * (1 + 1e-9), t = where(vd(WIDEST), q, q, zero), linear = d * b,
                 square = d * d * c, all = a + linear + square;
    shd_vd rest = (tail_of(a, b, c, linear / all, square / all, t, p->degree) + ROUNDING) *
                  (gain / all) * (1 + MARGIN);
    rest = where(vd(WIDEST), q, rest, none);
    rest = where(where(b + c, zero, nearest, none), bend * (1 + 1e-9), rest, none);
    return where(vd(SHD_LARGEST_FALL), most, rest, none);
}

static void look_at_lanes(const shd_far_patch *p, const rows *r, looks *out) {
    static const double CLEAR = 1e-4, NEAREST = 1e-30, FARTHEST = 1e30, NEAR = 0.9;
    const shd_vd zero = vd(0), one = vd(1), none = vd(INFINITY);
    for (int v = 0; v < LANES; v += WIDE) {
        const shd_vd x = shd_vd_load(r->x + v) - p->center.x,
                     y = shd_vd_load(r->y + v) - p->center.y,
                     z = shd_vd_load(r->z + v) - p->center.z,
                     d = shd_vd_sqrt(x * x + y * y + z * z), over = 1 / d,
                     radius = shd_vd_load(r->radius + v) + p->radius, wide = radius * over;
        shd_vd known = where(one, wide, one, zero); /* where the patch is not around the light */
        known = where(d, vd(NEAREST), known, zero);
        known = where(vd(FARTHEST), d, known, zero);
        const shd_vd cosine = shd_vd_sqrt(where(known, zero, 1 - wide * wide, zero));
        const shd_vd toward = (x * p->axis.x + y * p->axis.y + z * p->axis.z) * over;
        shd_vd by_cosine, by_sine, high, low, shine = one, dull;
        add_angles(cosine, wide, p->spread, known, &by_cosine, &by_sine);
        turn_angle(toward, by_cosine, by_sine, &high, &low);
        if (p->lobe_count) {
            const shd_vd mirrored = (x * p->mirror.x + y * p->mirror.y + z * p->mirror.z) * over;
            add_angles(cosine, wide, p->glitter, known, &by_cosine, &by_sine);
            turn_angle(mirrored, by_cosine, by_sine, &shine, &dull);
        }
        high = where(known, zero, lesser_vd(high, one), one);
        low = where(known, zero, low, zero);
        shine = where(known, zero, shine, one);

        const shd_vd a = shd_vd_load(r->a + v), b = shd_vd_load(r->b + v),
                     c = shd_vd_load(r->c + v), gain = shd_vd_load(r->gain + v),
                     bend = shd_vd_load(r->least + v);
        const shd_vd nearest = greater_vd(d - radius, zero), near = greater_vd(nearest, bend),
                     far = greater_vd(d + radius, bend);
        const shd_vd most = gain / (a + near * (b + near * c)),
                     least = gain / (a + far * (b + far * c)),
                     fall = lesser_vd(most, vd(SHD_LARGEST_FALL)) * (1 + MARGIN);
        shd_vd rest = bound_rest(p, r, v, d, wide, nearest, most);
        /* Where N.L may be below 0 the sum has that, too. */
        rest += fall * greater_vd(CLEAR - low, zero);
        rest = where(known, zero, rest, none);
        const shd_vd whole = fall * greater_vd(high, zero), /* if it is left out altogether */
            off = where(where(vd(NEAR), wide, rest, whole), whole, whole, rest);
        shd_vd lobes[3], gleam;
        bound_lobes(p, shine, fall, lobes);
        shd_vd_store(out->front + v, where(high, zero, one, zero));
        shd_vd_store(out->rest + v, weigh_colors(p, r, v, off, lobes, &gleam));
        shd_vd_store(out->gleam + v, gleam);
        shd_vd_store(out->told + v, where(rest, off, zero, where(none, rest, one, zero)));
        shd_vd_store(out->certain + v, where(low, vd(CLEAR), least * (1 - MARGIN) * low, zero));
        shd_vd_store(out->most + v, whole);
    }
}

static void store_looks(const looks *l, size_t some, shd_far_look *out) {
    for (size_t i = 0; i < some; i++)
        out[i] = (shd_far_look){.rest = l->rest[i],
                                .behind = !(l->front[i] > 0),
                                .told = l->told[i] > 0,
                                .gleam = l->gleam[i],
                                .certain = l->certain[i],
                                .most = l->most[i]};
}

static void look_at_bunches(const shd_bunches *bunches, const shd_far_patch *patch,
                            const uint32_t *which, size_t count, shd_far_look *out) {
    for (size_t first = 0; first < count; first += LANES) {
        const size_t some = count - first < LANES ? count - first : LANES;
        rows r;
        looks l;
        load_rows(bunches, bunches->wholes, which + first, some, &r);
        look_at_lanes(patch, &r, &l);
        store_looks(&l, some, out + first);
    }
}

static void look_at_lights(const shd_bunches *bunches, const shd_far_patch *patch,
                           const uint32_t *which, size_t count, shd_far_look *out,
                           shd_far_sums *sums) {
    lanes least[3] = {{0}}, most = {0};
    for (size_t first = 0; first < count; first += LANES) {
        const size_t some = count - first < LANES ? count - first : LANES;
        rows r;
        looks l;
        load_rows(bunches, bunches->rows, which + first, some, &r);
        for (size_t i = some; i < LANES; i++) r.color[0][i] = r.color[1][i] = r.color[2][i] = 0;
        look_at_lanes(patch, &r, &l);
        for (int v = 0; v < LANES; v += WIDE) {
            const shd_vd certain = shd_vd_load(l.certain + v), zero = vd(0);
            shd_vd brightest = zero;
            for (int c = 0; c < 3; c++) {
                const shd_vd color = shd_vd_load(r.color[c] + v);
                shd_vd_store(least[c] + v, shd_vd_load(least[c] + v) + certain * color);
                brightest = greater_vd(brightest, color);
            }
            shd_vd_store(most + v, shd_vd_load(most + v) + shd_vd_load(l.most + v) * brightest);
        }
        store_looks(&l, some, out + first);
    }
    for (int c = 0; c < 3; c++) EACH sums->least[c] += least[c][i];
    EACH sums->most += most[i];
}

/* ---- Sums of derivatives. ---- */

SHD_INLINE void end_terms(term_lanes sums, int terms, shd_far *to) {
    for (int c = 0; c < to->channels; c++)
        for (int k = 0; k < terms; k++) EACH to->terms[c][k] += sums[c][k][i];
}

SHD_INLINE void add_terms(int degree, const shd_bunches *bunches, const uint32_t *which,
                          size_t count, shd_far *to) {
    const int terms = (int)shd_monomials_below(degree + 1) - 1;
    term_lanes sums;
    for (int c = 0; c < to->channels; c++) memset(sums[c], 0, (size_t)terms * sizeof(lanes));
    for (size_t first = 0; first < count; first += LANES) {
        const size_t some = count - first < LANES ? count - first : LANES;
        rows r;
        load_rows(bunches, bunches->rows, which + first, some, &r);
        for (int c = 0; c < to->channels; c++)
            for (size_t i = some; i < LANES; i++) r.color[c][i] = 0;
        derive_lights(&r, to->center, degree, to->channels, sums);
    }
    end_terms(sums, terms, to);
    to->lights += count;
}

SHD_INLINE void add_moments(int degree, const shd_bunches *bunches, const uint32_t *which,
                            size_t count, shd_far *to) {
    const int terms = (int)shd_monomials_below(degree + 1) - 1;
    term_lanes sums;
    for (int c = 0; c < to->channels; c++) memset(sums[c], 0, (size_t)terms * sizeof(lanes));
    for (size_t first = 0; first < count; first += LANES)
        derive_bunches(bunches, which + first, count - first < LANES ? count - first : LANES,
                       to->center, degree, to->channels, sums);
    end_terms(sums, terms, to);
    for (size_t i = 0; i < count; i++)
        to->lights += bunches->list[which[i]].end - bunches->list[which[i]].first;
}

static void add_lights(const shd_bunches *bunches, const uint32_t *which, size_t count,
                       shd_far *to) {
    BY_DEGREE(to->degree, add_terms, bunches, which, count, to);
}

static void add_bunches(const shd_bunches *bunches, const uint32_t *which, size_t count,
                        shd_far *to) {
    if (!count) return;
    BY_DEGREE(to->degree, add_moments, bunches, which, count, to);
}

/* ---- Points. ---- */

/* What each derivative is multiplied by, so that the sum is N.E: the derivative along N of a
 * monomial of h over the factorials of its exponents. */
SHD_INLINE void weigh_terms(const shd_vd h[3], const shd_vd n[3], int degree,
                            shd_vd q[SHD_FAR_TERMS]) {
    shd_vd w[SHD_BUNCH_MOMENTS] = {vd(1)};
    UNROLL(5)
    for (int g = 1; g < degree; g++) UNROLL(6)
    for (int r = 0; r <= g; r++) UNROLL(6)
    for (int z = 0; z <= r; z++) {
        const int x = g - r, y = r - z, c = x ? 0 : y ? 1 : 2;
        w[shd_monomials_below(g) + shd_monomial(r, z)] =
            w[shd_monomials_below(g - 1) + shd_monomial(r - (c > 0), z - (c > 1))] * h[c] *
            (1.0 / (x   ? x
                    : y ? y
                        : z));
    }
    UNROLL(6)
    for (int g = 1; g <= degree; g++) UNROLL(7)
    for (int r = 0; r <= g; r++) UNROLL(7)
    for (int z = 0; z <= r; z++) {
        const size_t below = shd_monomials_below(g - 1);
        shd_vd sum = vd(0);
        if (g > r) sum += w[below + shd_monomial(r, z)] * n[0];
        if (r > z) sum += w[below + shd_monomial(r - 1, z)] * n[1];
        if (z) sum += w[below + shd_monomial(r - 1, z - 1)] * n[2];
        q[shd_monomials_below(g) - 1 + shd_monomial(r, z)] = sum;
    }
}

SHD_INLINE void light_by(int degree, const shd_plan *plan, const shd_far *far, size_t count,
                         const float *const position[3], const float *const low[3],
                         const float *const normal[3], float *const diffuse[3]) {
    const int terms = (int)shd_monomials_below(degree + 1) - 1;
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
            weigh_terms(at, up, degree, q);
            for (int c = 0; c < far->channels; c++) {
                shd_vd sum = vd(0);
                for (int k = 0; k < terms; k++) sum += far->terms[c][k] * q[k];
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

static void light_points(const shd_plan *plan, const shd_far *far, size_t count,
                         const float *const position[3], const float *const low[3],
                         const float *const normal[3], float *const diffuse[3]) {
    BY_DEGREE(far->degree, light_by, plan, far, count, position, low, normal, diffuse);
}

const shd_far_kernel SHD_VARIANT(shd_far_kernel) = {look_at_lights, look_at_bunches, add_lights,
                                                    add_bunches, light_points};
