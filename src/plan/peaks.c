/* Weights of light of 1, from N.L = c, seen at N.V = v:
 *
 * Lambert: c, whose integral is pi. Phong: (R.V)^n, at most 2 pi / (n + 1) over the hemisphere of
 * R, which all directions before the surface are. Blinn: (N.H)^n; as dw = 4 V.H dw_H, four times
 * that, and no more than the hemisphere's own 2 pi. Normalized: pi c / E is (n + 2) / 2 at most
 * (extended.c), which multiplies both. Oren-Nayar: c A + B c s with A at most 1, and c s = (L.V - c
 * v) c / max(c, v) at most 1, which is its whole integral's 2 pi at most.
 *
 * Cook-Torrance: F D G / (4 v) over dw = 4 V.H dw_H is at most D min(V.H, 2 N.H v) / v, of H with
 * V.H > 0. H and its mirror image by N are two sides of a groove, with the same D, and V.H + V.H' =
 * 2 N.H v. If both are positive, they add up to that, and if only one is, to no more: D N.H v a
 * side, whose integral is pi v. So pi is the most. For one direction G / v is 1 / v and 2 / V.H at
 * most, so that there is no limit where both may be 0.
 *
 * Westin: all light leaves if facets are white, under any V, so that no node of the table has more
 * than 1 over the light that it stands for, which is 1 / 2862 at least; and no more leaves if they
 * are not. Splines have no more than their nodes, so that a table that is there tells its own most.
 */
#include "plan/peaks.h"

#include "plan/spread.h"

shd_peak shd_peak_of(const shd_plan_material *m, size_t term) {
    if (m->model == SHD_MODEL_WESTIN) return (shd_peak){m->table ? m->table->most : 2900, 1.001};
    if (term == 0) {
        if (m->model != SHD_MODEL_OREN_NAYAR) return (shd_peak){1, 1};
        const double square = m->from->sigma * m->from->sigma, b = 0.45 * square / (square + 0.09);
        return (shd_peak){1 + b, 1 + 2 * b};
    }
    if (m->model == SHD_MODEL_COOK_TORRANCE) return (shd_peak){INFINITY, 1};
    const double n = m->lobes[term - 1].shininess, phong = 2 / (shd_dullest(m, term - 1) + 1),
                 factor = (n + 2) / 2;
    if (m->model == SHD_MODEL_PHONG_NORMALIZED) {
        /* (n' + 2) / (n' + 1) is largest of the widest lobe. Those of others are as before: (n' +
         * 1) / (n + 1) times 2 / (n' + 1), of the least n that a pattern has. */
        const double widest = shd_widest(m, term - 1);
        return (shd_peak){factor, (widest + 2) / 2 * (2 / (widest + 1))};
    }
    return (shd_peak){1, m->model == SHD_MODEL_BLINN_PHONG ? shd_smaller(4 * phong, 2) : phong};
}

/* With x = tan^2 it is largest at max(0, 2 m^2 - 1). */
double shd_facets_most(double roughness) {
    const double m = roughness * roughness;
    return m > 0.5 ? 4 * m * exp(1 / m - 2) : 1 / m;
}

/* Of light that is polarized across the plane of incidence, the less the steeper it comes: c / a
 * grows with c, where a^2 = n^2 - 1 + c^2. Of the other, n^2 c / a grows, and what is mirrored
 * falls until that is 1, and rises from there: no more than at either end. Of all n from 1 on, as a
 * pattern has them, c / a is least of the largest n; and with s^2 = 1 - c^2, n^2 c / a is 1 at n =
 * 1, falls to 2 s c at n^2 = 2 s^2, and rises from there: no more than at that or at the largest n.
 */
static double mirrored_most(const shd_fresnel *index, int channel, double half) {
    const double n = index->n[channel], c = shd_smaller(half, 1), n2 = n * n;
    if (!(c > 0) || !(n >= 1) || isinf(n) || index->k[channel] != 0) return 1;
    const double s2 = (1 - c) * (1 + c), a = sqrt(n2 - s2), across = (a - c) / (a + c),
                 upright = (n - 1) / (n + 1);
    double along = fabs(n2 * c - a) / (n2 * c + a);
    if (index->f0_texture && 2 * s2 > 1 && 2 * s2 < n2) {
        const double least = 2 * sqrt(s2) * c;
        along = shd_larger(along, (1 - least) / (1 + least));
    }
    const double most = across * across + shd_larger(along * along, upright * upright);
    return shd_smaller(most / 2 * (1 + 1e-12) + 1e-15, 1);
}

double shd_mirrored_most(const shd_plan_material *m, double half) {
    const size_t bins = m->indices ? m->bin_count / (1 + m->lobe_count) : 3;
    double most = 0;
    for (size_t b = 0; b < bins && most < 1; b++) {
        const shd_fresnel *index = m->indices ? &m->indices[b / 3] : &m->from->fresnel;
        most = shd_larger(most, mirrored_most(index, (int)(b % 3), half));
    }
    return most;
}

/* 1 / A times the integral over the light's solid angle, which is at most 2 A over the square of
 * the distance. */
double shd_shape_most(const shd_light *shape, const shd_peak *peak, double nearest) {
    const double of_all = peak->whole * SHD_PI / shd_light_area(shape),
                 of_seen = nearest > 0 ? peak->most * 2 / (nearest * nearest) : INFINITY;
    return of_all < of_seen ? of_all : of_seen;
}

/* The solid angle over A: of a flat shape the mean of its cosine over the square of the distance;
 * of a sphere at the distance D from its center, whose A is pi r^2, 2 pi (1 - sqrt(1 - r^2 / D^2))
 * / A. */
static double most_seen(const shd_light *shape, double nearest) {
    if (!(nearest > 0)) return INFINITY;
    if (shape->type != SHD_LIGHT_SPHERE) return 1 / (nearest * nearest);
    const double away = nearest + shape->radius, sine = shape->radius / away;
    return 2 / (away * away * (1 + sqrt((1 - sine) * (1 + sine))));
}

/* 4 m^2 e^(1 / m^2 - 2) and 1 / m^2 are largest at either end of what widened lobes have. */
static double facets_most(const shd_plan_material *m, size_t lobe) {
    const double own = shd_facets_most(m->lobes[lobe].shininess);
    return m->pointwise ? shd_larger(own, shd_facets_most(shd_widest(m, lobe))) : own;
}

double shd_shape_most_at(const shd_light *shape, const shd_plan_material *m, size_t term,
                         const shd_stance *at) {
    shd_peak peak = shd_peak_of(m, term);
    if (term && m->model == SHD_MODEL_COOK_TORRANCE) {
        const double by_view = at->view > 0 ? 1 / at->view : INFINITY,
                     by_half = at->half > 0 ? 2 / at->half : INFINITY,
                     mirrored = shd_mirrored_most(m, at->half);
        peak.most = mirrored * facets_most(m, term - 1) * shd_smaller(by_view, by_half) / 4;
        peak.whole *= mirrored;
    }
    const double of_all = peak.whole * SHD_PI / shd_light_area(shape),
                 of_seen = peak.most * most_seen(shape, at->nearest);
    return of_all < of_seen ? of_all : of_seen;
}
