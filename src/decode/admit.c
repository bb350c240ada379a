#include <stdlib.h>

#include "decode/decode.h"

shd_status shd_decode_admit(const shd_decoder *decoder, const shd_decoded *picture,
                            shd_error *error) {
    if (picture->width < 1 || picture->height < 1)
        return shd_fail(error, SHD_SCENE, "", "the picture has no pixels");
    if ((size_t)picture->width > decoder->most / (size_t)picture->height)
        return shd_fail(error, SHD_LIMIT, "",
                        "the picture has %d x %d pixels; the limit `pixels` is %zu", picture->width,
                        picture->height, decoder->most);
    if (decoder->admit && !decoder->admit(decoder->context, picture))
        return shd_fail(error, SHD_CANCELLED, "", "it was left");
    return SHD_OK;
}

void *shd_decode_room(const shd_decoded *picture, size_t *bytes) {
    const size_t pixel = (size_t)picture->count * shd_decoded_sample(picture->depth);
    if (__builtin_mul_overflow((size_t)picture->width * pixel, (size_t)picture->height, bytes))
        return NULL;
    return malloc(*bytes);
}

shd_status shd_decode_ends_early(const char *format, shd_error *error) {
    return shd_fail(error, SHD_SCENE, "", "%s: the file ends early", format);
}
