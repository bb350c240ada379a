#include "plan/nodes.h"

#include <math.h>

#include "base/pattern.h"

/* A frame in the pixel, with a unit vector (c, s) and the one to its left for axes. */
typedef struct frame {
    double c, s;
} frame;

static double power(double x, int n) {
    double p = 1;
    while (n-- > 0) p *= x;
    return p;
}

/* The pattern's mean of u^i v^j. */
static double moment(int samples, frame f, int i, int j) {
    double sum = 0;
    for (int k = 0; k < samples; k++) {
        double x, y;
        shd_sample_offset(k, samples, &x, &y);
        x -= 0.5;
        y -= 0.5;
        sum += power(f.c * x + f.s * y, i) * power(f.c * y - f.s * x, j);
    }
    return sum / samples;
}

/* The rule's. */
static double rule_moment(const shd_rule *r, int i, int j) {
    double sum = 0;
    for (size_t k = 0; k < r->count; k++)
        sum += r->weight[k] * power(r->x[k], i) * power(r->y[k], j);
    return sum;
}

/* The unit vector at half the angle of another one, between -90 and 90 degrees. */
static frame half_of(frame f) {
    const double c = sqrt(fmax(0, 1 + f.c) / 2);
    return c > 1e-8 ? (frame){c, f.s / (2 * c)} : (frame){0, 1};
}

/* A frame in which the mean of u v is 0, and if any is that, those of u^3 v - u v^3. Rows and
 * columns have one sample each, so that u^2 and v^2 have one mean in the picture's frame. */
static frame even_frame(int samples) {
    static const frame PICTURE = {1, 0}, ASLANT = {0.7071067811865476, 0.7071067811865476};
    if (fabs(moment(samples, PICTURE, 1, 1)) > 1e-9) return ASLANT;
    /* The mean of (x + i y)^4 turns four times as fast as the frame. */
    const double real = moment(samples, PICTURE, 4, 0) + moment(samples, PICTURE, 0, 4) -
                        6 * moment(samples, PICTURE, 2, 2),
                 imaginary = 4 * (moment(samples, PICTURE, 3, 1) - moment(samples, PICTURE, 1, 3)),
                 length = sqrt(real * real + imaginary * imaginary);
    if (!(length > 1e-9)) return PICTURE;
    return half_of(half_of((frame){real / length, imaginary / length}));
}

static void add_node(shd_rule *r, frame f, double u, double v, double weight) {
    r->x[r->count] = f.c * u - f.s * v;
    r->y[r->count] = f.s * u + f.c * v;
    r->weight[r->count++] = weight;
}

/* What two means of a form of degree d are apart at most, if it is no more than 1 on the unit
 * circle. A form's polarized values are no more than its own there (S. Banach, "Uber homogene
 * Polynome in (L2)", 1938), so that its coefficients are no more than binomial ones. */
static double apart(int samples, const shd_rule *r, int degree) {
    const frame picture = {1, 0};
    double sum = 0, binomial = 1;
    for (int j = 0; j <= degree; j++) {
        sum += binomial *
               fabs(moment(samples, picture, degree - j, j) - rule_moment(r, degree - j, j));
        binomial = binomial * (degree - j) / (j + 1);
    }
    return sum;
}

/* Means of degrees from 3 up to 7 are told by their moments, and those of all above are no more
 * than that of (z / r)^8 / (1 - z / r), of both: of the rule, with the sizes of weights. */
