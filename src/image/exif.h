/* Exif (JEITA CP-3451) with one entry, ImageDescription, for files that have no other place for a
 * text. Pure, any thread. */
#pragma once

#include "image/image.h"

enum { SHD_EXIF_MAX = 600 };

/* The TIFF structure, up to SHD_EXIF_MAX bytes; a longer text is cut. Returns its size, which is 0
 * if the picture has nothing to tell. */
size_t shd_exif_make(const shd_image *image, unsigned char out[SHD_EXIF_MAX]);
