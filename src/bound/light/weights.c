/* Proofs stand with each model. */
#include "bound/light/weights.h"

#include "bound/light/error.h"
#include "plan/peaks.h"
#include "plan/spread.h"

static double function_error(const shd_glance *g) {
    return g->narrow ? SHD_WEIGHT_FUNCTION32 : SHD_WEIGHT_FUNCTION;
}

/* Errors of N.L (a + b s) by directions go with 1 / max(N.L, N.V), and N.L s is L.V - N.L N.V where
 * N.L is the larger one: below SHD_ALONG, f32 leaves the point to f64. */
static double rough_error(const shd_glance *g) {
    if (g->narrow) return 2 * g->direction / shd_larger(g->view, 0.99 * SHD_ALONG);
    return 4 * g->direction / g->view + function_error(g);
}

static shd_weight weigh_diffuse(const shd_plan_material *m, const shd_glance *g) {
    const double facing = g->lit.facing_high;
    const shd_weight lambert = {facing, g->direction + function_error(g) * facing};
    if (m->model != SHD_MODEL_OREN_NAYAR) return lambert;
    /* N.L (a + b s), where s is max(0, L.V - N.L N.V) / max(N.L, N.V), and N.L s is at most 1. */
    const double square = m->from->sigma * m->from->sigma, b = 0.45 * square / (square + 0.09);
    return (shd_weight){facing + b * shd_smaller(1, facing / g->view),
                        lambert.error + b * rough_error(g)};
}

/* The error of (x+)^shininess with x a cosine of at most `shine`, by directions and functions. For
 * an exponent below 1 the slope has no limit, but |x^n - y^n| <= |x - y|^n. */
static double power_error(double shininess, double shine, double most, double direction,
                          const shd_glance *g, size_t lights) {
    const shd_lobe_error e =
        shd_lobe_error_of(g->narrow ? SHD_ROUNDS_FUSED : SHD_ROUNDS_64, shininess, lights);
    double turned = shd_lobe_turned(&e, shine, most, direction);
    if (g->drifts && shininess > 0 && shininess < 1) turned = pow(direction, shininess);
    return shd_lobe_sum(turned, shd_lobe_functions(&e, most)) + shd_lobe_faint(&e, most);
}

static shd_weight weigh_phong(double shininess, const shd_glance *g, size_t lights) {
    const double shine = g->lit.shine_high, most = shd_shine_most(shine, shininess);
    return (shd_weight){most, power_error(shininess, shine, most, g->direction, g, lights)};
}

/* H = (L + V) / |L + V| errs by as much as L and V, divided by 2 V.H, twice. */
static double half_error(const shd_glance *g) {
    return shd_smaller(g->direction / g->half, 1);
}

/* By how much the angle between N and H errs. In f32 its tangent is that of two sides of L + V,
 * which is 2 V.H long; where that is short, the point is left to f64. */
static double tilt_error(const shd_glance *g) {
    static const double LEAST = 0.99 * 0x1p-3; /* of a root of SHD_OPPOSITE */
    if (!g->narrow) return g->direction + half_error(g);
    return (SHD_WEIGHT_SUM32 + g->place) / shd_larger(2 * g->half, LEAST);
}

static shd_weight weigh_blinn(double shininess, const shd_glance *g, size_t lights) {
    return (shd_weight){1, power_error(shininess, 1, 1, tilt_error(g), g, lights)};
}

/* The factor pi N.L / E is at most (n + 2) / 2, because E, without the part of the lobe below the
 * horizon, which is negative there, is N.L 2 pi / (n + 2). With c = N.L, s = 1 - c^2, h = n / 2 and
 * g = Gamma(h + 1/2) / Gamma(h + 1), (n + 2) dE/dc is 2 pi - sqrt(pi) g h B(s; h, 1/2) by the
 * closed form (shade/brdf.c), and the second term is pi at most. So E rises, the factor's slope is
 * at most pi / E(0), and E(0) = sqrt(pi) g / (n + 2) >= sqrt(pi / (h + 1/2)) / (n + 2). E is
 * computed to 1e-10, and in f32 as other functions.
 *
 * At c the slope is pi E(0) s^h / E^2, for E - c dE/dc is E(0) s^h. As (n + 2) dE/dc is at least
 * pi, and g below 1 / sqrt(h + 1/4), E / E(0) is 1 + c sqrt(pi (h + 1/4)) or more. From n = 8 and c
 * = 0.49 / sqrt(h + 1/2) on, that is 1.84, s^h at most 0.81, and the slope a quarter. f32 leaves
 * points below to f64. */