static void set_shares(int samples, shd_rule *r) {
    enum { LAST = 7 };
    static const double SQUARES[5] = {1, 4, 6, 4, 1}; /* of (u^2 + v^2)^4 */
    const frame picture = {1, 0};
    r->reach = 0.5;
    double off[LAST + 1], eighth = 0, spread = 0, reach = 0.7071067812;
    for (int d = 3; d <= LAST; d++) off[d] = apart(samples, r, d);
    for (int i = 0; i <= 4; i++) eighth += SQUARES[i] * moment(samples, picture, 8 - 2 * i, 2 * i);
    for (size_t k = 0; k < r->count; k++) {
        const double square = r->x[k] * r->x[k] + r->y[k] * r->y[k];
        eighth += fabs(r->weight[k]) * power(square, 4);
        reach = fmax(reach, sqrt(square));
        r->reach = fmax(r->reach, fmax(fabs(r->x[k]), fabs(r->y[k])));
        spread += fabs(r->weight[k]);
    }
    if (!(spread <= (r->rim ? SHD_NODES_SPREAD : 1 + 1e-9))) eighth = INFINITY;
    double radius = SHD_DISC_LEAST;
    for (size_t k = 0; k < SHD_DISCS; k++) {
        double sum = eighth / (power(radius, 7) * (radius - reach));
        for (int d = 3; d <= LAST; d++) sum += off[d] / power(radius, d);
        r->share[k] = sum;
        radius *= SHD_DISC_STEP;
    }
}

/* Lagrange's polynomial that is 1 at `at` of the places from -rim up to rim, and 0 at the others.
 */
static double lagrange(int rim, int at, double x) {
    double product = 1;
    for (int other = -rim; other <= rim; other++)
        if (other != at) product *= (x - other) / (at - other);
    return product;
}

/* The rule of the centers up to `rim` pixels away: the pattern's mean of the polynomial of degree
 * 2 rim in each coordinate that has their values. */
static void set_centers(int samples, int rim, shd_rule *shared) {
    const frame picture = {1, 0};
    shared->rim = rim;
    for (int row = -rim; row <= rim; row++)
        for (int column = -rim; column <= rim; column++) {
            double sum = 0;
            for (int k = 0; k < samples; k++) {
                double x, y;
                shd_sample_offset(k, samples, &x, &y);
                sum += lagrange(rim, column, x - 0.5) * lagrange(rim, row, y - 0.5);
            }
            add_node(shared, picture, column, row, sum / samples);
        }
}

/* Rules of 4 and of 7 nodes in the pixel. */
static void set_own(int samples, shd_rule *four, shd_rule *seven) {
    const frame f = even_frame(samples);
    const double uu = moment(samples, f, 2, 0), vv = moment(samples, f, 0, 2),
                 u4 = moment(samples, f, 4, 0), v4 = moment(samples, f, 0, 4),
                 u2v2 = moment(samples, f, 2, 2);
    const double u = sqrt(2 * uu), v = sqrt(2 * vv);
    for (int k = -1; k <= 1; k += 2) {
        add_node(four, f, k * u, 0, 0.25);
        add_node(four, f, 0, k * v, 0.25);
    }
    /* J. Radon's, "Zur mechanischen Kubatur" (1948), for measures that are even in u and in v. */
    const double p = sqrt(u4 / uu), q = sqrt(u2v2 / uu), corner = uu * uu / (4 * u4),
                 rest = vv - uu * u2v2 / u4, rest4 = v4 - u2v2 * u2v2 / u4,
                 beside = rest * rest / (2 * rest4), z = sqrt(rest4 / rest);
    add_node(seven, f, 0, 0, 1 - 4 * corner - 2 * beside);
    for (int k = -1; k <= 1; k += 2) {
        add_node(seven, f, p, k * q, corner);
        add_node(seven, f, -p, k * q, corner);
        add_node(seven, f, 0, k * z, beside);
    }
}

void shd_rules_of(int samples, shd_rule out[SHD_RULES]) {
    const size_t count = shd_rule_count(samples);
    for (size_t r = 0; r < SHD_RULES; r++) out[r] = (shd_rule){0};
    for (int rim = 1; rim <= SHD_FRINGE; rim++) set_centers(samples, rim, &out[rim - 1]);
    if (count > SHD_FRINGE) set_own(samples, &out[SHD_FRINGE], &out[SHD_FRINGE + 1]);
    for (size_t r = 0; r < count; r++) set_shares(samples, &out[r]);
}
