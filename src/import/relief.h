/* The inside of the module: pictures of heights, as MTL's `bump` has them, and the maps of normals
 * that they become. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

typedef struct shd_relief {
    void *file; /* a PNG of three channels of 16 bits, malloc'ed; NULL: all heights are the same */
    size_t length;
    double steepest; /* the largest hypot(a, b), below */
} shd_relief;

/* Of a PNG, JPEG or WebP file, whose codes are heights of 0 to 1; of colors, their luminance is (by
 * Rec. 709's weights of codes). A texel's neighbors tell by how much heights rise from texel to
 * texel, a to the right and b upward: half of their difference. Beyond an edge is the other one if
 * the picture repeats, else the rise is that to the one neighbor. Texels of the map are the vectors
 * (-a, -b, steepest), made unit, as codes of (v + 1) / 2: `steepest` is the scale that makes them
 * (-a, -b, 1). False: it is another file, damaged or too large, or there is no memory. */
bool shd_normals_of_heights(const void *bytes, size_t size, bool repeats, shd_relief *out);