static shd_weight weigh_normalized(double shininess, const shd_glance *g, size_t lights) {
    const shd_weight lobe = weigh_phong(shininess, g, lights);
    const double factor = (shininess + 2) / 2, function = g->narrow ? SHD_WEIGHT_FUNCTION32 : 1e-10,
                 level = sqrt(SHD_PI / (shininess / 2 + 0.5)) / (shininess + 2),
                 slope =
                     SHD_PI / level * (g->narrow && shd_normalized_low(shininess) > 0 ? 0.25 : 1);
    return (shd_weight){factor * lobe.most, factor * (lobe.error + function * lobe.most) +
                                                slope * g->direction * lobe.most};
}

static double largest_index(const shd_fresnel *f, double most) {
    for (int c = 0; c < 3; c++)
        if (isfinite(f->n[c])) most = shd_larger(most, f->n[c] * f->n[c] + f->k[c] * f->k[c]);
    return most;
}

/* n^2 + k^2 is at most that, in any channel or bin. */
static double index_of(const shd_plan_material *m) {
    const size_t bins = m->indices ? m->bin_count / (1 + m->lobe_count) : 0;
    double most = largest_index(&m->from->fresnel, 1);
    for (size_t b = 0; b < bins; b += 3) most = largest_index(&m->indices[b / 3], most);
    return most;
}

/* n^2 - 1 of the least index that a pattern of f0 has. */
static double least_above(const shd_texture *f0) {
    double ends[2][3], least = 1;
    shd_texture_ends(f0, ends);
    for (int c = 0; c < 3; c++) least = shd_smaller(least, shd_smaller(ends[0][c], ends[1][c]));
    const double n = shd_index_of(least);
    return (n - 1) * (n + 1);
}

/* By how much F errs, in half_error. Patterns of f0 have no absorption, and any n from 1 on: with c
 * = V.H, a^2 = n^2 - 1 + c^2, y = c / a and x = n^2 c / a, F is the mean of the squares of (1 - y)
 * / (1 + y) and (1 - x) / (1 + x). By log c the slope of y is y (n^2 - 1) / a^2 <= y, that of x
 * likewise, and those of the squares by log x and log y are 0.385 at most: so F's by c is 0.385 /
 * c. c errs by what directions do twice, g->half half_error; where that is more than half of c,
 * four times half_error is more than 1. Over a whole lobe D g h 0.385 / h is D 0.385 / v, and no
 * more than that together with all that is nearer to h = 0. Rounding of n^2 - 1 + c^2 comes on top.
 */
static double fresnel_slope(const shd_plan_material *m, const shd_glance *g) {
    const shd_texture *f0 = m->from->fresnel.f0_texture;
    if (!f0) return 8 * (1 + index_of(m));
    return 4 + 0x1p-51 / ((least_above(f0) + g->half * g->half) * half_error(g));
}

/* By how much g = G / N.V of Cook and Torrance errs, but for what N.H does: g is the least of 1 /
 * v, 2 u / h and 2 u c / (h v), with c = N.L, v = N.V, u = N.H and h = V.H, of which each errs by
 * what directions do. As u = (c + v) / (2 h), slopes have no 1 / v. Where the first is the least, v
 * is h / 2 or more, and its slope 4 / h^2. That of the second by h is 2 / h^2. The third is the
 * least only where c < v, so that u <= v / h, and each of its three slopes is at most 2 / h^2.
 * Twice their sum holds what slopes are beside the point, unless directions err by as much as v or
 * h. */
static double open_error(const shd_glance *g) {
    const double near = 1 / (g->half * g->half);
    if (8 * g->direction < shd_smaller(g->view, g->half)) return 12 * near * g->direction;
    return 16 / g->half * (1 / g->half + 1 / g->view) * g->direction;
}

/* F D g / 4 with F at most `mirrored`, and g at most 1 / N.V and 2 / V.H. With x = tan^2 of the
 * angle of H, D = (1 + x)^2 e^(-x / m^2) / m^2 is largest at x = max(0, 2 m^2 - 1), and its slope
 * by that angle is at most 2 (1 + x)^3 sqrt(x) / m^4 + 4 (1 + x)^2 sqrt(x) / m^2 with x <= 3.5 m^2,
 * which is four times D sqrt(x) at least. N.H errs by the sine of that angle times what H does, and
 * 2 / V.H times that is what it does to g. */
