/* One function a format, called by shd_image_encode after its checks: the picture's size, depth,
 * alpha and layers are what the format holds, and width * height * 32 fits into size_t. */
#ifndef SHD_IMAGE_ENCODERS_H
#define SHD_IMAGE_ENCODERS_H

#include "image/image.h"

shd_status shd_encode_png(const shd_image *image, shd_arena *scratch, shd_bytes *out,
                          shd_error *error);
shd_status shd_encode_jpeg(const shd_image *image, shd_arena *scratch, shd_bytes *out,
                           shd_error *error);
shd_status shd_encode_webp(const shd_image *image, shd_arena *scratch, shd_bytes *out,
                           shd_error *error);

/* TIFF, EXR and HDR, through the module. */
shd_status shd_encode_oiio(const shd_image *image, shd_format format, shd_arena *scratch,
                           shd_bytes *out, shd_error *error);

/* As shd_image_scratch. */
uint64_t shd_png_scratch(const shd_image *image);
uint64_t shd_jpeg_scratch(const shd_image *image, bool samples);
uint64_t shd_webp_scratch(const shd_image *image, bool samples);
uint64_t shd_oiio_scratch(const shd_image *image, shd_format format, bool samples);

/* SHD_MEMORY and SHD_CANCELLED, with one text each for all. */
shd_status shd_encode_no_memory(shd_error *error);
shd_status shd_encode_cancelled(shd_error *error);

/* Asks image->go_on, if it is there. */
bool shd_encode_goes_on(const shd_image *image);

/* Calls run(work, index, slot) for all of [0, count), slot < shd_encode_slots(image), as
 * image->spread does, or alone; before each of its own the calling thread asks whether to go on.
 * False: it was not to, and some were left out. */
bool shd_encode_spread(const shd_image *image, size_t count,
                       void (*run)(void *work, size_t index, unsigned slot), void *work);
unsigned shd_encode_slots(const shd_image *image);

#endif
