#include "shade/wave.h"

#include <math.h>

#include "base/vec3.h"

/* ---- Integrals of the sawtooth B_1, each of mean 0: B_n / n! of the fractional part. ---- */

static double fraction(double s) {
    return s - floor(s);
}

static double saw1(double s) {
    return fraction(s) - 0.5;
}

static double saw2(double s) {
    const double x = fraction(s);
    return (x * (x - 1) + 1.0 / 6) / 2;
}

static double saw3(double s) {
    const double x = fraction(s);
    return x * (x - 0.5) * (x - 1) / 6;
}

static double saw4(double s) {
    const double x = fraction(s), y = x * (x - 1);
    return (y * y - 1.0 / 30) / 24;
}

/* ---- One axis: a side of the footprint spreads s evenly, two spread it as a trapezoid. ---- */

/* The mean over the trapezoid of what `twice` is the second integral of. */
static double mean_of(double (*twice)(const void *, double), const void *of, const shd_footprint *f,
                      int axis) {
    const double c = f->at[axis], least = SHD_FOOTPRINT_LEAST;
    const double p = shd_larger(fabs(f->x[axis]), least), q = shd_larger(fabs(f->y[axis]), least);
    const double sum = (p + q) / 2, difference = (p - q) / 2;
    return (twice(of, c + sum) - twice(of, c + difference) - twice(of, c - difference) +
            twice(of, c - sum)) /
           (p * q);
}

static double pulse_twice(const void *of, double s) {
    const shd_pulse *pulse = of;
    return saw3(s - pulse->to) - saw3(s - pulse->from);
}

static double mean_of_rest(const shd_pulse *pulse, const shd_footprint *f, int axis) {
    return mean_of(pulse_twice, pulse, f, axis);
}

double shd_pulse_mean(const shd_pulse *pulse, const shd_footprint *f, int axis) {
    return pulse->to - pulse->from + mean_of_rest(pulse, f, axis);
}

/* ---- Both axes. ---- */

/* The pulse without its mean, and its first two integrals. */
static double rest(const shd_pulse *pulse, double s) {
    return saw1(s - pulse->to) - saw1(s - pulse->from);
}

static double rest1(const shd_pulse *pulse, double s) {
    return saw2(s - pulse->to) - saw2(s - pulse->from);
}

static double rest2(const shd_pulse *pulse, double s) {
    return saw3(s - pulse->to) - saw3(s - pulse->from);
}

/* The next place after t, in the direction of `step`, at which the pulse changes. */
static double next_change(const shd_pulse *pulse, double t, bool up) {
    const double edges[2] = {pulse->from, pulse->to};
    double best = up ? INFINITY : -INFINITY;
    for (int k = 0; k < 2; k++) {
        double at = edges[k] + (up ? floor(t - edges[k]) + 1 : ceil(t - edges[k]) - 1);
        /* Rounded, t may be one of them and its distance less than whole. */
        if (up ? at <= t : at >= t) at += up ? 1 : -1;
        best = up ? shd_smaller(at, best) : shd_larger(at, best);
    }
    return best;
}

/* The integral of rest1(s) rest(t) dt along an edge. Between changes of t the second is constant.
 */
static double along_edge(const shd_pulse *pulse, const double from[2], const double to[2]) {
    enum { MOST = 4096 };
    const double ds = to[0] - from[0], dt = to[1] - from[1], end = to[1];
    const bool up = dt > 0;
    double t = from[1], s = from[0], sum = 0;
    if (dt == 0) return 0;
    for (int i = 0; i < MOST; i++) {
        double next = next_change(pulse, t, up);
        const bool last = up ? next >= end : next <= end;
        if (last) next = end;
        const double then = last ? to[0] : from[0] + (next - from[1]) * (ds / dt), step = then - s;
        const double inner = fabs(step) > 1e-7 ? (rest2(pulse, then) - rest2(pulse, s)) / step
                                               : rest1(pulse, (s + then) / 2);
        sum += rest(pulse, (t + next) / 2) * inner * (next - t);
        if (last) break;
        t = next;
        s = then;
    }
    return sum;
}

/* Whether the pulse is the same all over the footprint, in one axis. */
static bool is_constant(const shd_pulse *pulse, const shd_footprint *f, int axis) {
    const double half = (fabs(f->x[axis]) + fabs(f->y[axis])) / 2, low = f->at[axis] - half,
                 high = f->at[axis] + half;
    return half < 0.5 && floor(low - pulse->from) == floor(high - pulse->from) &&
           floor(low - pulse->to) == floor(high - pulse->to);
}

/* The mean of rest(s) rest(t), by Green's theorem: integrals along the parallelogram's edges. */
static double mean_of_product(const shd_pulse *pulse, const shd_footprint *f) {
    const double area = f->x[0] * f->y[1] - f->x[1] * f->y[0];
    double corner[4][2], sum = 0;
    static const double signs[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {0.5, 0.5}, {-0.5, 0.5}};
    const double across = fabs(f->x[0]) + fabs(f->y[0]), along = fabs(f->x[1]) + fabs(f->y[1]);
    /* The axis along which there are fewer changes is the one that is walked along. */
    const int s = along <= across ? 0 : 1, t = 1 - s;
    for (int k = 0; k < 4; k++) {
        corner[k][0] = f->at[s] + signs[k][0] * f->x[s] + signs[k][1] * f->y[s];
        corner[k][1] = f->at[t] + signs[k][0] * f->x[t] + signs[k][1] * f->y[t];
    }
    for (int k = 0; k < 4; k++) sum += along_edge(pulse, corner[k], corner[(k + 1) % 4]);
    return sum / (s == 0 ? area : -area);
}

