/* Files of pictures become one file of an animation: animated WebP (RFC 9649), or APNG (ISO/IEC
 * 15948, third edition). Frames are whole pictures and stay as they were encoded, pixel for pixel.
 */
#pragma once

#include "image/image.h"

typedef struct shd_animation {
    const shd_bytes *frames; /* [count], of shd_image_encode, of one size and kind of pixels */
    size_t count;            /* > 0 */
    int width, height;
    unsigned milliseconds; /* that each frame is shown, below 65536; it begins again for ever */
} shd_animation;

/* `format` is SHD_PNG or SHD_WEBP. What *out takes counts as borrowed of `scratch`. SHD_MEMORY,
 * SHD_INTERNAL. Color and texts are those of the first frame. Any thread. */
shd_status shd_image_animate(const shd_animation *animation, shd_format format, shd_arena *scratch,
                             shd_bytes *out, shd_error *error);
