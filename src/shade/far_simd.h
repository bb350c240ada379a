/* Derivatives of the potential of lights and of bunches, eight at a time: see far.c, which has
 * those of one light. Included by far.simd.c, once for each instruction set. */
#pragma once

#include "base/simd.h"
#include "shade/far.h"
#include "shade/far_terms.h"

/* Lights and points are taken eight at a time whatever the width of vectors, so that sums are the
 * same. */
enum { LANES = 8, WIDE = SHD_W / 2 };

typedef double lanes[LANES];

#define EACH for (int i = 0; i < LANES; i++)

SHD_INLINE shd_vd vd(double a) {
    return shd_vd_set(a);
}

typedef struct rows {
    lanes x, y, z, a, b, c, gain, least, color[3];
    lanes radius; /* of where its light may be; 0: it is one light */
} rows;

static void load_rows(const shd_bunches *bunches, const shd_bunch_row *from, const uint32_t *which,
                      size_t some, rows *r) {
    const bool alike = bunches->roots == 1; /* a tree's lights fall off alike */
    for (size_t i = 0; i < LANES; i++) {
        const shd_bunch_row *row = &from[which[i < some ? i : some - 1]];
        r->x[i] = row->position.x;
        r->y[i] = row->position.y;
        r->z[i] = row->position.z;
        r->gain[i] = row->gain;
        for (int c = 0; c < 3; c++) r->color[c][i] = row->color[c];
        r->radius[i] = row->radius;
        if (alike) continue;
        r->a[i] = row->a;
        r->b[i] = row->b;
        r->c[i] = row->c;
        r->least[i] = row->least;
    }
    if (!alike) return;
    EACH r->a[i] = from->a;
    EACH r->b[i] = from->b;
    EACH r->c[i] = from->c;
    EACH r->least[i] = from->least;
}

/* Of lights, in units of their distances, which `over` is one over. */
SHD_INLINE void derive_lanes(const rows *r, int v, shd_vec3 center, int last,
                             shd_vd all[SHD_FAR_TERMS + 1], shd_vd *distance, shd_vd *out_over) {
    const shd_vd x = shd_vd_load(r->x + v) - center.x, y = shd_vd_load(r->y + v) - center.y,
                 z = shd_vd_load(r->z + v) - center.z, d = shd_vd_sqrt(x * x + y * y + z * z),
                 over = 1 / d, n[3] = {x * over, y * over, z * over};
    const shd_vd a = shd_vd_load(r->a + v) * d, b = shd_vd_load(r->b + v) * d * d,
                 c = shd_vd_load(r->c + v) * d * d * d;
    shd_vd fall[6], g[6];
    for (int k = 0; k < last; k++)
        fall[k] = a * shd_far_root[k] + (k < 2 ? b : vd(0)) + c * shd_far_cube[k];
    const shd_vd part = 1 / fall[0];
    g[0] = shd_vd_load(r->gain + v) * part;
    for (int k = 1; k < last; k++) {
        shd_vd sum = fall[1] * g[k - 1];
        for (int i = 2; i <= k; i++) sum += fall[i] * g[k - i];
        g[k] = -sum * part;
    }
    all[0] = shd_far_factor[last - 1] * g[last - 1];
    UNROLL(6)
    for (int j = last - 1; j >= 0; j--) {
        UNROLL(6)
        for (int degree = last - j; degree > 0; degree--) UNROLL(7)
        for (int s = 0; s <= degree; s++) UNROLL(7)
        for (int k = 0; k <= s; k++) {
            const shd_far_step step = shd_far_step_of(degree, s, k);
            shd_vd sum = -n[step.axis] * all[step.once];
            if (step.times) sum += step.times * all[step.twice];
            all[shd_monomials_below(degree) + shd_monomial(s, k)] = sum;
        }
        if (j) all[0] = shd_far_factor[j - 1] * g[j - 1];
    }
    *distance = d;
    *out_over = over;
}

typedef lanes term_lanes[3][SHD_FAR_TERMS];

/* Adds those of lights, of the color that they have. */
SHD_INLINE void derive_lights(const rows *r, shd_vec3 center, int last, int channels,
                              term_lanes to) {
    for (int v = 0; v < LANES; v += WIDE) {
        shd_vd all[SHD_FAR_TERMS + 1], unit, over;
        derive_lanes(r, v, center, last, all, &unit, &over);
        UNROLL(6)
        for (int degree = 1; degree <= last; degree++, unit *= over)
            for (int color = 0; color < channels; color++) {
                const shd_vd by = shd_vd_load(r->color[color] + v) * unit;
                for (size_t k = shd_monomials_below(degree); k < shd_monomials_below(degree + 1);
                     k++)
                    shd_vd_store(to[color][k - 1] + v,
                                 shd_vd_load(to[color][k - 1] + v) + by * all[k]);
            }
    }
}

/* Adds moments times derivatives of degree up to `last` to those of lower degrees. */
SHD_INLINE void shift_lanes(const lanes *moments, const shd_vd *derived, int v, int last,
                            lanes *to) {
    UNROLL(6)
    for (int from = 1; from <= last; from++) UNROLL(7)
    for (int q = 0; q <= from; q++) UNROLL(7)
    for (int k = 0; k <= q; k++) {
        double *out = to[shd_monomials_below(from) - 1 + shd_monomial(q, k)] + v;
        shd_vd sum = shd_vd_load(out);
        UNROLL(6)
        for (int g = 0; g <= last - from; g++) UNROLL(6)
        for (int r = 0; r <= g; r++) UNROLL(6)
        for (int z = 0; z <= r; z++)
            sum += shd_vd_load(moments[shd_monomials_below(g) + shd_monomial(r, z)] + v) *
                   derived[shd_monomials_below(from + g) + shd_monomial(q + r, k + z)];
        shd_vd_store(out, sum);
    }
}

/* The same of all lights of bunches, by their moments. */
SHD_INLINE void derive_bunches(const shd_bunches *bunches, const uint32_t *which, size_t some,
                               shd_vec3 center, int last, int channels, term_lanes to) {
    const size_t count = shd_monomials_below(last);
    rows r;
    lanes moments[SHD_BUNCH_MOMENTS];
    load_rows(bunches, bunches->wholes, which, some, &r);
    for (int v = 0; v < LANES; v += WIDE) {
        shd_vd all[SHD_FAR_TERMS + 1], unit, over;
        derive_lanes(&r, v, center, last, all, &unit, &over);
        UNROLL(6)
        for (int degree = 1; degree <= last; degree++, unit *= over)
            for (size_t k = shd_monomials_below(degree); k < shd_monomials_below(degree + 1); k++)
                all[k] *= unit;
        for (int c = 0; c < channels; c++) {
            for (size_t i = (size_t)v; i < (size_t)v + WIDE; i++) {
                const double *from = bunches->list[which[i < some ? i : 0]].moments[c];
                for (size_t k = 0; k < count; k++) moments[k][i] = i < some ? from[k] : 0;
            }
            shift_lanes(moments, all, v, last, to[c]);
        }
    }
}
