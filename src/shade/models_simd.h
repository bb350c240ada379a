/* The models of shade/brdf.h in vectors, of points and of directions alike. Only for *.simd.c of
 * shade/. */
#pragma once

#include <float.h>
#include <math.h>

#include "shade/lights_simd.h"

SHD_INLINE shd_vd smaller_of(shd_vd a, shd_vd b) {
    return shd_vd_select(shd_vd_gt(a, b), b, a);
}

/* A point, light from `toward` and what models make of both. */
typedef struct pairing {
    shd_vd nv;    /* N.V */
    shd_vd lv;    /* |L + V|^2 */
    shd_vd apart; /* |L - V|^2 */
    shd_vd off;   /* 1 - N.H, 2 if there is no H */
} pairing;

SHD_INLINE pairing pair_lanes(const points *at, const shd_vd toward[3]) {
    const shd_vd zero = shd_vd_set(0), one = shd_vd_set(1);
    shd_vd sum[3], difference[3], beside[3];
    for (int c = 0; c < 3; c++) {
        sum[c] = toward[c] + at->v[c];
        difference[c] = toward[c] - at->v[c];
    }
    pairing p = {.nv = dot_lanes(at->n, at->v),
                 .lv = dot_lanes(sum, sum),
                 .apart = dot_lanes(difference, difference)};
    const shd_md bisects = shd_vd_gt(p.lv, zero);
    const shd_vd inverse = one / shd_vd_sqrt(shd_vd_select(bisects, p.lv, one));
    for (int c = 0; c < 3; c++) beside[c] = sum[c] * inverse - at->n[c];
    p.off = shd_vd_select(bisects, dot_lanes(beside, beside) * shd_vd_set(0.5), shd_vd_set(2));
    return p;
}

/* ---- Diffuse ---- */

SHD_INLINE shd_vd weigh_diffuse(const shd_plan_material *m, shd_vd facing, const pairing *p) {
    if (m->model != SHD_MODEL_OREN_NAYAR) return facing;
    const double square = m->from->sigma * m->from->sigma, a = 1 - square / (2 * (square + 0.33)),
                 b = 0.45 * square / (square + 0.09);
    const shd_vd zero = shd_vd_set(0), view = shd_vd_max(p->nv, zero),
                 between = shd_vd_set(1) - p->apart * shd_vd_set(0.5),
                 along = shd_vd_max(between - facing * view, zero),
                 rough = along / shd_vd_max(facing, view);
    return facing * (shd_vd_set(a) + shd_vd_set(b) * rough);
}

/* ---- Normalized Phong lobes ---- */

/* pi N.L / E(N.L, n). */
SHD_INLINE shd_vd normalize_lobe(const shd_packed_energy *e, shd_vd facing) {
    const shd_vd one = shd_vd_set(1), c = smaller_of(facing, one), kappa = shd_vd_set(e->kappa);
    const shd_vd t = (kappa - c) / (kappa + c),
                 x = (t - shd_vd_set(e->middle)) * shd_vd_set(e->twice);
    shd_vd b1 = shd_vd_set(0), b2 = b1; /* Clenshaw: x is doubled */
    for (int k = SHD_ENERGY_TERMS - 1; k > 0; k--) {
        const shd_vd b = shd_vd_set(e->terms[k]) + x * b1 - b2;
        b2 = b1;
        b1 = b;
    }
    const shd_vd psi = shd_vd_set(e->terms[0]) + x * b1 * shd_vd_set(0.5) - b2;
    const shd_vd log = shd_log1m64(below_one(c * c)) * shd_vd_set(e->half + 1);
    const shd_vd fall = shd_exp64(shd_vd_max(log, shd_vd_set(-700)));
    return shd_vd_set(SHD_PI * (2 * e->half + 2)) * c /
           (shd_vd_set(2 * SHD_PI) * c + shd_vd_set(e->beta) * fall * psi);
}

/* ---- Facets of Cook-Torrance ---- */

/* The mean of both polarizations, where a + ib is the root of what the index squared is more than
 * s2, the square of the sine; c and c2: the cosine, and its square. */
