/* Pictures from files, as their samples: for checking what was written. */
#pragma once

#include "image/image.h"

typedef struct shd_samples {
    int width, height, count; /* count: samples a pixel, 1 to 4 */
    bool alpha;               /* the last of them is alpha */
    bool associated;          /* colors are multiplied by it */
    shd_depth depth;
    float *values; /* malloc: [height][width][count]; codes of integers, exactly */
} shd_samples;

/* Reads the picture in a file, which is to be as wide and high, by OpenImageIO, whose module is
 * loaded: TIFF, EXR and HDR. Layers are left out. SHD_SCENE: it cannot be read, or is of another
 * size. SHD_EXHAUSTED: out of memory. */
shd_status shd_image_read(const char *path, int width, int height, shd_samples *out,
                          shd_error *error);

/* The same of any size up to `most` pixels, which *out tells. Above: SHD_LIMIT. */
shd_status shd_image_read_any(const char *path, size_t most, shd_samples *out, shd_error *error);

/* That of a file in memory, of JPEG or WebP: [height][width][count] codes of 8 bits go to
 * `out`. False: it cannot be read as such. */
bool shd_image_decode(shd_format format, const unsigned char *data, size_t size, int width,
                      int height, int count, unsigned char *out);
