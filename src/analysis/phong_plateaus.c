/* Errors that rows have in common. Where light hardly changes, many pixels have one code, and what
 * rounding took from them is the same: no mean of many. Of rows of one code whose light spreads
 * with the standard deviation t, in that of rounding, a part v = (1 - t)^2 of the error's variance
 * is common (none where light goes evenly through all that the code stands for, and t is 1).
 * Between two rows it is a covariance of v, which is carried to the terms as least squares carry
 * errors. */
#include <stdint.h>
#include <string.h>

#include "analysis/phong_parts.h"

typedef struct row {
    uint32_t key, index;
} row;

enum { DIGIT = 11, DIGITS = 1 << DIGIT };

/* Goes up as the light does. */
static uint32_t key_of(float light) {
    uint32_t bits;
    memcpy(&bits, &light, sizeof bits);
    return bits >> 31 ? ~bits : bits | 1u << 31;
}

/* By light, digit by digit; what it is sorted into is `to`, and `from` is written over. */
static void sort_rows(row *from, row *to, size_t count) {
    for (unsigned shift = 0; shift < 3 * DIGIT; shift += DIGIT) {
        size_t starts[DIGITS] = {0}, sum = 0;
        for (size_t i = 0; i < count; i++) starts[from[i].key >> shift & (DIGITS - 1)]++;
        for (size_t d = 0; d < DIGITS; d++) {
            const size_t here = starts[d];
            starts[d] = sum;
            sum += here;
        }
        for (size_t i = 0; i < count; i++)
            to[starts[from[i].key >> shift & (DIGITS - 1)]++] = from[i];
        row *swapped = from;
        from = to;
        to = swapped;
    }
}

/* Rows of one code: sums of weighted columns and of the exponent's, and of light and its square. */
typedef struct plateau {
    size_t count;
    double columns[SHD_COLUMNS], slope, light, square;
} plateau;

static void add_row(const shd_plateau_parts *p, size_t i, plateau *to) {
    const shd_fit_rows *rows = p->rows;
    const double w = (double)rows->weight[i], d = (double)rows->diffuse[i],
                 s = (double)p->lobes[1][i],
                 light = w * (p->x[i % 3][0] + p->x[i % 3][1] * d + p->x[i % 3][2] * s);
    to->count++;
    to->columns[0] += w;
    to->columns[1] += w * d;
    to->columns[2] += w * s;
    to->slope += w * p->x[i % 3][2] * ((double)p->lobes[2][i] - (double)p->lobes[0][i]) / p->width;
    to->light += light;
    to->square += light * light;
}

/* How much of the variance is common; of one row, nothing. */
static double common_part(const plateau *g) {
    const double n = (double)g->count, mean = g->light / n,
                 spread = sqrt(fmax(g->square / n - mean * mean, 0)), left = 1 - spread;
    return left > 0 ? left * left * (1 - 1 / n) : 0;
}

static void end_plateau(const shd_plateau_parts *p, int c, const plateau *g, shd_plateaus *out) {
    const double part = g->count ? common_part(g) : 0;
    double own[SHD_COLUMNS] = {0}, toward = g->slope;
    if (!(part > 0)) return;
    for (int i = 0; i < SHD_COLUMNS; i++) {
        for (int j = 0; j < SHD_COLUMNS; j++) own[i] += p->inverse[c][i][j] * g->columns[j];
        toward += p->follow[c][i] * g->columns[i];
    }
    toward *= p->exponent / p->variance[c];
    for (int i = 0; i < SHD_COLUMNS; i++) {
        for (int j = 0; j < SHD_COLUMNS; j++) out->own[c][i][j] += part * own[i] * own[j];
        out->cross[c][i] += part * own[i] * toward;
    }
    out->exponent += part * toward * toward;
}

/* Codes are a step of sqrt(12) apart. */
static bool is_next(const shd_fit_rows *rows, size_t a, size_t b) {
    return ((double)rows->light[b] - (double)rows->light[a]) * (double)rows->weight[b] > 0.5;
}

static void go_through(const shd_plateau_parts *p, int c, row *room, row *sorted,
                       shd_plateaus *out) {
    const shd_fit_rows *rows = p->rows;
    size_t count = 0;
    plateau g = {0};
    for (size_t i = (size_t)c; i < 3 * rows->count; i += 3) {
        const bool counted = rows->alike[c] > 1 && !(rows->diffuse[i] > 0);
        if (rows->weight[i] > 0 && !counted)
            room[count++] = (row){key_of(rows->light[i]), (uint32_t)i};
    }
    sort_rows(room, sorted, count);
    for (size_t k = 0; k < count; k++) {
        if (k && is_next(rows, sorted[k - 1].index, sorted[k].index)) {
            end_plateau(p, c, &g, out);
            g = (plateau){0};
        }
        add_row(p, sorted[k].index, &g);
    }
    end_plateau(p, c, &g, out);
}

void shd_fit_find_plateaus(const shd_plateau_parts *p, float *const room[2],
                           const atomic_bool *cancelled, shd_plateaus *out) {
    memset(out, 0, sizeof *out);
    for (int c = 0; c < 3 && !shd_is_cancelled(cancelled); c++)
        if (p->variance[c] > 0) go_through(p, c, (void *)room[0], (void *)room[1], out);
}
