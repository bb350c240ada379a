/* Where a Westin table has its entries. Only for shade/. */
#pragma once

#include "shade/westin.h"

/* Doubles of a row of turns: the first three again after the last, so that three in a row can be
 * read as four from any of them. */
enum { SHD_WESTIN_ROW = SHD_WESTIN_TURNS + 4 };

/* Directions that are nearer to the normal, by their sine, have no turn: within what rounding makes
 * of it. */
static const double SHD_WESTIN_POLE = 1e-9;

/* A table whose bounces are summed up for the reflectance of a material's facets: pi f_r / kd as
 * [way of the view within a quarter][rise of the light][SHD_WESTIN_ROW], for each channel, or one
 * for all of a grey. `table` is NULL if there is none. */
typedef struct shd_westin_colored {
    const shd_westin *table;
    size_t channels;
    const double *rho[3];
} shd_westin_colored;

enum { SHD_WESTIN_CHANNEL = SHD_WESTIN_QUARTER * SHD_WESTIN_RISES * SHD_WESTIN_ROW };

/* Finds table->limits by all pairs of neighbors. */
void shd_westin_limit(shd_westin *table);

/* Fills out[SHD_WESTIN_CHANNEL] for facets of reflectance kd. */
void shd_westin_color(const shd_westin *table, double kd, double *out);

/* The mirror image of a turn that brings quarter `quarter` to the first one; it is its own inverse.
 */
static inline int shd_westin_fold(int quarter, int turn) {
    enum { LAST = SHD_WESTIN_TURNS - 1, HALF = SHD_WESTIN_TURNS / 2 };
    return ((quarter & 1 ? HALF - 1 - turn : turn) + (quarter & 2 ? HALF : 0)) & LAST;
}

/* Brings both ways where the view is in the first quarter: *view is its index there. */
static inline void shd_westin_fold_ways(int *view, int *light) {
    const int turn = *view % SHD_WESTIN_TURNS, rise = *view / SHD_WESTIN_TURNS,
              quarter = turn / (SHD_WESTIN_TURNS / 4), from = *light % SHD_WESTIN_TURNS;
    *view = rise * (SHD_WESTIN_TURNS / 4) + shd_westin_fold(quarter, turn);
    *light += shd_westin_fold(quarter, from) - from;
}

static inline const float *shd_westin_at(const shd_westin *table, int view, int light) {
    shd_westin_fold_ways(&view, &light);
    return table->rho[view][light];
}