static shd_weight weigh_facets(const shd_plan_material *material, double slope,
                               const shd_glance *g) {
    const double mirrored = shd_mirrored_most(material, g->half);
    const double m = slope * slope, x = 1 + 3.5 * m, root = sqrt(3.5 * m);
    const double most = shd_facets_most(slope);
    const double steep = 2 * x * x * x * root / (m * m) + 4 * x * x * root / m;
    const double over = shd_smaller(1 / g->view, 2 / g->half), tilt = 0.5 / g->half;
    const double turned = half_error(g),
                 fresnel = shd_smaller(fresnel_slope(material, g) * turned, 1);
    return (shd_weight){mirrored * most * over / 4,
                        (mirrored * (steep * turned * (over + tilt) + most * open_error(g)) +
                         most * over * (fresnel + mirrored * SHD_WEIGHT_FUNCTION / m)) /
                            4};
}

/* By how much of itself the variance of a widened lobe errs. How a normal turns is divided by N.V,
 * or SHD_BENT_STEEPEST, of which directions are a part of g->direction / N.V; the product of both
 * variances is the square of a cross product, whose rounding is some of their sum, which is sqrt(n
 * + 2) of what it is added to at most. Triangles have sides that are 1e-4 from parallel at least
 * (shade/bend.h). */
static double variance_error(double variance, const shd_glance *g) {
    static const double TRIANGLES = 1e-7;
    const double view = shd_larger(g->view, SHD_BENT_STEEPEST);
    return shd_smaller(TRIANGLES + 32 * g->direction / view + 1e-14 / sqrt(variance), 1);
}

/* Over dw = 4 h dw_H the weight F D g / 4 is F D g h, and the whole of any D that depends on the
 * angle of H alone is what its product with N.H has, as in plan/peaks.c. H errs by `turned`. With t
 * the tangent of that angle and E the mean over e^(-t^2 / m^2) 2 t dt / m^2:
 * - D errs by D (2 t (1 + t^2) / m^2 + 4 t), whose whole is sqrt(pi) (1 / m + 3.5 m);
 * - F by what fresnel_slope says;
 * - g, which is the least of 1 / v, 2 u / h and 2 u c / (h v), by 1 / v of itself, and 1 / h,
 * twice; by u 2 / h twice, and by c 2 / h^2, of which the whole of D 2 / h times h is 2 E[sqrt(1 +
 * t^2)]
 *   <= 2 (1 + m). Twice their sum holds what slopes are beside the point.
 * Of facets whose m differs from point to point, it is no more than at both ends together, as each
 * part of it is convex. By the logarithm of m^2, D changes by D (t^2 / m^2 - 1), whose whole is 2 /
 * e; where m^2 errs by r of itself, twice r holds that, or is more than the whole lobe. */
static double facets_turned(const shd_plan_material *m, double r, const shd_glance *g) {
    return half_error(g) * (sqrt(SHD_PI) * (1 / r + 3.5 * r) + fresnel_slope(m, g) + 18 * (1 + r)) +
           SHD_WEIGHT_FUNCTION / (r * r);
}

double shd_facets_turned(const shd_plan_material *m, size_t lobe, const shd_glance *g) {
    const double r = m->lobes[lobe].shininess;
    if (!m->pointwise) return facets_turned(m, r, g);
    return facets_turned(m, r, g) + facets_turned(m, shd_widest(m, lobe), g) +
           2 * variance_error(shd_variance_of(m->model, r), g);
}

/* A product of quadratic splines over nodes that are 90/16 degrees of rise and 360/32 of turn
 * apart, in both directions. The derivative of such a spline along one coordinate is a mean of
 * differences of nodes that are neighbors along it, so that over a distance of nodes it changes by
 * no more than the largest of these; nor by more than the largest value, as none is negative. Turns
 * change by what directions do over the sine of their rise, which counts from 1e-4 on. The other
 * factor is N.L. */
static shd_weight weigh_westin(const shd_plan_material *m, const shd_glance *g) {
    static const double RISE = 16 / (SHD_PI / 2), TURN = 32 / (2 * SHD_PI), POLE = 1e-4;
    const double most = shd_peak_of(m, 0).most, facing = g->lit.facing_high;
    const shd_table_limits any = {most, most, most, most}, *t = m->table ? m->table : &any;
    const double off = g->direction;
    /* What is near the normal before it has moved may not be so after it. */
    const double near = shd_smaller(off, 1) < SHD_WESTIN_NEAR / 2 ? t->near : t->turn;
    const double turned = shd_larger(near * (off / POLE + g->around),
                                     t->turn * (off / (SHD_WESTIN_NEAR / 2) + g->around));
    const double moved = 2 * (RISE * t->rise * off + TURN * turned);
    return (shd_weight){
        most * facing, shd_smaller(facing * shd_smaller(moved, most) + most * (off + 1e-12), most)};
}

