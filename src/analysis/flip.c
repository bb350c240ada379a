#include "analysis/flip.h"

#include <math.h>
#include <string.h>

#include "base/primaries.h"
#include "base/sample.h"
#include "base/transfer.h"

static const double pi = 3.14159265358979323846;

/* Table 1 and section 4.2: q_c, q_f, p_c, p_t, and the width of a feature in degrees. */
static const double COLOR_POWER = 0.7, FEATURE_POWER = 0.5, KNEE_AT = 0.4, KNEE = 0.95,
                    FEATURE_WIDTH = 0.082;

/* What a row becomes by the filters in x, each for the filters in y behind it. */
enum { LIGHT, RED, BLUE, YELLOW, SMOOTH, EDGE, POINT, PLANES };

/* What these become in y. */
enum { OUT_LIGHT, OUT_RED, OUT_BLUE, OUT_EDGE_X, OUT_EDGE_Y, OUT_POINT_X, OUT_POINT_Y, OUTS };

/* ---- Filters ---- */

/* exp(-x^2 / width), whose sum becomes 1. Returns the sum that it was. */
static double make_bell(int reach, double width, shd_taps *out) {
    double sum = 0;
    out->reach = reach;
    for (int x = -reach; x <= reach; x++) sum += exp(-x * x / width);
    for (int x = -reach; x <= reach; x++)
        out->weights[x + reach] = (float)(exp(-x * x / width) / sum);
    return sum;
}

/* The contrast sensitivity of a channel as a sum of Gaussians a sqrt(pi / b) exp(-pi^2 x^2 / b), x
 * in degrees (section 4.1.1); a bell's share of the whole, unscaled. */
static double make_contrast(int reach, double density, double a, double b, shd_taps *out) {
    const double sum = make_bell(reach, b * density * density / (pi * pi), out);
    return a * sqrt(pi / b) * sum * sum;
}

/* The Gaussian and its first two derivatives, whose weights above 0 sum to 1, and those below to -1
 * (section 4.2.1). */
static void make_features(double density, shd_flip *out) {
    const double deviation = FEATURE_WIDTH / 2 * density, square = deviation * deviation;
    const int reach = (int)ceil(3 * deviation);
    double edge = 0, above = 0, below = 0;
    make_bell(reach, 2 * square, &out->smooth);
    out->edge.reach = out->point.reach = reach;
    for (int pass = 0; pass < 2; pass++)
        for (int x = -reach; x <= reach; x++) {
            const double bell = exp(-x * x / (2 * square)), bend = (x * x / square - 1) * bell;
            if (pass) {
                out->edge.weights[x + reach] = (float)(-x * bell / edge);
                out->point.weights[x + reach] = (float)(bend / (bend < 0 ? below : above));
            } else {
                edge += x > 0 ? x * bell : 0;
                *(bend < 0 ? &below : &above) += fabs(bend);
            }
        }
}

/* ---- Colors ---- */

static void turn(const double by[3][3], const double in[3], double out[3]) {
    for (int i = 0; i < 3; i++) out[i] = by[i][0] * in[0] + by[i][1] * in[1] + by[i][2] * in[2];
}

/* CIELAB with Hunt's adjustment: colors of dark places differ less (section 4.1.2). */
static void hunt_of(const shd_flip *flip, const double rgb[3], double out[3]) {
    double xyz[3];
    turn(flip->to_xyz, rgb, xyz);
    const double x = shd_lab_curve(xyz[0]), y = shd_lab_curve(xyz[1]), z = shd_lab_curve(xyz[2]);
    out[0] = 116 * y - 16;
    out[1] = 0.01 * out[0] * 500 * (x - y);
    out[2] = 0.01 * out[0] * 200 * (y - z);
}

static double distance(const double a[3], const double b[3]) {
    return pow(fabs(a[0] - b[0]) + hypot(a[1] - b[1], a[2] - b[2]), COLOR_POWER);
}

/* The farthest colors, green and blue, are 1 apart, and what is beyond the knee is compressed
 * (section 4.1.3). */
static double spread(const shd_flip *flip, double apart) {
    const double knee = KNEE_AT * flip->most;
    if (apart < knee) return apart * KNEE / knee;
    return KNEE + (apart - knee) / (flip->most - knee) * (1 - KNEE);
}

