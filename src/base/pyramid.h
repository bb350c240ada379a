/* A picture at all of its sizes: each level has half the width and height of the one before,
 * rounded up, down to a single texel, and each of its texels is the mean of what it covers.
 *
 * Means are of light: texels are linear in the space that light is computed in. They are weighted
 * by area, so that the mean of each level is the picture's, whatever its size is; colors are
 * straight, and what is transparent counts as much as what is not. Nothing of it ever changes; any
 * number of threads may read it at once. */
#pragma once

#include "base/cancel.h"
#include "base/texels.h"

typedef struct shd_level {
    int width, height;
    const float *rgba; /* [height][width][4], as shd_texels.rgba */
} shd_level;

enum { SHD_LEVELS_MOST = 32 };

typedef struct shd_pyramid {
    const shd_texels *texels; /* the first level */
    bool grey;                /* red, green and blue of each of its texels are equal */
    int count;
    shd_level levels[SHD_LEVELS_MOST];
} shd_pyramid;

/* Bytes of all levels but the first, and of what stands before them. */
size_t shd_pyramid_size(const shd_texels *texels);

/* Makes them in memory of that size, aligned to 64. False: it was cancelled. */
bool shd_pyramid_fill(const shd_texels *texels, const atomic_bool *cancelled, void *memory);

/* The pyramid of texels and of what was made of them, which both outlive it. */
void shd_pyramid_open(const shd_texels *texels, const void *memory, shd_pyramid *out);
