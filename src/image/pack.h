/* Float RGBA rows to a format's samples. Pure functions, any thread. */
#pragma once

#include "image/image.h"

/* What a stored pixel is made of. This depends on the image's channel, alpha and depth. */
typedef struct shd_pack {
    int count;          /* samples a pixel, 1..4 */
    int source[4];      /* [count]: the channel of `rgba` that each one takes */
    size_t bytes;       /* a sample: 1, 2 or 4 (half comes as float: the module narrows it) */
    double max;         /* the largest code: 255 or 65535; 0 for half and float */
    float limit, least; /* half and float saturate to least .. limit */
    bool alpha;         /* the last sample is alpha */
    bool premultiply;   /* the other samples are multiplied by it */
} shd_pack;

/* As the format stores it. */
shd_pack shd_pack_of(const shd_image *image, shd_format format);

/* `premultiply`: the format's alpha is associated. `grey`: it has one-channel pictures, else
 * `image->channel` fills three samples. */
shd_pack shd_pack_plan(const shd_image *image, bool premultiply, bool grey);

/* One row: rgba is [width][4], out is [width][count] in native byte order: uint8_t, uint16_t or
 * float. A NaN becomes 0 in integers and stays in floats. */
void shd_pack_row(const shd_pack *pack, const float *rgba, int width, void *out);

/* Packs all rows, side by side, into `out`, [height][width][count]. The image's own samples are
 * copied if it has any. */
shd_status shd_pack_rows(const shd_pack *pack, const shd_image *image, void *out, shd_error *error);

/* Packs all rows, side by side, into arena memory. *out is the image's own samples if it has any.
 */
shd_status shd_pack_samples(const shd_pack *pack, const shd_image *image, shd_arena *scratch,
                            const void **out, shd_error *error);
