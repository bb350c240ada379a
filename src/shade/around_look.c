#include "shade/around_look.h"

#include <string.h>

/* Lobes count up to e^-14 of their peaks: that. */
static const double LEAST = 8e-7;

/* What nodes are off where the lobe has a kink, by how far the block reaches, of what the kink is
 * wide; and where the horizon ends it in a kink, or as off a cliff. */
static const double KINK = 0.06, HORIZON = 0.1, CLIFF = 0.5;

shd_lobe_view shd_view_lobe(const shd_around_lobe *lobe) {
    const double s = lobe->sharpness, n = shd_larger(s, 1);
    shd_lobe_view v = {.lobe = lobe, .viewing = shd_larger(shd_dot(lobe->normal, lobe->view), 0)};
    switch (lobe->model) {
    case SHD_MODEL_COOK_TORRANCE:
        v.inverse = 1 / (s * s);
        v.peak = shd_larger(2 * s * s - 1, 0);
        v.own = shd_smaller(s * sqrt(0.5), 0.4);
        v.scale = v.inverse / (4 * SHD_PI);
        break;
    case SHD_MODEL_BLINN_PHONG:
        v.own = shd_smaller(1 / sqrt(n), 0.4);
        v.scale = 1 / SHD_PI;
        break;
    case SHD_MODEL_PHONG_NORMALIZED:
        v.own = shd_smaller(1 / sqrt(n), 0.6);
        v.scale = (s + 2) / (2 * SHD_PI);
        break;
    default:
        v.own = 0.8;
        v.scale = 1 / SHD_PI;
    }
    return v;
}

/* To 3 percent (N. Schraudolph, A Fast, Compact Approximation of the Exponential Function, 1999).
 */
static inline double about_exp(double x) {
    if (x < -600) return 0;
    const int64_t bits = (int64_t)(x * 6497320848556798.0) + 4606921280493453312;
    double out;
    memcpy(&out, &bits, sizeof out);
    return out;
}

/* The square of the tangent of an angle less or more by about `by`. */
static inline double nearer(double tangent, double by) {
    const double t = (tangent - by) / (1 + tangent * by);
    return t > 0 ? t * t : 0;
}
static inline double farther(double tangent, double by) {
    const double under = 1 - tangent * by, t = (tangent + by) / under;
    return under > 0 ? t * t : INFINITY;
}

/* cos^n by the square x of the tangent: log(1 + x) is between two fractions. */
static inline double faint_power(double n, double x) {
    return n * x / (2 + x);
}
static inline double power_far(double n, double x) {
    return x < INFINITY ? about_exp(-n * 0.5 * x * (6 + x) / (6 + 4 * x)) : 0;
}

static inline double facets_at(const shd_lobe_view *v, double x) {
    return x < INFINITY ? (1 + x) * (1 + x) * about_exp(-x * v->inverse) : 0;
}

/* The square of what a block reaches in widths, times how much more than at the peak derivatives
 * are beside the lobe where that is e^-faint. */
static inline void spread(double reach, double width, double faint, shd_lobe_look *out) {
    const double by = reach / width;
    out->plain = by * by;
    out->square = by * by * (1 + 0.9 * faint);
}

/* H = (L + V) / |L + V| turns by what L does over |L + V|. */
static bool look_at_half(const shd_lobe_view *v, shd_vec3 d, double reach, shd_lobe_look *out) {
    const bool blinn = v->lobe->model == SHD_MODEL_BLINN_PHONG;
    const double n = v->lobe->sharpness, between = shd_dot(d, v->lobe->view),
                 length = sqrt(shd_larger(2 + 2 * between, 1e-30)), up = out->side + v->viewing,
                 cosine = shd_smaller(up / length, 1);
    double x[2] = {0, INFINITY};
    if (2 * reach < length && cosine > 0) {
        const double turn = 1.05 * reach / length, by = turn * (1 + 0.4 * turn * turn),
                     tangent = sqrt((1 - cosine) * (1 + cosine)) / cosine;
        x[0] = nearer(tangent, by);
        x[1] = farther(tangent, by);
    }
    const double faint = blinn ? faint_power(n, x[0]) : x[0] * v->inverse;
    if (blinn) {
        out->near = about_exp(-faint);
        out->far = power_far(n, x[1]);
    } else {
        out->near = facets_at(v, shd_smaller(shd_larger(v->peak, x[0]), x[1]));
        out->far = shd_smaller(facets_at(v, x[0]), facets_at(v, x[1]));
    }
    spread(reach, shd_larger(length - reach, 1e-9) * v->own, faint, out);
    return out->near > LEAST;
}

