/* From moves of colors in X, Y and Z, divided by the white's, to differences in L*a*b* and their
 * length by CIEDE2000 (color/delta_e.h). All of these are upper bounds. Inside of bound/.
 *
 * L, a and b are differences of f(X), f(Y) and f(Z). These move by the slope of f between both
 * colors times the move of X, Y and Z. The CIEDE2000 difference of two near colors is at most the
 * length of (dL / SL, (1 + G) da, db): the weights SC, SH and the rotation only make it shorter (a
 * test walks through chroma and hue). The stretch 1 + G is 1.5, and less if there is chroma. */
#pragma once

#include "plan/parts.h"

typedef struct shd_interval {
    double low, high;
} shd_interval;

static const shd_interval SHD_NO_INTERVAL = {INFINITY, -INFINITY};

static inline void shd_widen(shd_interval *r, double value) {
    r->low = shd_smaller(r->low, value);
    r->high = shd_larger(r->high, value);
}

/* f of the X, Y and Z of some colors, and its slopes between colors that are a move apart. */
typedef struct shd_lab_curves {
    shd_interval value[3], slope[3];
} shd_lab_curves;

/* The curves of colors whose Y is in the interval `y`, and whose X / Y, 1 and Z / Y are in the
 * intervals `of_y`. Above the curve's straight part all three slopes fall with the same power of Y,
 * so that differences of their products with any moves are largest at the lowest Y. */
shd_lab_curves shd_lab_curves_of(const shd_interval of_y[3], shd_interval y, const double move[3]);

/* A difference in L, a and b. */
typedef struct shd_lab_difference {
    double l, a, b;
} shd_lab_difference;

/* Adds a move of X, Y and Z by `much` times `xyz`. */
void shd_lab_add(shd_lab_difference *d, const shd_interval slope[3], double much,
                 const double xyz[3]);

/* Adds errors `share` of channels, each of which is at most `part` of its channel. Each channel
 * errs for itself, but X, Y and Z err by no larger parts than that. `columns`: X, Y and Z of
 * channels. The two colors are `move` apart, and in the intervals `of_y` times `y` at most. */
void shd_lab_add_shares(shd_lab_difference *d, const double share[3], const double columns[3][3],
                        double part, const shd_interval slope[3], const shd_interval of_y[3],
                        double y, const double move[3]);

/* The CIEDE2000 difference of colors whose f are in the intervals, or a simpler estimate of it that
 * is no more than `enough`. */
double shd_lab_length(const shd_lab_difference *d, const shd_interval f[3], double enough);
