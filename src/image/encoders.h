/* One function a format, called by shd_image_encode after its checks: the picture's size, depth,
 * alpha and layers are what the format holds, and width * height * 32 fits into size_t. */
#pragma once

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
uint64_t shd_webp_scratch(const shd_image *image);
uint64_t shd_oiio_scratch(const shd_image *image, shd_format format, bool samples);