/* What G over N.V is, and whether it becomes another of its three on the block: 2 N.H N.V / V.H is
 * 2 (N.L + N.V) N.V / (1 + L.V), and so on. */
static void open_facets(const shd_lobe_view *view, shd_vec3 d, double reach, shd_lobe_look *out) {
    const double v = view->viewing, side = out->side, between = 1 + shd_dot(view->lobe->view, d),
                 length = sqrt(2 * shd_larger(between, 0)), h = length / 2,
                 u = shd_smaller((side + v) / shd_larger(length, 1e-9), 1),
                 over = shd_larger(h - reach / 2, v / 2),
                 most = shd_smaller(u + reach / shd_larger(length, 1e-9), 1),
                 least = shd_larger(u - reach / shd_larger(length, 1e-9), 0), wide = h + reach / 2;
    out->high =
        shd_smaller(shd_smaller(1 / v, 2 * most / over), 2 * most * (side + reach) / (over * v));
    out->low = shd_smaller(shd_smaller(1 / v, 2 * least / wide),
                           2 * least * shd_larger(side - reach, 0) / (wide * v));
    const double by_view = 2 * (side + v) * v - between, by_light = 2 * (side + v) * side - between,
                 steep = 2 * (2 * fabs(side) + 2 * reach + v) + 1;
    const bool near = (fabs(by_view) < (2 * v + 1) * reach && v < side + reach) ||
                      (fabs(by_light) < steep * reach && side < v + reach) ||
                      (fabs(side - v) < reach && by_view < (2 * v + 1) * reach);
    out->kink = near ? KINK * reach / shd_larger(length, 1e-9) : 0;
    if (side < reach) out->kink = shd_larger(out->kink, HORIZON);
}

static bool look_at_mirror(const shd_lobe_view *v, shd_vec3 d, double reach, shd_lobe_look *out) {
    const double n = v->lobe->sharpness, cosine = shd_dot(d, v->lobe->mirror),
                 by = reach * (1 + 0.4 * reach * reach);
    double faint = 0;
    out->far = 0;
    if (cosine > 1e-3 && reach < 0.7) {
        const double tangent = sqrt(shd_larger((1 - cosine) * (1 + cosine), 0)) / cosine;
        faint = faint_power(n, nearer(tangent, by));
        out->far = power_far(n, farther(tangent, by));
    } else if (cosine < -reach) {
        return false;
    }
    out->near = about_exp(-faint);
    /* N.L over what normalizes it rises to 1 from the horizon on. */
    const double rise = sqrt(n + 1);
    out->high = shd_smaller((out->side + reach) * rise, 1);
    out->low = shd_smaller(shd_larger(out->side - reach, 0) * rise, 1) * 0.5;
    spread(reach, v->own, faint, out);
    out->kink = out->side < reach || (n < 4 && cosine < reach) ? HORIZON : 0;
    return out->near > LEAST;
}

static void look_at_rough(const shd_lobe_view *view, shd_vec3 d, double reach, shd_lobe_look *out) {
    const double v = view->viewing, side = out->side;
    out->near = out->far = 1;
    out->high = 2 * (side + reach);
    out->low = shd_larger(side - reach, 0);
    spread(reach, view->own, 0, out);
    if (fabs(shd_dot(view->lobe->view, d) - side * v) < reach) out->kink = KINK * reach;
    if (fabs(side - v) < reach)
        out->kink = shd_larger(out->kink, KINK * reach / shd_larger(v, 0.2));
    if (side < reach) out->kink = HORIZON;
}

bool shd_look_at_lobe(const shd_lobe_view *v, shd_vec3 middle, double reach, shd_lobe_look *out) {
    *out = (shd_lobe_look){.side = shd_dot(v->lobe->normal, middle), .high = 1, .low = 1};
    if (out->side <= -reach) return false;
    switch (v->lobe->model) {
    case SHD_MODEL_COOK_TORRANCE:
        if (!look_at_half(v, middle, reach, out)) return false;
        open_facets(v, middle, reach, out);
        return true;
    case SHD_MODEL_BLINN_PHONG:
        if (!look_at_half(v, middle, reach, out)) return false;
        if (out->side < reach) { /* it ends as off a cliff */
            out->low = 0;
            out->kink = CLIFF;
        }
        return true;
    case SHD_MODEL_PHONG_NORMALIZED:
        return look_at_mirror(v, middle, reach, out);
    default:
        look_at_rough(v, middle, reach, out);
        return true;
    }
}
