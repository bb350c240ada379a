/* ICC profiles, made from primaries and a transfer function, for files that cannot name their color
 * space in another way. Pure functions, any thread. */
#pragma once

#include "image/image.h"

enum { SHD_ICC_MAX = 3072 }; /* bytes; profiles have about 600, of PQ and HLG 2,700 */

typedef struct shd_icc {
    unsigned char data[SHD_ICC_MAX];
    size_t size;   /* 0: none */
    char name[48]; /* "Display P3" */
} shd_icc;

/* Whether the picture's color is nothing but sRGB, which PNG says in a chunk of its own. */
bool shd_image_is_srgb(const shd_image *image);

/* Code points of ITU-T H.273 for a picture's RGB: primaries, transfer, matrix (0, RGB) and full
 * range (1). False: there are none for it. Gammas 2.4 and 2.6 have none: 1, BT.709, stands for a
 * camera's curve to many readers. */
bool shd_image_code_points(const shd_image *image, unsigned char codes[4]);

/* The RGB profile that fits the picture. Its size is 0 if the picture's transfer or primaries are
 * not known, if it has one channel, or if the primaries span no volume. That of PQ and HLG has a
 * cicpTag (ICC.1:2022, 9.2.17), where there are code points; who does not know of that gets SDR:
 * channels up to 0.6 of reference white, 203 cd/m2, as they are, and what is brighter rolled off
 * to 1. */
shd_icc shd_icc_make(const shd_image *image);
