/* Where a Westin table has its entries. Only for shade/. */
#pragma once

#include "shade/westin.h"

/* The mirror image of a turn that brings quarter `quarter` to the first one; it is its own inverse.
 */
static inline int shd_westin_fold(int quarter, int turn) {
    enum { LAST = SHD_WESTIN_TURNS - 1 };
    const int images[4] = {turn, SHD_WESTIN_TURNS / 2 - 1 - turn, turn + SHD_WESTIN_TURNS / 2,
                           LAST - turn};
    return images[quarter] & LAST;
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
