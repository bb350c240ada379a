/* How a normal turns from pixel to pixel, and what that makes of highlights: geometric specular
 * antialiasing after Y. Tokuyoshi and A. Kaplanyan, "Improved Geometric Specular Antialiasing",
 * I3D 2019.
 *
 * A pixel sees many normals of a surface that bends. Over a sample's share of the pixel, a square
 * of 1 / samples, they spread by the covariance s^2 (a a' + b b'), where a and b are how the normal
 * changes from pixel to pixel and s^2 = 1 / (12 samples) is a box's variance. That of what a lobe
 * is around adds to the lobe's own variance: the normal where lobes have N.H (Blinn-Phong, the
 * facets of Cook and Torrance), and W = 2(N.V)N - V, which turns up to twice as far, where they
 * have R.V.
 *
 * A lobe of the exponent n has the variance v = 1 / (n + 2) across each axis: half of the mean of
 * |L - W|^2, which is that for any n. (In roughness, 2 v = alpha^2 = 2 / (n + 2).) Facets have v =
 * m^2 / 2. Lobes stay round: the new one has the v' whose square is (v + l)(v + m), where l and m
 * are the variances that the normals add along their axes, so that its middle is as bright as that
 * of the lobe that is not round. The exponent becomes n' = 1 / v' - 2 and the lobe (n' + 1) / (n +
 * 1) times as bright, so that light of all directions makes as much of it as before. Facets have
 * that in their own distribution. The model is this, so that it has no error of its own; with more
 * samples it becomes that without it. Any thread. */
#pragma once

#include "plan/plan.h"
#include "shade/chart.h"

/* Fills how N, unit, changes from pixel to pixel, to the right and down. False: it does not, and
 * nothing is written. A triangle whose sides are within 1e-4 of parallel does not bend. */
bool shd_bend_at(const shd_chart *chart, const shd_charted_point *point, const shd_seen_by *ray,
                 shd_vec3 out[2]);

/* What is added to the variance of lobes: l + m and l m. */
typedef struct shd_widening {
    double sum, product;
} shd_widening;

/* Of a normal that changes by `bend` from pixel to pixel; `view` V is unit. */
shd_widening shd_widening_of(shd_model model, int samples, const shd_vec3 bend[2], shd_vec3 normal,
                             shd_vec3 view);

/* What a lobe becomes: its exponent or roughness, and what it is multiplied by. Of no spread it is
 * the lobe itself, to the bit. */
typedef struct shd_sharpness {
    double shininess, share;
} shd_sharpness;

shd_sharpness shd_widen(shd_model model, double shininess, const shd_widening *spread);
