/* The same as ways.h's sums, in f32, of one term of a model. Only for shade/around_quick.c. */
#pragma once

#include "shade/ways.h"

/* Directions and three weights of each. There is room for what fills up the last step, and for rows
 * of SHD_WAYS32_ROW that are written whole. */
enum { SHD_WAYS32_STEP = 16, SHD_WAYS32_ROW = 8, SHD_WAYS32_MOST = 128 };
typedef struct shd_ways32 {
    size_t points;
    bool grey; /* the first weight is all three, and others are not read */
    float toward[3][SHD_WAYS32_MOST + SHD_WAYS32_ROW], weight[3][SHD_WAYS32_MOST + SHD_WAYS32_ROW];
} shd_ways32;

/* Whether f32 holds the point's term and light of `most` at most. Its material has one term: a
 * lobe, or Oren and Nayar's diffuse light alone, and is no microgeometry. */
bool shd_ways32_hold(const shd_way_point *p, double most);

/* Adds what 1 / pi times the weights make of the term to out[row][k], of the rows that are the
 * term's. Directions below the horizon add nothing. What is after the last of the points is
 * overwritten. Off by some 1e-5 of the largest; the same bits on every machine. */
typedef void shd_ways32_function(const shd_way_point *p, shd_ways32 *ways,
                                 double (*out)[SHD_WAY_SUMS]);
shd_ways32_function shd_sum_ways32_portable, shd_sum_ways32_avx2, shd_sum_ways32_avx512;
