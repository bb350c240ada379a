/* The inside of the module: what a picture is in the mean. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "decode/decode.h"

/* Of a PNG, JPEG or WebP file: the means of its codes over the largest, red, green, blue and alpha,
 * and those of what sRGB makes of the colors. False: it is another file, damaged or too large. */
bool shd_measure_picture(const void *bytes, size_t size, float mean[4], float linear[3]);

/* The samples of such a file, in 8 or 16 bits, which the caller frees. NULL: as above. */
void *shd_decode_codes(const void *bytes, size_t size, shd_decoded *picture);