double shd_pulses_mean(const shd_pulse *pulse, const shd_footprint *f) {
    const double mean = pulse->to - pulse->from;
    if (is_constant(pulse, f, 0)) {
        const double s = mean + rest(pulse, f->at[0]);
        return s > 0.5 ? shd_pulse_mean(pulse, f, 1) : 0;
    }
    if (is_constant(pulse, f, 1)) {
        const double t = mean + rest(pulse, f->at[1]);
        return t > 0.5 ? shd_pulse_mean(pulse, f, 0) : 0;
    }
    const double one = mean_of_rest(pulse, f, 0), other = mean_of_rest(pulse, f, 1);
    return mean * (mean + one + other) + mean_of_product(pulse, f);
}

/* ---- Ramps. ---- */

static double clamp_twice(const void *of, double s) {
    (void)of;
    const double one = shd_larger(s, 0), other = shd_larger(s - 1, 0);
    return (one * one * one - other * other * other) / 6;
}

static double repeat_twice(const void *of, double s) {
    (void)of;
    return saw3(s);
}

/* |s - 2k|: four times a wave of saw2 and one of half its period aside, in units of 2. */
static double mirror_twice(const void *of, double s) {
    (void)of;
    return 16 * (saw4(s / 2 - 0.5) - saw4(s / 2));
}

double shd_ramp_mean(shd_wrap wrap, const shd_footprint *f) {
    if (wrap == SHD_WRAP_REPEAT) return 0.5 + mean_of(repeat_twice, NULL, f, 0);
    if (wrap == SHD_WRAP_MIRROR) return 0.5 + mean_of(mirror_twice, NULL, f, 0);
    const double half = (fabs(f->x[0]) + fabs(f->y[0])) / 2, s = f->at[0];
    if (s - half >= 1) return 1;
    if (s + half <= 0) return 0;
    if (s - half >= 0 && s + half <= 1) return s;
    return mean_of(clamp_twice, NULL, f, 0);
}

static double clamp_square_twice(const void *of, double s) {
    (void)of;
    const double beyond = s - 1;
    if (s <= 0) return 0;
    return s <= 1 ? s * s * s * s / 12 : 1.0 / 12 + beyond * (1.0 / 3 + beyond / 2);
}

/* The fraction's square is 2 saw2 + saw1 + 1/3. */
static double repeat_square_twice(const void *of, double s) {
    (void)of;
    return 2 * saw4(s) + saw3(s);
}

/* (s - 2k)^2 is 8 saw2 + 1/3 of half of s, from the middle of its period. */
static double mirror_square_twice(const void *of, double s) {
    (void)of;
    return 32 * saw4(s / 2 - 0.5);
}

double shd_ramp_variance(shd_wrap wrap, const shd_footprint *f) {
    const double half = (fabs(f->x[0]) + fabs(f->y[0])) / 2, low = f->at[0] - half,
                 high = f->at[0] + half, mean = shd_ramp_mean(wrap, f);
    double square = 1.0 / 3;
    if (wrap == SHD_WRAP_CLAMP ? low >= 0 && high <= 1 : floor(low) == floor(high))
        return (f->x[0] * f->x[0] + f->y[0] * f->y[0]) / 12;
    if (wrap == SHD_WRAP_CLAMP)
        square = mean_of(clamp_square_twice, NULL, f, 0);
    else
        square += mean_of(wrap == SHD_WRAP_REPEAT ? repeat_square_twice : mirror_square_twice, NULL,
                          f, 0);
    return shd_larger(square - mean * mean, 0);
}

/* ---- Footprints. ---- */

static double length_of(const double v[2]) {
    return sqrt(v[0] * v[0] + v[1] * v[1]);
}

/* Makes a side at least as long as `least`. */
static void lengthen(double v[2], double least) {
    const double length = length_of(v);
    if (length >= least) return;
    if (length > 0) {
        v[0] *= least / length;
        v[1] *= least / length;
    } else {
        v[0] = least;
    }
}

/* Sides so long that both axes would change more often than this are shortened: over so many
 * changes a strip has its mean. */
enum { SHD_MOST_CHANGES = 64 };

static void shorten(double v[2]) {
    const double least = shd_smaller(fabs(v[0]), fabs(v[1]));
    if (!(least > SHD_MOST_CHANGES)) return;
    v[0] *= SHD_MOST_CHANGES / least;
    v[1] *= SHD_MOST_CHANGES / least;
}

/* Makes `side` no nearer than `least` to the line along `main`. */
static void thicken(const double main[2], double side[2], double least) {
    const double length = length_of(main);
    const double normal[2] = {-main[1] / length, main[0] / length};
    const double away = side[0] * normal[0] + side[1] * normal[1];
    if (fabs(away) >= least) return;
    const double more = (away < 0 ? -least : least) - away;
    side[0] += more * normal[0];
    side[1] += more * normal[1];
}

shd_footprint shd_footprint_of(const shd_footprint *f) {
    shd_footprint out = *f;
    shorten(out.x);
    shorten(out.y);
    /* Sides that are both lengthened would be as long as each other. */
    const bool main = length_of(out.x) >= length_of(out.y) * (1 - SHD_FOOTPRINT_ALIKE);
    lengthen(out.x, SHD_FOOTPRINT_LEAST);
    lengthen(out.y, SHD_FOOTPRINT_LEAST);
    if (main)
        thicken(out.x, out.y, SHD_FOOTPRINT_LEAST);
    else
        thicken(out.y, out.x, SHD_FOOTPRINT_LEAST);
    return out;
}
