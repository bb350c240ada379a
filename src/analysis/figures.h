/* Figures of a channel: extremes, mean, exact percentiles, a histogram.
 *
 * Percentiles are of the nearest rank: the p-th of n values is the one at place ceil(p n / 100)
 * when they are in order, counted from 1. Nothing here depends on the number of threads. */
#pragma once

#include "base/arena.h"
#include "base/cancel.h"

enum { SHD_PERCENTILES = 7, SHD_BINS = 64 };

extern const int shd_percentiles[SHD_PERCENTILES]; /* percent, rising */

/* What a channel's values are like: the edges of its histogram, where all values are within. */
typedef struct shd_extent {
    double low, high;
} shd_extent;

typedef struct shd_figures {
    uint64_t count;        /* of values that are finite; all below is 0 if there are none */
    double min, max, mean; /* the mean is a sum of f64 in the order of the values */
    double percentiles[SHD_PERCENTILES];
    /* Bins of equal width from low to high, which are moved apart as far as values go. A value on
     * an edge is in the upper bin, but for `high` itself. */
    double low, high;
    uint64_t bins[SHD_BINS];
} shd_figures;

/* Of [count] values, but for those that are not finite. `extent` has low < high. Working memory
 * comes from shd_figures_scratch. False: it was cancelled. Different threads may use different
 * scratches at once. */
typedef struct shd_figures_scratch shd_figures_scratch;

shd_figures_scratch *shd_figures_scratch_new(shd_arena *arena); /* NULL: the arena is full */
bool shd_figures_find(const float *values, size_t count, shd_extent extent,
                      shd_figures_scratch *scratch, const atomic_bool *cancelled, shd_figures *out);
