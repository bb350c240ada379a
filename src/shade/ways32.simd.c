/* One term's weights of light from many directions at one point, in f32, without fused products.
 * Compiled once for each instruction set; tests/unit/shade_around.c holds what quick walks make of
 * them against shade/brdf.h. */
#include "shade/ways32.h"

#include <math.h>
#include <string.h>

#include "base/cpu.h"
#include "shade/plain_simd.h"

enum { STEP = SHD_WAYS32_STEP, MOST = SHD_WAYS32_MOST };

/* Where N.H is less, facets that face there are none (tan^2 is 10^8). */
static const float LEAST_NH = 1e-4F;

/* ---- Sums. ---- */

/* Adds products of values and weights, in the order of sixteen lanes on every machine. */
SHD_INLINE void sum_weights(const shd_ways32 *w, const float *values, int count, double out[3]) {
    enum { PARTS = STEP / SHD_W };
    shd_vf sums[3][PARTS];
    for (int k = 0; k < count; k++)
        for (int h = 0; h < PARTS; h++) sums[k][h] = shd_vf_set(0);
    for (size_t i = 0; i < w->points; i += STEP)
        for (size_t h = 0; h < PARTS; h++) {
            const shd_vf value = shd_vf_load(values + i + h * SHD_W);
            for (int k = 0; k < count; k++)
                sums[k][h] += shd_vf_load(w->weight[k] + i + h * SHD_W) * value;
        }
    for (int k = 0; k < count; k++) {
        float lanes[STEP];
        memcpy(lanes, sums[k], sizeof lanes);
        for (int half = STEP / 2; half > 0; half /= 2)
            for (int i = 0; i < half; i++) lanes[i] += lanes[i + half];
        out[k] = (double)lanes[0] * (1 / SHD_PI);
    }
}

SHD_INLINE void sum_values(const shd_ways32 *w, const float *values, double out[3]) {
    if (!w->grey) {
        sum_weights(w, values, 3, out);
        return;
    }
    sum_weights(w, values, 1, out);
    out[1] = out[2] = out[0];
}

SHD_INLINE void add_row(const double sums[3], double out[SHD_WAY_SUMS]) {
    for (int k = 0; k < 3; k++) out[k] += sums[k];
}

SHD_INLINE void add_grey(const shd_ways32 *w, const float *values, double (*out)[SHD_WAY_SUMS]) {
    double sums[3];
    sum_values(w, values, sums);
    for (int c = 0; c < 3; c++) add_row(sums, out[c]);
}

/* ---- Models. ---- */

typedef struct place {
    shd_vf n[3], v[3], w[3];
    float view; /* N.V */
} place;

SHD_INLINE void spread(shd_vec3 v, shd_vf out[3]) {
    out[0] = shd_vf_set((float)v.x);
    out[1] = shd_vf_set((float)v.y);
    out[2] = shd_vf_set((float)v.z);
}

SHD_INLINE place place_at(const shd_surface *at) {
    place out = {.view = (float)shd_dot(at->normal, at->view)};
    spread(at->normal, out.n);
    spread(at->view, out.v);
    spread(at->mirror, out.w);
    return out;
}

SHD_INLINE void load_way(const shd_ways32 *w, size_t i, shd_vf toward[3]) {
    for (int c = 0; c < 3; c++) toward[c] = shd_vf_load(w->toward[c] + i);
}

