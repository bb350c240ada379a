/* Weights of light of 1, from N.L = c, seen at N.V = v:
 *
 * Lambert: c, whose integral is pi. Phong: (R.V)^n, at most 2 pi / (n + 1) over the hemisphere of
 * R, which all directions before the surface are. Blinn: (N.H)^n; as dw = 4 V.H dw_H, four times
 * that. Normalized: pi c / E is (n + 2) / 2 at most (extended.c), which multiplies both.
 * Oren-Nayar: c A + B c s with A at most 1, and c s = (L.V - c v) c / max(c, v) at most 1, which is
 * its whole integral's 2 pi at most. Cook-Torrance: F D G / (4 v) over dw = 4 V.H dw_H is F D (G
 * V.H / v), and G / v is 2 N.H / V.H at most; the integral of D N.H is pi, so that 2 pi is the
 * most. At grazing views there is no limit for one direction. Westin: all light leaves if
 * facets are white, under any V, so that no node of the table has more than 1 over the light that
 * it stands for, which is 1 / 2862 at least; and no more leaves if they are not. Splines have no
 * more than their nodes, so that a table that is there tells its own most. */
#include "plan/peaks.h"

shd_peak shd_peak_of(const shd_plan_material *m, size_t term) {
    if (m->model == SHD_MODEL_WESTIN) return (shd_peak){m->table ? m->table->most : 2900, 1.001};
    if (term == 0) {
        if (m->model != SHD_MODEL_OREN_NAYAR) return (shd_peak){1, 1};
        const double square = m->from->sigma * m->from->sigma, b = 0.45 * square / (square + 0.09);
        return (shd_peak){1 + b, 1 + 2 * b};
    }
    if (m->model == SHD_MODEL_COOK_TORRANCE) return (shd_peak){INFINITY, 2};
    const double n = m->lobes[term - 1].shininess, phong = 2 / (n + 1), factor = (n + 2) / 2;
    if (m->model == SHD_MODEL_PHONG_NORMALIZED) return (shd_peak){factor, factor * phong};
    return (shd_peak){1, m->model == SHD_MODEL_BLINN_PHONG ? 4 * phong : phong};
}

/* 1 / A times the integral over the light's solid angle, which is at most 2 A over the square of
 * the distance. */
double shd_shape_most(const shd_light *shape, const shd_peak *peak, double nearest) {
    const double of_all = peak->whole * SHD_PI / shd_light_area(shape),
                 of_seen = nearest > 0 ? peak->most * 2 / (nearest * nearest) : INFINITY;
    return of_all < of_seen ? of_all : of_seen;
}
