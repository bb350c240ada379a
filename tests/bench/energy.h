/* How much a sample pattern errs on edges: see patterns.c. Rows are of n rooks. */
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

/* Between samples and the pixel's area, and between samples whose columns and rows are so far
 * apart. */
typedef struct distances {
    int n;
    double area[MOST][MOST], apart[MOST][MOST];
} distances;

/* The integral of the distance from a corner over a rectangle. */
static inline double corner_integral(double a, double b) {
    const double d = sqrt(a * a + b * b);
    return a * b * d / 3 + (a * a * a * log((b + d) / a) + b * b * b * log((a + d) / b)) / 6;
}

static inline void find_distances(int n, distances *out) {
    out->n = n;
    for (int i = 0; i < n; i++)
        for (int k = 0; k < n; k++) {
            const double x = (i + 0.5) / n, y = (k + 0.5) / n;
            out->area[i][k] = corner_integral(x, y) + corner_integral(1 - x, y) +
                              corner_integral(x, 1 - y) + corner_integral(1 - x, 1 - y);
            out->apart[i][k] = sqrt((double)(i * i + k * k)) / n;
        }
}

static inline double energy_of(const distances *d, const int *rows) {
    static const double area = 0.52140543316472067833; /* E|U - U'| in a unit square */
    double one = 0, two = 0;
    for (int i = 0; i < d->n; i++) {
        one += d->area[i][rows[i]];
        for (int k = 0; k < d->n; k++) two += d->apart[abs(i - k)][abs(rows[i] - rows[k])];
    }
    return 2 * one / d->n - two / d->n / d->n - area;
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
