/* Where one sample a pixel tells what a whole pattern would. Inside of render/.
 *
 * Pixel centres are cast and lit, those of a pixel's eight neighbors too. Where all nine see one
 * object with a convex silhouette that is alone there, every sample of the pixel sees it, and the
 * mean over the pattern is taken from the biquadratic through the nine values. It is believed where
 *
 * - nothing is narrower than pixels: from pixel to pixel the lobes' exponents, the normal and the
 *   directions to lights change little, so that no highlight or spot falls between the centres;
 * - second differences in four directions are below the tolerance. A line across which light
 *   jumps or bends (a shadow's or spot's edge, an edge of a box, the terminator) that touches the
 *   pixel parts the nine centres, and shows in them at least twice as large as the error that it
 *   makes.
 *
 * A pixel's verdict depends on its nine centres alone, so that a region equals the crop. */
#ifndef SHD_RENDER_REFINE_H
#define SHD_RENDER_REFINE_H

#include <stdint.h>

#include "base/cpu.h"
#include "plan/plan.h"

enum {
    SHD_GRID = 34,                                  /* a tile's pixels, and one around it */
    SHD_GRID_CELLS = SHD_GRID * (SHD_GRID + 1) + 16 /* loops read on: rows end in whole vectors */
};

/* Centres of a grid, row by row; values are 0 where nothing was hit. */
typedef struct shd_centres {
    const int32_t *object;                         /* -1: nothing */
    const float *place[3], *normal[3], *mirror[3]; /* plan's frame */
    const float *const *sums;                      /* [sum_count] */
    const float *absolute; /* [sum_count]: second differences may be up to */
    float relative;        /* absolute + relative value */
    int sum_count;
    float shininess; /* the largest */
    float reach;     /* 1 / the distance to the closest light; */
    float footprint; /* times a pixel's step at most 1: light's smallest details */
} shd_centres;

/* What verdicts take a material's color for: the next power of two, so that they stay while it
 * changes a little, and sums of light can be kept. */
float shd_refine_coefficient(const double color[3]);

typedef struct shd_refine_kernel {
    /* settled[i] for `count` pixels from cell `first` of the grid on: 1 where the nine centres
     * tell the mean. */
    void (*judge)(const shd_centres *centres, int first, int count, int32_t *settled);
    /* out[i] = sum of the nine values around cell first + i, times weights. Writes whole vectors:
     * `out` has room for 16 more. */
    void (*predict)(const float *values, const float weights[9], int first, int count, float *out);
} shd_refine_kernel;

extern const shd_refine_kernel shd_refine_kernel_portable, shd_refine_kernel_avx2,
    shd_refine_kernel_avx512;

#endif