SHD_INLINE shd_vd share_of_both(shd_vd a, shd_vd b, shd_vd c, shd_vd c2, shd_vd s2) {
    const shd_vd b2 = b * b, least = shd_vd_set(0x1p-1000);
    const shd_vd across = ((a - c) * (a - c) + b2) / shd_vd_max((a + c) * (a + c) + b2, least);
    const shd_vd ac = a * c, rest = b2 * c2,
                 along = ((ac - s2) * (ac - s2) + rest) /
                         shd_vd_max((ac + s2) * (ac + s2) + rest, least);
    return across * shd_vd_set(0.5) * (shd_vd_set(1) + along);
}

/* As shd_fresnel_reflectance. */
SHD_INLINE shd_vd mirror_lanes(double n, double k, shd_vd c2, shd_vd s2) {
    const shd_vd zero = shd_vd_set(0), half = shd_vd_set(0.5);
    if (isinf(n)) return shd_vd_set(1);
    const shd_vd c = shd_vd_sqrt(c2), real = shd_vd_set((n - k) * (n + k)) - s2,
                 size = shd_vd_sqrt(real * real + shd_vd_set(4 * n * k * n * k)),
                 large = shd_vd_sqrt((size + shd_vd_max(real, -real)) * half),
                 some = shd_vd_max(large, shd_vd_set(0x1p-500)), small = shd_vd_set(n * k) / some;
    const shd_md inside = shd_vd_gt(zero, real);
    const shd_vd a = shd_vd_select(inside, small, large), b = shd_vd_select(inside, large, small);
    return share_of_both(a, b, c, c2, s2);
}

/* The same of an index for each lane, without absorption and of 1 or more, infinite too: to the bit
 * what mirror_lanes makes of it. */
SHD_INLINE shd_vd mirror_each(shd_vd n, shd_vd c2, shd_vd s2) {
    const shd_vd zero = shd_vd_set(0), one = shd_vd_set(1);
    const shd_md whole = shd_vd_gt(n, shd_vd_set(DBL_MAX));
    const shd_vd some = shd_vd_select(whole, one, n), square = some * some;
    const shd_vd c = shd_vd_sqrt(c2), real = square - s2,
                 large = shd_vd_sqrt(shd_vd_max(real, -real));
    const shd_md inside = shd_vd_gt(zero, real);
    const shd_vd a = shd_vd_select(inside, zero, large), b = shd_vd_select(inside, large, zero);
    return shd_vd_select(whole, one, share_of_both(a, b, c, c2, s2));
}

/* Lanes in which facets are lit and seen. */
SHD_INLINE shd_md see_facets(shd_md lit, const pairing *p) {
    const shd_vd zero = shd_vd_set(0), nh = shd_vd_set(1) - p->off;
    return shd_vd_gt_in(shd_vd_gt_in(shd_vd_gt_in(lit, p->nv, zero), nh, zero), p->lv, zero);
}

/* What of facets is the same for all lobes, where they are seen. */
typedef struct facets {
    shd_vd open;    /* G / N.V */
    shd_vd tangent; /* the square of that of the angle between N and H */
    shd_vd nh2;     /* (N.H)^2 */
} facets;

SHD_INLINE facets face_lanes(shd_vd facing, const pairing *p) {
    const shd_vd one = shd_vd_set(1), two = shd_vd_set(2), nh = one - p->off;
    const shd_vd vh = shd_vd_sqrt(p->lv) * shd_vd_set(0.5), inverse = one / p->nv, nh2 = nh * nh;
    const shd_vd open =
        smaller_of(smaller_of(inverse, two * nh / vh), two * nh * facing / (vh * p->nv));
    return (facets){open, p->off * (two - p->off) / nh2, nh2};
}

/* D G / (4 N.V) of facets whose RMS slope is `roughness`, in each lane. */
SHD_INLINE shd_vd weigh_slopes(const facets *f, shd_vd roughness) {
    const shd_vd slope = roughness * roughness,
                 power = shd_vd_max(-f->tangent / slope, shd_vd_set(-700));
    return shd_exp64(power) / (shd_vd_set(4) * slope * (f->nh2 * f->nh2)) * f->open;
}

/* The same of one for all lanes. */
SHD_INLINE shd_vd weigh_slope(const facets *f, double roughness) {
    return weigh_slopes(f, shd_vd_set(roughness));
}
