/* The rows of a PNG picture: filtered, compressed, cut into pieces that threads make side by side.
 * Where they are cut depends on the picture alone. */
#ifndef SHD_IMAGE_PNG_ROWS_H
#define SHD_IMAGE_PNG_ROWS_H

#include "image/image.h"
#include "image/pack.h"

typedef struct shd_png_rows {
    unsigned char *data; /* piece i begins at data + i * stride and has sizes[i] bytes: together */
    size_t stride;       /* deflate's blocks but the last, without zlib's head and checksum */
    size_t *sizes;
    size_t count;
    uint32_t checksum; /* Adler-32 of the filtered rows */
} shd_png_rows;

/* In arena memory. SHD_MEMORY is the only error. */
shd_status shd_png_rows_make(const shd_image *image, const shd_pack *pack, shd_arena *scratch,
                             shd_png_rows *out, shd_error *error);

#endif
