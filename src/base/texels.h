/* A picture that scenes may look up: texels in the space that light is computed in.
 *
 * Rows go from the top of the picture down and pixels from its left to its right, as in files.
 * Nothing of it ever changes; any number of threads may read it at once. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "base/digest.h"

typedef struct shd_texels {
    int width, height; /* at least 1 each */
    int colors;        /* that the file has: 1 (grey, which stands three times in rgba) or 3 */
    bool alpha;        /* whether it has an alpha; else all are 1 */
    bool integers;     /* whether it has codes of 8 or 16 bits; else floats */
    /* [height][width][4], aligned to 64 bytes: straight (never multiplied by alpha), all finite.
     * Colors may be beyond [0,1]; alpha is within. */
    const float *rgba;
    float low[4], high[4]; /* the least and the most of each channel */
    size_t held;           /* samples that were not finite and are not as the file has them */
    shd_digest file;       /* of the file's bytes */
    shd_digest key;        /* of all that the texels depend on: the file and how they were taken */
} shd_texels;

static inline size_t shd_texels_size(const shd_texels *texels) {
    return (size_t)texels->width * (size_t)texels->height * 4 * sizeof *texels->rgba;
}
