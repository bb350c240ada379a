/* How much a sample pattern errs on edges and glints: see patterns.c. Rows are of n rooks. */
#ifndef SHD_BENCH_ENERGY_H
#define SHD_BENCH_ENERGY_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/vec3.h"

enum { MOST = 64 };

/* Energies that differ by less are those of mirror images. */
static const double ALIKE = 1e-12;

/* How many columns and rows make a stratum, each of which has a sample; 0: there are none. */
static inline int strata_of(int n) {
    return n == 64 ? 8 : 0;
}

/* Between samples and the pixel's area, between samples whose columns and rows are so far apart,
 * and of the area with itself. */
typedef struct distances {
    int n;
    double area[MOST][MOST], apart[MOST][MOST], self;
} distances;

/* The integral of the distance from a corner over a rectangle. */
static inline double corner_integral(double a, double b) {
    const double d = sqrt(a * a + b * b);
    return a * b * d / 3 + (a * a * a * log((b + d) / a) + b * b * b * log((a + d) / b)) / 6;
}

/* Glints are round blobs exp(-|p - c|^2 / 2 s^2), of widths s between these, in pixels. */
static const double NARROW = 0.06, WIDE = 0.18;
enum { WIDTHS = 8 };
/* What their squared error counts, beside that of edges. */
static const double GLINTS = 30;

/* The integral of a blob's product with another, 2^(1/2) as wide, over a side of the pixel. */
static inline double blob_integral(double x, double width) {
    const double half = 2 * width;
    return width * sqrt(SHD_PI) * (erf((1 - x) / half) + erf(x / half));
}

/* The squared error of a blob, summed over all of its places, is what the distance of two samples d
 * makes of pi s^2 exp(-d^2 / 4 s^2), added up as distances are, with the other sign. */
static inline void add_glints(distances *to) {
    const int n = to->n;
    for (int k = 0; k < WIDTHS; k++) {
        const double width = NARROW * pow(WIDE / NARROW, (k + 0.5) / WIDTHS),
                     weight = GLINTS / WIDTHS * SHD_PI * width * width;
        enum { STEPS = 2000 };
        double mean = 0;
        for (int i = 0; i < STEPS; i++) mean += blob_integral((i + 0.5) / STEPS, width) / STEPS;
        to->self -= weight * mean * mean;
        for (int i = 0; i < n; i++)
            for (int r = 0; r < n; r++) {
                const double apart = (double)(i * i + r * r) / n / n;
                to->area[i][r] -= weight * blob_integral((i + 0.5) / n, width) *
                                  blob_integral((r + 0.5) / n, width);
                to->apart[i][r] -= weight * exp(-apart / (4 * width * width));
            }
    }
}

static inline void find_edges(int n, distances *out) {
    out->n = n;
    out->self = 0.52140543316472067833; /* E|U - U'| in a unit square */
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            const double x = (i + 0.5) / n, y = (k + 0.5) / n;
            out->area[i][k] = corner_integral(x, y) + corner_integral(1 - x, y) +
                              corner_integral(x, 1 - y) + corner_integral(1 - x, 1 - y);
            out->apart[i][k] = sqrt((double)(i * i + k * k)) / n;
        }
}

/* Of edges; and of glints, where there are strata. */
static inline void find_distances(int n, distances *out) {
    find_edges(n, out);
    if (strata_of(n)) add_glints(out);
}

static inline double energy_of(const distances *d, const int *rows) {
    double one = 0, two = 0;
    for (int i = 0; i < d->n; i++) {
        one += d->area[i][rows[i]];
        for (int k = 0; k < d->n; k++) two += d->apart[abs(i - k)][abs(rows[i] - rows[k])];
    }
    return 2 * one / d->n - two / d->n / d->n - d->self;
}

/* Whether they may: each stratum keeps its sample. */
static inline bool may_exchange(int strata, const int *rows, int a, int b) {
    return !strata || a / strata == b / strata || rows[a] / strata == rows[b] / strata;
}

/* What the energy changes by where two samples exchange their rows. */
static inline double exchange_gain(const distances *d, const int *rows, int a, int b) {
    const int y = rows[a], z = rows[b];
    const double one = d->area[a][z] + d->area[b][y] - d->area[a][y] - d->area[b][z];
    double two = 0;
    for (int k = 0; k < d->n; k++) {
        if (k == a || k == b) continue;
        const int at = rows[k];
        two += d->apart[abs(a - k)][abs(z - at)] + d->apart[abs(b - k)][abs(y - at)] -
               d->apart[abs(a - k)][abs(y - at)] - d->apart[abs(b - k)][abs(z - at)];
    }
    return 2 * one / d->n - 2 * two / d->n / d->n;
}

#endif
