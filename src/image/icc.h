/* ICC profiles, made from primaries and a transfer function, for files that cannot name their color
 * space in another way. Pure functions, any thread. */
#pragma once

#include "image/image.h"

enum { SHD_ICC_MAX = 1024 }; /* bytes; the profiles have about 600 */

typedef struct shd_icc {
    unsigned char data[SHD_ICC_MAX];
    size_t size;   /* 0: none */
    char name[48]; /* "Display P3" */
} shd_icc;

/* Whether the picture's color is nothing but sRGB, which PNG says in a chunk of its own. */
bool shd_image_is_srgb(const shd_image *image);

/* The RGB profile that fits the picture. Its size is 0 if the picture's transfer or primaries are
 * not known, if the transfer is PQ or HLG, if it has one channel, or if the primaries span no
 * volume. */
shd_icc shd_icc_make(const shd_image *image);
