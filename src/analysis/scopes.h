/* Scopes: pictures of what is displayed, as wide and high as it is, in 8-bit sRGB.
 *
 * Traces are counts of pixels in each cell of the plot, which are brighter the more there are; they
 * depend on nothing but the values. Graticules and labels are drawn for the picture's own size, and
 * are left out where there is no room for them. Any thread. */
#pragma once

#include "base/arena.h"
#include "base/cancel.h"
#include "base/catalog.h"
#include "base/scope.h"

typedef struct shd_scoped {
    int width, height;
    const float *rgba;     /* [height][width][4]: displayed values; where alpha is 0 nothing is */
    shd_channels channels; /* SHD_RGB or SHD_YIQ */
    const float *stops;    /* falsecolor: [height][width]: log2(Y / 0.18); -inf: no light */
    const float (*places)[2]; /* chromaticity: [height][width] u'v'; NaN: none */
    double primaries[4][2];   /* chromaticity: u'v' of red, green, blue and white */
} shd_scoped;

/* Paints all of rgb, [height][width][3]. Working memory, which shd_scope_scratch counts, comes from
 * `scratch`. False: it is full, or cancelled. */
bool shd_scope_paint(shd_scope scope, const shd_scoped *scoped, unsigned char *rgb,
                     shd_arena *scratch, const atomic_bool *cancelled);

/* The bytes of working memory of a scope of that size, but for the lines that are drawn. */
size_t shd_scope_scratch(shd_scope scope, size_t pixels);

/* Where chroma is drawn in a vectorscope of that size: pixels, y downward. For tests, too. */
void shd_vectorscope_place(int width, int height, double i, double q, double *x, double *y);

/* Where u'v' is drawn in a chromaticity scope. */
void shd_chromaticity_place(int width, int height, const double uv[2], double *x, double *y);