/* |a - b|^2 */
SHD_INLINE shd_vf apart_of(const shd_vf a[3], const shd_vf b[3]) {
    const shd_vf off[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    return dot_lanes(off, off);
}

typedef struct halfway {
    shd_vf square, inverse; /* |L + V|^2, and 1 / |L + V| */
    shd_vf off;             /* 1 - N.H */
} halfway;

SHD_INLINE halfway halve_way(const place *at, const shd_vf toward[3]) {
    const shd_vf sum[3] = {toward[0] + at->v[0], toward[1] + at->v[1], toward[2] + at->v[2]};
    halfway h = {.square = shd_vf_max(dot_lanes(sum, sum), shd_vf_set(1e-12F))};
    h.inverse = shd_vf_set(1) / shd_vf_sqrt(h.square);
    const shd_vf middle[3] = {sum[0] * h.inverse, sum[1] * h.inverse, sum[2] * h.inverse};
    h.off = apart_of(middle, at->n) * shd_vf_set(0.5F);
    return h;
}

SHD_INLINE void sum_rough(const shd_way_point *p, const shd_ways32 *w, const place *at,
                          float *values, double (*out)[SHD_WAY_SUMS]) {
    const double sigma = p->at->material->from->sigma, square = sigma * sigma;
    const shd_vf a = shd_vf_set((float)(1 - square / (2 * (square + 0.33)))),
                 b = shd_vf_set((float)(0.45 * square / (square + 0.09))), zero = shd_vf_set(0),
                 view = shd_vf_set(fmaxf(at->view, 0));
    for (size_t i = 0; i < w->points; i += SHD_W) {
        shd_vf toward[3];
        load_way(w, i, toward);
        const shd_vf facing = dot_lanes(at->n, toward),
                     between = shd_vf_set(1) - apart_of(toward, at->v) * shd_vf_set(0.5F),
                     along = shd_vf_max(between - facing * view, zero),
                     more = shd_vf_max(shd_vf_max(facing, view), shd_vf_set(1e-30F));
        shd_vf_store(values + i,
                     shd_vf_mul_in(shd_vf_gt(facing, zero), facing, a + b * (along / more)));
    }
    add_grey(w, values, out);
}

/* pi N.L / E(N.L, n): as models_simd.h has it. */
SHD_INLINE shd_vf normalize(const shd_packed_energy *e, int terms, shd_vf facing) {
    const shd_vf one = shd_vf_set(1), c = smaller_of(facing, one),
                 kappa = shd_vf_set((float)e->kappa);
    const shd_vf x = (kappa - c) / (kappa + c) * shd_vf_set((float)e->twice) -
                     shd_vf_set((float)(e->middle * e->twice));
    shd_vf b1 = shd_vf_set(0), b2 = b1; /* Clenshaw: x is doubled */
    for (int k = terms - 1; k > 0; k--) {
        const shd_vf b = shd_vf_set((float)e->terms[k]) + x * b1 - b2;
        b2 = b1;
        b1 = b;
    }
    const shd_vf psi = shd_vf_set((float)e->terms[0]) + x * b1 * shd_vf_set(0.5F) - b2,
                 fall = power_of_two(log_below(c * c) * shd_vf_set((float)(e->half + 1)));
    return shd_vf_set((float)(SHD_PI * (2 * e->half + 2))) * c /
           (shd_vf_set((float)(2 * SHD_PI)) * c + shd_vf_set((float)e->beta) * fall * psi);
}

/* As many terms of the series as f32 knows from nothing. */
static int count_terms(const shd_packed_energy *e) {
    int count = 1;
    for (int k = 1; k < SHD_ENERGY_TERMS; k++)
        if (fabs(e->terms[k]) > 1e-6 * fabs(e->terms[0])) count = k + 1;
    return count;
}

SHD_INLINE void sum_shine(const shd_way_point *p, const shd_ways32 *w, const place *at,
                          float *values, double (*out)[SHD_WAY_SUMS]) {
    const shd_vf zero = shd_vf_set(0), half = shd_vf_set(0.5F), one = shd_vf_set(1),
                 exponent = shd_vf_set((float)p->at->material->lobes[0].shininess);
    const int terms = p->energies ? count_terms(p->energies) : 0;
    const bool halved = p->at->material->model == SHD_MODEL_BLINN_PHONG;
    for (size_t i = 0; i < w->points; i += SHD_W) {
        shd_vf toward[3];
        load_way(w, i, toward);
        const shd_vf facing = dot_lanes(at->n, toward),
                     off = halved ? halve_way(at, toward).off : apart_of(toward, at->w) * half;
        const shd_mf lit = shd_vf_gt_in(shd_vf_gt(facing, zero), one, off);
        shd_vf power = power_of_two(log_below(off) * exponent);
        if (p->energies) power *= normalize(p->energies, terms, shd_vf_max(facing, zero));
        shd_vf_store(values + i, shd_vf_mul_in(lit, power, one));
    }
    add_grey(w, values, out);
}

/* What a channel mirrors: s2 = 1 - c2 is of the angle between L and H. As shd_fresnel_reflectance,
 * with one division for both directions. */
SHD_INLINE shd_vf mirrored(double n, double k, shd_vf c2, shd_vf s2, shd_vf c) {
    const shd_vf zero = shd_vf_set(0), half = shd_vf_set(0.5F), least = shd_vf_set(1e-15F);
    const float both = (float)(n * k);
    const shd_vf real = shd_vf_set((float)((n - k) * (n + k))) - s2,
                 size = shd_vf_sqrt(real * real + shd_vf_set(4 * both * both)),
                 large = shd_vf_sqrt((size + shd_vf_max(real, -real)) * half),
                 small = shd_vf_set(both) / shd_vf_max(large, least);
    const shd_mf inside = shd_vf_gt(zero, real);
    const shd_vf a = shd_vf_select(inside, small, large), b = shd_vf_select(inside, large, small),
                 b2 = b * b, rest = b2 * c2, ac = a * c;
    const shd_vf less = (a - c) * (a - c) + b2, more = shd_vf_max((a + c) * (a + c) + b2, least),
                 along = (ac - s2) * (ac - s2) + rest,
                 whole = shd_vf_max((ac + s2) * (ac + s2) + rest, least);
    return half * less * (along + whole) / (more * whole);
}

SHD_INLINE void sum_facets(const shd_way_point *p, const shd_ways32 *w, const place *at,
                           float *values, double (*out)[SHD_WAY_SUMS]) {
    shd_fresnel own;
    const shd_fresnel *of = shd_index_at(p->at, &own);
    const double m = p->at->material->lobes[0].shininess;
    const shd_vf zero = shd_vf_set(0), one = shd_vf_set(1), quarter = shd_vf_set(0.25F),
                 inverse = shd_vf_set(1 / at->view),
                 steep = shd_vf_set((float)(-1.4426950408889634 / (m * m))),
                 scale = shd_vf_set((float)(1 / (4 * m * m)));
    float c2[MOST], s2[MOST], c1[MOST], seen[MOST];
    for (size_t i = 0; i < w->points; i += SHD_W) {
        shd_vf toward[3];
        load_way(w, i, toward);
        const shd_vf facing = dot_lanes(at->n, toward);
        const halfway h = halve_way(at, toward);
        const shd_vf nh = one - h.off, some = shd_vf_max(nh, shd_vf_set(LEAST_NH)),
                     by = one / (some * some),
                     tangent = h.off * (one + some) * by, /* (1 - N.H^2) / N.H^2 */
            share = smaller_of(one, facing * inverse),
                     open = smaller_of(inverse, shd_vf_set(4) * nh * h.inverse * share);
        const shd_mf lit = shd_vf_gt_in(shd_vf_gt(facing, zero), nh, shd_vf_set(LEAST_NH));
        shd_vf_store(values + i,
                     shd_vf_mul_in(lit, power_of_two(tangent * steep) * scale, by * by * open));
        shd_vf_store(c2 + i, h.square * quarter);
        shd_vf_store(s2 + i, apart_of(toward, at->v) * quarter);
        shd_vf_store(c1 + i, h.square * h.inverse * shd_vf_set(0.5F));
    }
    double sums[3] = {0};
    for (int c = 0; c < 3; c++) {
        if (c == 0 || of->n[c] != of->n[c - 1] || of->k[c] != of->k[c - 1]) {
            for (size_t i = 0; i < w->points; i += SHD_W)
                shd_vf_store(seen + i, shd_vf_load(values + i) *
                                           mirrored(of->n[c], of->k[c], shd_vf_load(c2 + i),
                                                    shd_vf_load(s2 + i), shd_vf_load(c1 + i)));
            sum_values(w, seen, sums);
        }
        add_row(sums, out[c]);
    }
}

void SHD_VARIANT(shd_sum_ways32)(const shd_way_point *p, shd_ways32 *w,
                                 double (*out)[SHD_WAY_SUMS]) {
    const place at = place_at(p->at);
    float values[MOST];
    if (!w->points) return;
    for (; w->points % STEP; w->points++)
        for (int c = 0; c < 3; c++) {
            w->toward[c][w->points] = w->toward[c][w->points - 1];
            w->weight[c][w->points] = 0;
        }
    switch (p->at->material->model) {
    case SHD_MODEL_OREN_NAYAR:
        sum_rough(p, w, &at, values, out);
        break;
    case SHD_MODEL_COOK_TORRANCE:
        sum_facets(p, w, &at, values, out + 3);
        break;
    default:
        sum_shine(p, w, &at, values, out + 3);
    }
    w->points = 0;
}