static shd_weight weigh_lobe(const shd_plan_material *m, double shininess, const shd_glance *g,
                             size_t lights) {
    switch (m->model) {
    case SHD_MODEL_BLINN_PHONG:
        return weigh_blinn(shininess, g, lights);
    case SHD_MODEL_PHONG_NORMALIZED:
        return weigh_normalized(shininess, g, lights);
    case SHD_MODEL_COOK_TORRANCE:
        return weigh_facets(m, shininess, g);
    case SHD_MODEL_PHONG:
        return weigh_phong(shininess, g, lights);
    default:
        return (shd_weight){INFINITY, INFINITY};
    }
}

/* What errs by r of its variance v has n' + 2 = 1 / v that errs by r of itself.
 * - (n' + 1) x^n' / (n + 1) has the slope x^n' (1 + (n' + 1) log x) / (n + 1), and y e^-y is 1 / e
 *   at most, so that it errs by (n' + 2) r / (n + 1), which is 1.5 r at most from 1 on.
 * - pi c x^n' / E, no factor of which is more than (n + 2) / 2, errs by x^n' log x as above, and by
 *   E: the slope of its logarithm is a mean of log(R.V), weighed by E's own lobe, and 2 / (n' + 1)
 *   at most. Both together are less than 4 (n + 2) r.
 * - Of facets, D has the slope D (x / m^2 - 1) by the logarithm of m^2, where (1 + x)^2 is 2 + 2
 * x^2 at most: (0.74 + 2.7 m^4) / m^2 and D itself. */
static double sharpness_error(const shd_plan_material *m, double shininess, double off,
                              const shd_glance *g) {
    if (m->model == SHD_MODEL_PHONG_NORMALIZED) return 4 * (shininess + 2) * off;
    if (m->model != SHD_MODEL_COOK_TORRANCE) return 1.5 * off;
    const double square = shininess * shininess,
                 steep = (0.74 + 2.7 * square * square) / square + shd_facets_most(shininess);
    return steep * shd_smaller(1 / g->view, 2 / g->half) / 4 * off;
}

double shd_sharpness_error(const shd_plan_material *m, size_t lobe, const shd_glance *g) {
    if (!m->antialiased && !m->normal) return 0;
    const double n = m->lobes[lobe].shininess,
                 off = variance_error(shd_variance_of(m->model, n), g);
    return sharpness_error(m, n, off, g) + sharpness_error(m, shd_widest(m, lobe), off, g);
}

/* A lobe that may be any between two. Rays that the eye does not see find it without what bends.
 *
 * Of facets, all that errs is a sum of powers of m, so that it is no more anywhere between than at
 * both ends together. Of exponents n it is x^n times a power of n, which may be largest between: n
 * x^(n - 1) of what directions err is. From p to 2 p, x^n falls, and the power becomes twice as
 * much at most; of a normalized lobe, the factor (n + 2) / 2 of it does too, so that its error
 * becomes four times that at p, and its slope by N.L, which goes with n^1.5, three times. */
static shd_weight weigh_widened(const shd_plan_material *m, size_t lobe, const shd_glance *g,
                                size_t lights) {
    const bool facets = m->model == SHD_MODEL_COOK_TORRANCE,
               normalized = m->model == SHD_MODEL_PHONG_NORMALIZED;
    const double sharpest = m->lobes[lobe].shininess, widest = shd_widest(m, lobe);
    shd_weight out = weigh_lobe(m, widest, g, lights);
    if (facets || widest == sharpest) {
        const shd_weight sharp = weigh_lobe(m, sharpest, g, lights);
        out = (shd_weight){shd_larger(sharp.most, out.most), sharp.error + out.error};
    } else {
        for (double p = 2 * widest; p < sharpest; p *= 2) {
            const shd_weight w = weigh_lobe(m, p, g, lights);
            out = (shd_weight){shd_larger(w.most, out.most), shd_larger(w.error, out.error)};
        }
        out = (shd_weight){(normalized ? 2 : 1) * out.most, (normalized ? 4 : 2) * out.error};
    }
    out.error += shd_sharpness_error(m, lobe, g);
    return out;
}

shd_weight shd_weight_of(const shd_plan_material *m, size_t term, const shd_glance *g,
                         size_t lights) {
    if (m->model == SHD_MODEL_WESTIN) return weigh_westin(m, g);
    if (term == 0) return weigh_diffuse(m, g);
    const double shininess = m->lobes[term - 1].shininess;
    return m->pointwise ? weigh_widened(m, term - 1, g, lights)
                        : weigh_lobe(m, shininess, g, lights);
}
