#include "bound/shown/lab.h"

#include "base/bits.h"
#include "base/transfer.h"

/* t^(-1/3) of a normal number, to 1e-9, by Newton's steps from an estimate by the exponent. */
static double inverse_cube_root(double t) {
    if (!(t < 1e300)) return 0;
    double root = shd_double_of(0x553EF0FF289DD796u - shd_bits64_of(t) / 3);
    for (int i = 0; i < 3; i++) root *= (4 - t * root * root * root) * (1.0 / 3);
    return root;
}

/* f and its slope. */
static double lab_curve(double t, double *slope) {
    if (!(t > SHD_LAB_STRAIGHT)) {
        *slope = SHD_LAB_SLOPE;
        return shd_lab_curve(t);
    }
    const double root = inverse_cube_root(t), squared = root * root;
    *slope = squared / 3;
    return t * squared;
}

shd_lab_curves shd_lab_curves_of(const shd_interval of_y[3], shd_interval y, const double move[3]) {
    shd_lab_curves f;
    bool curved = true;
    for (int r = 0; r < 3; r++) curved &= y.low * of_y[r].low - move[r] > SHD_LAB_STRAIGHT;
    const double high = curved ? y.low : y.high;
    /* Not less than the cube root of the highest Y over the lowest. */
    const double rise = curved ? 1 + (y.high / y.low - 1) / 3 : 1;
    for (int r = 0; r < 3; r++) {
        f.value[r].low = lab_curve(y.low * of_y[r].low - move[r], &f.slope[r].high);
        f.value[r].high = lab_curve(high * of_y[r].high + move[r], &f.slope[r].low) * rise;
    }
    return f;
}

/* The least SL of colors whose f(Y) is in the range. */
static double least_lightness_weight(shd_interval f) {
    const double low = 116 * f.low - 16, high = 116 * f.high - 16;
    if (low <= 50 && high >= 50) return 1;
    const double off = (low > 50 ? low : high) - 50, squared = off * off;
    return 1 + 0.015 * squared / sqrt(20 + squared);
}

/* The most that |p - q| is if p is x times a number in `slope`, and q is y times one in `other`. */
static double largest_apart(shd_interval slope, double x, shd_interval other, double y) {
    if (x < 0 || y < 0)
        return x <= 0 && y <= 0 ? largest_apart(slope, -x, other, -y)
                                : slope.high * fabs(x) + other.high * fabs(y);
    return shd_larger(slope.high * x - other.low * y, other.high * y - slope.low * x);
}

/* Differences are linear in the slopes, so that the ends of these have the extremes. */
void shd_lab_add(shd_lab_difference *d, const shd_interval slope[3], double much,
                 const double xyz[3]) {
    if (!(much > 0)) return;
    d->l += much * slope[1].high * fabs(xyz[1]) * 116;
    d->a += much * largest_apart(slope[0], xyz[0], slope[1], xyz[1]) * 500;
    d->b += much * largest_apart(slope[1], xyz[1], slope[2], xyz[2]) * 200;
}

/* The most that a* is stretched by, which is less if there is much chroma. */
static double stretch_of(const shd_interval f[3], double moved) {
    const double a = 500 * shd_larger(shd_larger(f[0].low - f[1].high, f[1].low - f[0].high), 0),
                 b = 200 * shd_larger(shd_larger(f[1].low - f[2].high, f[2].low - f[1].high), 0);
    const double chroma = shd_larger(sqrt(a * a + b * b) - moved, 0);
    if (!(chroma > 1)) return 1.5;
    const double third = chroma * chroma * chroma, seventh = third * third * chroma;
    return 1.5 - 0.5 * sqrt(seventh / (seventh + 6103515625.0));
}

/* What rounding adds to CIEDE2000 itself, in f64. L, a and b are differences of numbers up to 1,
 * times up to 500. Differences of hues, which are up to 2 pi, are multiplied with the chroma. */
static const double FORMULA = 1e-12;

double shd_lab_length(const shd_lab_difference *d, const shd_interval f[3], double enough) {
    const double l = d->l, b = d->b;
    double a = 1.5 * d->a, length = sqrt(l * l + a * a + b * b);
    if (length <= enough) return length;
    const double weight = least_lightness_weight(f[1]);
    a = stretch_of(f, sqrt(a * a + b * b)) * d->a;
    return length > 0 ? sqrt(l * l / (weight * weight) + a * a + b * b) + FORMULA : 0;
}

/* The most that t times the slope of f between colors a move apart is, for any t up to `most`. It
 * rises in the straight part. Above, it is t (t - move)^(-2/3), which rises from 3 moves on. */
static double largest_product(double most, double move) {
    double slope;
    const double straight = SHD_LAB_SLOPE * shd_smaller(most, 3 * move + SHD_LAB_STRAIGHT);
    lab_curve(most - move, &slope);
    return shd_larger(straight, slope * most);
}

void shd_lab_add_shares(shd_lab_difference *d, const double share[3], const double columns[3][3],
                        double part, const shd_interval slope[3], const shd_interval of_y[3],
                        double y, const double move[3]) {
    shd_lab_difference sum = {.l = 0};
    double most[3];
    bool positive = true;
    for (int c = 0; c < 3; c++) {
        shd_lab_add(&sum, slope, share[c], columns[c]);
        for (int r = 0; r < 3; r++) positive &= columns[c][r] >= 0;
    }
    for (int r = 0; r < 3; r++)
        most[r] = positive ? part * largest_product(y * of_y[r].high, move[r]) : INFINITY;
    d->l += shd_smaller(sum.l, 116 * most[1]);
    d->a += shd_smaller(sum.a, 500 * (most[0] + most[1]));
    d->b += shd_smaller(sum.b, 200 * (most[1] + most[2]));
}
