/* The torus: (|p|^2 + 1 - r^2)^2 = 4 (x^2 + z^2) along a ray is a quartic. Its roots are
 * isolated between the roots of its derivatives, where it is monotone, so that none is lost to
 * cancellation as closed formulas lose them; each is then polished on the distance form, which
 * is well conditioned for thin tubes. */
#include "sight/shapes.h"

static double evaluate(const double *c, int degree, double t) {
    double value = c[degree];
    for (int i = degree - 1; i >= 0; i--) value = value * t + c[i];
    return value;
}

/* The root of a polynomial that is monotone on [low, high] and changes sign there: Newton's
 * steps, bisection where they leave the bracket. */
static double monotone_root(const double *c, const double *slope, int degree, double low,
                            double high) {
    bool rising = evaluate(c, degree, high) > 0;
    double t = (low + high) / 2;
    for (int step = 0; step < 80; step++) {
        double value = evaluate(c, degree, t);
        if (value == 0) return t;
        if ((value > 0) == rising)
            high = t;
        else
            low = t;
        double next = t - value / evaluate(slope, degree - 1, t);
        if (!(next > low && next < high)) next = (low + high) / 2;
        if (next == t) break;
        t = next;
    }
    return t;
}

/* Real roots in [low, high], ascending; at most `degree`. Recursion on the derivative. */
static int roots_between(const double *c, int degree, double low, double high, double *root) {
    if (degree == 1) {
        if (c[1] == 0) return 0;
        double t = -c[0] / c[1];
        root[0] = t;
        return t >= low && t <= high;
    }
    double slope[4] = {0}, turn[4];
    for (int i = 1; i <= degree; i++) slope[i - 1] = c[i] * i;
    int turns = roots_between(slope, degree - 1, low, high, turn);
    int count = 0;
    double from = low;
    for (int i = 0; i <= turns; i++) {
        double to = i < turns ? turn[i] : high;
        double a = evaluate(c, degree, from), b = evaluate(c, degree, to);
        if (a == 0)
            root[count++] = from;
        else if ((a < 0) != (b < 0) && b != 0)
            root[count++] = monotone_root(c, slope, degree, from, to);
        from = to;
    }
    if (count < degree && evaluate(c, degree, high) == 0) root[count++] = high;
    return count;
}

/* (distance from the tube's circle)^2 - r^2 along the ray, and its derivative. */
static double tube_distance(const shd_ray *ray, double tube, double t, double *slope) {
    shd_vec3 p = shd_madd(ray->origin, ray->direction, t), d = ray->direction;
    double ring = sqrt(p.x * p.x + p.z * p.z), off = ring - 1;
    double ring_slope = ring > 0 ? (p.x * d.x + p.z * d.z) / ring : 0;
    *slope = 2 * (off * ring_slope + p.y * d.y);
    return (off - tube) * (off + tube) + p.y * p.y;
}

bool shd_intersect_torus(double tube, const shd_ray *ray, shd_surface *out) {
    double length = shd_length(ray->direction);
    const shd_ray unit = {ray->origin, shd_scale(ray->direction, 1 / length), ray->near * length};
    const shd_vec3 o = unit.origin, d = unit.direction;

    /* The origin is the ray's closest point to the centre, so the roots are within +-reach. */
    double bound = 1 + tube, oo = shd_dot(o, o), reach2 = bound * bound - oo;
    if (!(reach2 >= 0)) return false;
    double reach = sqrt(reach2);
    double low = fmax(-reach, unit.near), high = reach;
    if (!(low < high)) return false;

    double od = shd_dot(o, d), k = oo + 1 - tube * tube;
    double xx = d.x * d.x + d.z * d.z, ox = o.x * d.x + o.z * d.z, oxz = o.x * o.x + o.z * o.z;
    const double c[5] = {k * k - 4 * oxz, 4 * (od * k - 2 * ox), 2 * k + 4 * od * od - 4 * xx,
                         4 * od, 1};
    double root[4];
    int count = roots_between(c, 4, low, high, root);
    for (int i = 0; i < count; i++) {
        double t = root[i], slope;
        for (int step = 0; step < 2; step++) {
            double value = tube_distance(&unit, tube, t, &slope);
            double moved = slope != 0 ? t - value / slope : t;
            if (fabs(moved - t) < 1e-3 * tube) t = moved;
        }
        if (!(t > unit.near)) continue;
        shd_vec3 p = shd_madd(o, d, t), from_circle;
        double ring = sqrt(p.x * p.x + p.z * p.z);
        if (!(ring > 0)) continue;
        shd_vec3 circle = {p.x / ring, 0, p.z / ring};
        if (!shd_normalize(shd_sub(p, circle), &from_circle)) continue;
        *out = (shd_surface){t / length, shd_madd(circle, from_circle, tube), from_circle};
        return true;
    }
    return false;
}
