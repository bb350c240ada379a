/* One encoder a format, called by shd_image_encode after its checks: the picture's size, depth,
 * alpha and layers are what the format holds, and width * height * 32 fits into size_t. Beside it
 * is what it takes of scratch memory, as shd_image_scratch says. */
#pragma once

#include "image/image.h"

typedef shd_status shd_encoder(const shd_image *image, shd_format format, shd_arena *scratch,
                               shd_bytes *out, shd_error *error);
typedef uint64_t shd_encoder_scratch(const shd_image *image, shd_format format, bool samples);

shd_encoder shd_encode_png, shd_encode_jpeg, shd_encode_webp;
shd_encoder shd_encode_oiio; /* TIFF, EXR and HDR, through the module */
shd_encoder_scratch shd_png_scratch, shd_jpeg_scratch, shd_webp_scratch, shd_oiio_scratch;