void shd_flip_make(double density, shd_flip *out) {
    static const double green[3] = {0, 1, 0}, blue[3] = {0, 0, 1};
    const int reach = (int)ceil(3 * sqrt(0.04 / (2 * pi * pi)) * density);
    double far[3], near[3];
    *out = (shd_flip){0};
    make_contrast(reach, density, 1, 0.0047, &out->light);
    make_contrast(reach, density, 1, 0.0053, &out->red);
    const double wide = make_contrast(reach, density, 34.1, 0.04, &out->blue[0]),
                 narrow = make_contrast(reach, density, 13.5, 0.025, &out->blue[1]);
    out->blue_shares[0] = (float)(wide / (wide + narrow));
    out->blue_shares[1] = (float)(narrow / (wide + narrow));
    make_features(density, out);
    out->reach = reach > out->smooth.reach ? reach : out->smooth.reach;
    shd_primaries_to_xyz(shd_rec709, out->to_xyz);
    for (int i = 0; i < 3; i++) {
        const double white = out->to_xyz[i][0] + out->to_xyz[i][1] + out->to_xyz[i][2];
        for (int j = 0; j < 3; j++) out->to_xyz[i][j] /= white;
    }
    shd_matrix_invert(out->to_xyz, out->to_rgb);
    hunt_of(out, green, far);
    hunt_of(out, blue, near);
    out->most = distance(far, near);
}

/* ---- Rows ---- */

/* The rows of a band, and as many around it as filters reach. */
typedef struct band {
    const shd_flip *flip;
    const atomic_bool *cancelled;
    int width, height, first, rows;
    float *line; /* [3][width + 2 reach]: Y, Cx, Cz of a row and beyond its ends */
    /* Of both pictures. */
    float *planes[2][PLANES]; /* [rows + 2 reach][width] */
    float *outs[2][OUTS];     /* [width] */
} band;

static size_t line_size(const shd_flip *flip, int width) {
    return (size_t)width + 2 * (size_t)flip->reach;
}

size_t shd_flip_scratch(const shd_flip *flip, int width, int rows) {
    const size_t high = (size_t)rows + 2 * (size_t)flip->reach;
    return 3 * line_size(flip, width) + 2 * (PLANES * high + OUTS) * (size_t)width;
}

/* A row in the opponent space YCxCz (section 4.1.1), Y as a feature sees it: in [0,1]. */
static void open_row(const band *b, const float *picture, int y) {
    const size_t size = line_size(b->flip, b->width);
    for (int x = -b->flip->reach; x < b->width + b->flip->reach; x++) {
        const int column = x < 0 ? 0 : x < b->width ? x : b->width - 1;
        const float *at = picture + 3 * ((size_t)y * (size_t)b->width + (size_t)column);
        double rgb[3], xyz[3];
        for (int c = 0; c < 3; c++) rgb[c] = shd_hold((double)at[c], 1);
        turn(b->flip->to_xyz, rgb, xyz);
        float *out = b->line + (x + b->flip->reach);
        out[0] = (float)xyz[1];
        out[size] = (float)(xyz[0] - xyz[1]);
        out[2 * size] = (float)(xyz[1] - xyz[2]);
    }
}

static void filter_x(const band *b, const float *line, const shd_taps *taps, float *out) {
    const float *from = line + (b->flip->reach - taps->reach);
    memset(out, 0, (size_t)b->width * sizeof *out);
    for (int k = 0; k <= 2 * taps->reach; k++)
        for (int x = 0; x < b->width; x++) out[x] += taps->weights[k] * from[x + k];
}

static int hold_row(const band *b, int y) {
    return y < 0 ? 0 : y < b->height ? y : b->height - 1;
}

static void filter_rows(const band *b, const float *picture, float *const planes[PLANES]) {
    const shd_flip *f = b->flip;
    const size_t size = line_size(f, b->width);
    const struct {
        size_t channel;
        const shd_taps *taps;
    } how[PLANES] = {
        [LIGHT] = {0, &f->light},    [RED] = {1, &f->red},       [BLUE] = {2, &f->blue[0]},
        [YELLOW] = {2, &f->blue[1]}, [SMOOTH] = {0, &f->smooth}, [EDGE] = {0, &f->edge},
        [POINT] = {0, &f->point}};
    for (int row = 0; row < b->rows + 2 * f->reach; row++) {
        if (shd_is_cancelled(b->cancelled)) return;
        open_row(b, picture, hold_row(b, b->first - f->reach + row));
        for (int p = 0; p < PLANES; p++)
            filter_x(b, b->line + how[p].channel * size, how[p].taps,
                     planes[p] + (size_t)row * (size_t)b->width);
    }
}

