/* JPEG by libjpeg-turbo and WebP by libwebp. What either only warns of is a mistake here: a picture
 * that ends early is none. */
#include <stdlib.h>
#include <turbojpeg.h>
#include <webp/decode.h>

#include "decode/decode.h"

static shd_status fail_jpeg(tjhandle reader, shd_error *error) {
    return shd_fail(error, SHD_SCENE, "", "JPEG: %s", tjGetErrorStr2(reader));
}

static shd_status decode_jpeg_with(tjhandle reader, const shd_decoder *decoder,
                                   const unsigned char *data, size_t size, shd_decoded *picture,
                                   void **samples, shd_error *error) {
    int width = 0, height = 0, sampling, space = -1; /* of tables alone nothing is told */
    size_t bytes;
    if (tjDecompressHeader3(reader, data, size, &width, &height, &sampling, &space))
        return fail_jpeg(reader, error);
    if (width < 1) return shd_fail(error, SHD_SCENE, "", "JPEG: there is no picture in it");
    if (space == TJCS_CMYK || space == TJCS_YCCK)
        return shd_fail(error, SHD_SCENE, "", "JPEG: it is of inks (CMYK), not of light");
    const bool grey = space == TJCS_GRAY;
    *picture =
        (shd_decoded){.width = width, .height = height, .count = grey ? 1 : 3, .depth = SHD_U8};
    const shd_status status = shd_decode_admit(decoder, picture, error);
    if (status != SHD_OK) return status;
    if (!(*samples = shd_decode_room(picture, &bytes)))
        return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    if (!tjDecompress2(reader, data, size, *samples, width, 0, height, grey ? TJPF_GRAY : TJPF_RGB,
                       TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS | TJFLAG_STOPONWARNING))
        return SHD_OK;
    free(*samples);
    *samples = NULL;
    return fail_jpeg(reader, error);
}

shd_status shd_decode_jpeg(const shd_decoder *decoder, const unsigned char *data, size_t size,
                           shd_decoded *picture, void **samples, shd_error *error) {
    tjhandle reader = tjInitDecompress();
    if (!reader) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    const shd_status status =
        decode_jpeg_with(reader, decoder, data, size, picture, samples, error);
    tjDestroy(reader);
    return status;
}

shd_status shd_decode_webp(const shd_decoder *decoder, const unsigned char *data, size_t size,
                           shd_decoded *picture, void **samples, shd_error *error) {
    WebPBitstreamFeatures features;
    size_t bytes;
    if (WebPGetFeatures(data, size, &features) != VP8_STATUS_OK)
        return shd_fail(error, SHD_SCENE, "", "WebP: the head is damaged");
    if (features.has_animation)
        return shd_fail(error, SHD_SCENE, "", "WebP: it is an animation, not a picture");
    const bool alpha = features.has_alpha;
    *picture = (shd_decoded){.width = features.width,
                             .height = features.height,
                             .count = alpha ? 4 : 3,
                             .alpha = alpha,
                             .depth = SHD_U8};
    const shd_status status = shd_decode_admit(decoder, picture, error);
    if (status != SHD_OK) return status;
    if (!(*samples = shd_decode_room(picture, &bytes)))
        return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    const int row = picture->width * picture->count;
    if ((alpha ? WebPDecodeRGBAInto : WebPDecodeRGBInto)(data, size, *samples, bytes, row))
        return SHD_OK;
    free(*samples);
    *samples = NULL;
    return shd_fail(error, SHD_SCENE, "", "WebP: the picture is damaged, or not whole");
}
