/* How far off a table of an environment is, measured when it is made. */
#include <string.h>

#include "shade/environment.h"
#include "shade/prefilter_parts.h"

enum { BANDS = 12, SPREAD = 12, BESIDE = 24, PLACES = BANDS + SPREAD + BESIDE, HOT = 64 };

static shd_vec3 direction_at(double down, double turn) {
    return (shd_vec3){-sin(down) * sin(turn), cos(down), sin(down) * cos(turn)};
}

/* What cubic interpolation leaves out is about the fourth differences of its nodes: the place in
 * the middle of the four where they are largest, in a band of rows. */
static shd_vec3 find_bend(const shd_prefilter *t, int from, int to) {
    const size_t wide = (size_t)t->columns + 4;
    const float *table = shd_table_of(t);
    float most = -1;
    int row = from, column = 0;
    for (int j = from; j < to; j++)
        for (int i = 0; i < t->columns; i++)
            for (int c = 0; c < 3; c++) {
                const float *at = table + 3 * ((size_t)(j + 2) * wide + (size_t)(i + 2)) + c;
                const ptrdiff_t x = 3, y = 3 * (ptrdiff_t)wide;
                const float bend =
                    fabsf(at[-2 * x] - 4 * at[-x] + 6 * at[0] - 4 * at[x] + at[2 * x]) +
                    fabsf(at[-2 * y] - 4 * at[-y] + 6 * at[0] - 4 * at[y] + at[2 * y]);
                if (bend <= most) continue;
                most = bend;
                row = j;
                column = i;
            }
    return direction_at(SHD_PI * (row + 1) / t->rows, 2 * SHD_PI * (column + 1) / t->columns);
}

/* The k-th of points that are spread evenly in a cube: shares in [0, 1) (M. Roberts, The
 * Unreasonable Effectiveness of Quasirandom Sequences, 2018). */
static void share_out(int k, double u[4]) {
    static const double steps[] = {0.8566748838545029, 0.7338918566271260, 0.6287067210378087,
                                   0.5385972572236101};
    for (int d = 0; d < 4; d++) u[d] = k * steps[d] - floor(k * steps[d]);
}

/* A normal whose horizon is as far from w as the angle `height`, to the side `turn`. */
static shd_vec3 lean(shd_vec3 w, double height, double turn) {
    const shd_vec3 x = {1, 0, 0}, y = {0, 1, 0};
    shd_vec3 a = x, out;
    shd_normalize(shd_cross(fabs(w.x) < 0.5 ? x : y, w), &a);
    const shd_vec3 b = shd_cross(w, a);
    out = shd_scale(w, sin(height));
    out = shd_madd(out, a, cos(height) * cos(turn));
    return shd_madd(out, b, cos(height) * sin(turn));
}

static void find_places(const shd_prefilter *t, double width, shd_vec3 places[PLACES]) {
    for (int k = 0; k < BANDS; k++)
        places[k] = find_bend(t, t->rows * k / BANDS, t->rows * (k + 1) / BANDS);
    /* Beside them, where nodes themselves may be off by as much as texels are finer than bands. */
    for (int k = 0; k < BESIDE; k++) {
        double u[4];
        share_out(k, u);
        places[BANDS + SPREAD + k] =
            lean(places[k % BANDS], SHD_PI / 2 - 2 * width * u[1], 2 * SHD_PI * u[2]);
    }
    for (int k = 0; k < SPREAD; k++)
        places[BANDS + k] = direction_at(acos(1 - (2 * k + 1.0) / SPREAD), 2.399963229728653 * k);
}

/* The middle of a cell in which radiance differs much, and the n-th part of them. */
static shd_vec3 hot_place(const shd_prefilter *t, int n) {
    const float *at = shd_cells_of(t) + shd_hot_of(t)[n];
    return (shd_vec3){(double)at[0], (double)at[t->cell_stride], (double)at[2 * t->cell_stride]};
}

static double differ(const double a[3], const double b[3]) {
    return fmax(fabs(a[0] - b[0]), fmax(fabs(a[1] - b[1]), fabs(a[2] - b[2])));
}

static double cut_off_by(const shd_surroundings *map, const shd_prefilter *t, shd_vec3 w,
                         shd_vec3 n) {
    double told[3], exact[3];
    shd_environment_integrate(map, t->exponent, w, shd_scale(n, -1), exact);
    shd_prefilter_cut(t, w, n, told);
    return differ(told, exact);
}

/* The cell up to which a share of all contrast is. */
static int watched_at(const shd_prefilter *t, double all, double share) {
    const float *contrast = shd_contrast_of(t);
    double sum = 0;
    for (int k = 0; k < t->watched; k++) {
        sum += (double)contrast[k];
        if (sum > share * all) return k;
    }
    return 0;
}

/* Horizons through cells in which radiance differs, as often as it does, and beside these, with
 * lobes at them and beside. Those that have smaller ones are as likely to be off as others. */
static double measure_hot(const shd_surroundings *map, const shd_prefilter *t, double width,
                          const atomic_bool *cancelled) {
    double most = 0, all = 0;
    for (int k = 0; k < t->watched; k++) all += (double)shd_contrast_of(t)[k];
    for (int k = 0; k < HOT && all > 0; k++) {
        if (shd_is_cancelled(cancelled)) break;
        double u[4];
        share_out(k, u);
        const shd_vec3 hot = hot_place(t, watched_at(t, all, u[0])),
                       w = lean(hot, SHD_PI / 2 - 1.6 * width * u[1], 2 * SHD_PI * u[2]),
                       up = lean(hot, (2 * u[3] - 1) * 0.8 * (double)t->cell_step, 2.4 * k);
        most = fmax(most, cut_off_by(map, t, w, up));
    }
    return most;
}

bool shd_measure_filter(const shd_surroundings *map, shd_prefilter *t,
                        const atomic_bool *cancelled) {
    enum { SAFETY = 3 };
    static const double heights[] = {0.05, 0.6, 1.4, 0.3};
    const double width = 1 / sqrt(fmax(t->exponent, 1));
    shd_vec3 places[PLACES];
    double table = 0, cut = 0, told[3], exact[3];
    find_places(t, width, places);
    for (int k = 0; k < PLACES; k++) {
        if (shd_is_cancelled(cancelled)) return false;
        const shd_vec3 w = places[k];
        shd_environment_integrate(map, t->exponent, w, w, exact);
        shd_prefilter_weigh(t, w, NULL, told);
        table = fmax(table, differ(told, exact));
        if (!t->cell_rows || k >= BANDS + SPREAD) continue;
        const shd_vec3 n = lean(w, fmin(heights[k % 4] * width, 1.2), 2.6 * k);
        cut = fmax(cut, cut_off_by(map, t, w, n));
    }
    if (t->cell_rows) cut = fmax(cut, measure_hot(map, t, width, cancelled));
    t->error = SAFETY * table + 1e-6 * shd_surroundings_most(map, t->exponent);
    t->cut_error = t->cell_rows ? SAFETY * cut + t->faint : 0;
    return !shd_is_cancelled(cancelled);
}