/* Adds the filtered column around a row of the band. */
static void filter_y(const band *b, const float *plane, const shd_taps *taps, float share, int row,
                     float *out) {
    const float *from = plane + (size_t)(row + b->flip->reach - taps->reach) * (size_t)b->width;
    for (int k = 0; k <= 2 * taps->reach; k++, from += b->width) {
        const float weight = share * taps->weights[k];
        for (int x = 0; x < b->width; x++) out[x] += weight * from[x];
    }
}

static void filter_columns(const band *b, int side, int row) {
    const shd_flip *f = b->flip;
    float *const *planes = b->planes[side], *const *out = b->outs[side];
    for (int i = 0; i < OUTS; i++) memset(out[i], 0, (size_t)b->width * sizeof *out[i]);
    filter_y(b, planes[LIGHT], &f->light, 1, row, out[OUT_LIGHT]);
    filter_y(b, planes[RED], &f->red, 1, row, out[OUT_RED]);
    filter_y(b, planes[BLUE], &f->blue[0], f->blue_shares[0], row, out[OUT_BLUE]);
    filter_y(b, planes[YELLOW], &f->blue[1], f->blue_shares[1], row, out[OUT_BLUE]);
    filter_y(b, planes[EDGE], &f->smooth, 1, row, out[OUT_EDGE_X]);
    filter_y(b, planes[SMOOTH], &f->edge, 1, row, out[OUT_EDGE_Y]);
    filter_y(b, planes[POINT], &f->smooth, 1, row, out[OUT_POINT_X]);
    filter_y(b, planes[SMOOTH], &f->point, 1, row, out[OUT_POINT_Y]);
}

/* ---- Pixels ---- */

static void filtered_color(const shd_flip *flip, float *const outs[OUTS], int x, double hunt[3]) {
    const double y = (double)outs[OUT_LIGHT][x];
    const double xyz[3] = {y + (double)outs[OUT_RED][x], y, y - (double)outs[OUT_BLUE][x]};
    double rgb[3];
    turn(flip->to_rgb, xyz, rgb);
    for (int c = 0; c < 3; c++) rgb[c] = shd_hold(rgb[c], 1);
    hunt_of(flip, rgb, hunt);
}

static double apart(float *const a[OUTS], float *const b[OUTS], int first, int x) {
    return fabs(hypot((double)a[first][x], (double)a[first + 1][x]) -
                hypot((double)b[first][x], (double)b[first + 1][x]));
}

/* Where edges or points differ, colors count more (sections 4.2.2 and 4.3). */
static float error_at(const band *b, int x) {
    float *const *one = b->outs[0], *const *other = b->outs[1];
    double from[3], to[3];
    filtered_color(b->flip, one, x, from);
    filtered_color(b->flip, other, x, to);
    const double color = spread(b->flip, distance(from, to)),
                 feature =
                     fmax(apart(one, other, OUT_EDGE_X, x), apart(one, other, OUT_POINT_X, x));
    return (float)pow(color, 1 - pow(feature / sqrt(2), FEATURE_POWER));
}

void shd_flip_band(const shd_flip *flip, const float *a, const float *b, int width, int height,
                   int first, int rows, const atomic_bool *cancelled, float *scratch, float *out) {
    const size_t high = (size_t)rows + 2 * (size_t)flip->reach, wide = (size_t)width;
    band it = {.flip = flip,
               .cancelled = cancelled,
               .width = width,
               .height = height,
               .first = first,
               .rows = rows};
    it.line = scratch;
    scratch += 3 * line_size(flip, width);
    for (int side = 0; side < 2; side++) {
        for (int p = 0; p < PLANES; p++, scratch += high * wide) it.planes[side][p] = scratch;
        for (int i = 0; i < OUTS; i++, scratch += wide) it.outs[side][i] = scratch;
        filter_rows(&it, side ? b : a, it.planes[side]);
    }
    for (int row = 0; row < rows && !shd_is_cancelled(cancelled); row++) {
        filter_columns(&it, 0, row);
        filter_columns(&it, 1, row);
        for (int x = 0; x < width; x++) out[(size_t)row * wide + (size_t)x] = error_at(&it, x);
    }
}
