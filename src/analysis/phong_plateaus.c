/* Errors that rows have in common. Where light hardly changes, many pixels have one code, and what
 * rounding took from them is the same: no mean of many. Of rows of one code whose light spreads
 * with the standard deviation t, in that of rounding, a part v = (1 - t)^2 of the error's variance
 * is common (none where light goes evenly through all that the code stands for, and t is 1).
 * Between two rows it is a covariance of v, which is carried to the terms as least squares carry
 * errors. */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "analysis/phong_parts.h"

typedef struct row {
    float light;
    uint32_t index;
} row;

static int compare(const void *a, const void *b) {
    const row *x = a, *y = b;
    if (x->light != y->light) return x->light < y->light ? -1 : 1;
    return (x->index > y->index) - (x->index < y->index);
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
static bool is_next(const shd_plateau_parts *p, const row *a, const row *b) {
    return ((double)b->light - (double)a->light) * (double)p->rows->weight[b->index] > 0.5;
}

void shd_fit_find_plateaus(const shd_plateau_parts *p, float *room, const atomic_bool *cancelled,
                           shd_plateaus *out) {
    row *sorted = (void *)room;
    memset(out, 0, sizeof *out);
    for (int c = 0; c < 3; c++) {
        size_t count = 0;
        plateau g = {0};
        if (!(p->variance[c] > 0)) continue;
        for (size_t i = (size_t)c; i < 3 * p->rows->count; i += 3) {
            const bool counted = p->rows->alike[c] > 1 && !(p->rows->diffuse[i] > 0);
            if (p->rows->weight[i] > 0 && !counted)
                sorted[count++] = (row){p->rows->light[i], (uint32_t)i};
        }
        if (shd_is_cancelled(cancelled)) return;
        qsort(sorted, count, sizeof *sorted, compare);
        for (size_t k = 0; k < count; k++) {
            if (k && is_next(p, &sorted[k - 1], &sorted[k])) {
                end_plateau(p, c, &g, out);
                g = (plateau){0};
            }
            add_row(p, sorted[k].index, &g);
        }
        end_plateau(p, c, &g, out);
    }
}
