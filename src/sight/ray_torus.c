/* Where rays meet a torus: (|p|^2 + 1 - r^2)^2 = 4 (x^2 + z^2), a quartic in t.
 *
 * A ray that starts on the torus has the root 0. Without it, a cubic is left, whose roots near 0
 * are as precise as others: there is nothing to skip. Roots lie between the turns of a polynomial,
 * which are the roots of its derivative, and so on down to a line. */
#include "sight/ray_parts.h"

/* Coefficients from the constant one on. */
static double value_at(const double *c, int degree, double t) {
    double value = c[degree];
    for (int k = degree - 1; k >= 0; k--) value = value * t + c[k];
    return value;
}

/* The root between two ends at which the signs differ, by Newton's steps within halves. */
static double find_between(const double *c, const double *slope, int degree, double low,
                           double high) {
    const bool rises = value_at(c, degree, high) > 0;
    double t = low + (high - low) / 2;
    for (int step = 0; step < 128; step++) {
        const double value = value_at(c, degree, t);
        if (value == 0) return t;
        *((value > 0) == rises ? &high : &low) = t;
        double next = t - value / value_at(slope, degree - 1, t);
        if (!(next > low && next < high)) next = low + (high - low) / 2;
        if (next == t || next == low || next == high) return next;
        t = next;
    }
    return t;
}

/* Roots in [low, high], ascending; those at which the sign does not change are left out. */
static int find_roots(const double *c, int degree, double low, double high, double *roots) {
    double slope[4], turns[6];
    if (degree == 1) {
        const double t = -c[0] / c[1];
        roots[0] = t;
        return t >= low && t <= high;
    }
    for (int k = 1; k <= degree; k++) slope[k - 1] = k * c[k];
    turns[0] = low;
    const int count = find_roots(slope, degree - 1, low, high, turns + 1);
    turns[count + 1] = high;
    int found = 0;
    for (int k = 0; k <= count; k++) {
        const double a = value_at(c, degree, turns[k]), b = value_at(c, degree, turns[k + 1]);
        if ((a > 0) != (b > 0))
            roots[found++] = find_between(c, slope, degree, turns[k], turns[k + 1]);
    }
    return found;
}

/* A step of Newton's by the distance from the tube's circle, which keeps more digits. */
static double polish(double tube, shd_vec3 o, shd_vec3 d, double t) {
    const shd_vec3 p = shd_madd(o, d, t);
    const double ring = sqrt(p.x * p.x + p.z * p.z), off = ring - 1;
    const double value = (off - tube) * (off + tube) + p.y * p.y,
                 slope = 2 * (off / ring * (p.x * d.x + p.z * d.z) + p.y * d.y),
                 step = value / slope;
    return fabs(step) < 1e-6 ? t - step : t;
}

/* Whether a root is one of the torus. A tube that is thicker than its ring is wide meets itself,
 * and the quartic then has a surface inside, which the torus has not. */
static bool is_outer(double tube, shd_vec3 p) {
    const double ring = sqrt(p.x * p.x + p.z * p.z), far = (ring + 1) * (ring + 1) + p.y * p.y;
    return tube <= 1 || fabs(far - 4 * ring - tube * tube) <= fabs(far - tube * tube);
}

int shd_torus_roots(double tube, const shd_local_ray *r, double roots[4]) {
    const double length = shd_length(r->direction), around = (1 + tube) * (1 + 1e-9);
    const shd_vec3 d = shd_scale(r->direction, 1 / length);
    const double closest = -shd_dot(r->origin, d), shift = r->starts ? 0 : closest;
    const shd_vec3 o = shd_madd(r->origin, d, shift), foot = shd_madd(r->origin, d, closest);
    const double room = around * around - shd_dot(foot, foot);
    if (!(room > 0)) return 0;
    const double middle = closest - shift, reach = sqrt(room);
    const double b = r->starts ? shd_dot(o, d) : 0, k = shd_dot(o, o) + (1 - tube) * (1 + tube),
                 along = o.x * d.x + o.z * d.z;
    double c[5] = {k * k - 4 * (o.x * o.x + o.z * o.z), 4 * b * k - 8 * along,
                   4 * b * b + 2 * k - 4 * (d.x * d.x + d.z * d.z), 4 * b, 1};
    int count;
    if (r->starts) {
        /* Its slope at the start is that side's, by the surface's normal. */
        if ((c[1] > 0) != r->outward) c[1] = r->outward ? 1e-300 : -1e-300;
        const double end = middle + reach;
        count = end > 0 ? find_roots(c + 1, 3, 0, end, roots) : 0;
    } else {
        count = find_roots(c, 4, middle - reach, middle + reach, roots);
    }
    int kept = 0;
    for (int i = 0; i < count; i++) {
        const double t = r->starts ? roots[i] : polish(tube, o, d, roots[i]);
        if ((r->starts && !(t > 0)) || !is_outer(tube, shd_madd(o, d, t))) continue;
        roots[kept++] = (t + shift) / length;
    }
    return kept;
}
