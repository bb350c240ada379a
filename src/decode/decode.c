#include "decode/decode.h"

/* ---- By OpenImageIO ---- */

static const char *const suffixes[SHD_FORMAT_COUNT] = {
    [SHD_TIFF] = "tif", [SHD_EXR] = "exr", [SHD_HDR] = "hdr"};

typedef struct asking {
    const shd_decoder *decoder;
    shd_decoded *picture;
    const unsigned char *data;
    size_t size;
    shd_format format;
    shd_status status;
    shd_error *error;
} asking;

static void take_head(const shd_oiio_decoding *from, shd_decoded *to) {
    *to = (shd_decoded){.width = from->width,
                        .height = from->height,
                        .count = from->count,
                        .alpha = from->alpha,
                        .associated = from->associated,
                        .depth = (int32_t)from->depth};
}

static bool admit_oiio(void *context, const shd_oiio_decoding *decoding) {
    asking *a = context;
    take_head(decoding, a->picture);
    a->status = shd_decode_admit(a->decoder, a->picture, a->error);
    if (a->status == SHD_OK && a->format == SHD_EXR)
        a->status = shd_decode_check_exr(a->data, a->size, a->error);
    if (a->status == SHD_OK && a->format == SHD_TIFF)
        a->status = shd_decode_check_tiff(a->data, a->size, a->error);
    return a->status == SHD_OK;
}

static shd_status decode_by_oiio(const shd_decoder *decoder, shd_format format,
                                 const unsigned char *data, size_t size, shd_decoded *picture,
                                 void **samples, shd_error *error) {
    asking a = {.decoder = decoder,
                .picture = picture,
                .data = data,
                .size = size,
                .format = format,
                .status = SHD_OK,
                .error = error};
    shd_oiio_decoding decoding = {.abi = sizeof decoding,
                                  .data = data,
                                  .size = size,
                                  .suffix = suffixes[format],
                                  .admit = admit_oiio,
                                  .context = &a};
    char text[256] = "";
    const int failed = decoder->oiio(&decoding, text, sizeof text);
    if (a.status != SHD_OK) return a.status;
    if (failed == 1) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    if (failed) return shd_fail(error, SHD_SCENE, "", "%s", text);
    *samples = decoding.samples;
    return SHD_OK;
}

/* ---- All formats ---- */

shd_status shd_decode(const shd_decoder *decoder, const unsigned char *data, size_t size,
                      shd_decoded *picture, void **samples, shd_error *error) {
    static shd_decode_fn *const own[SHD_FORMAT_COUNT] = {
        [SHD_PNG] = shd_decode_png, [SHD_JPEG] = shd_decode_jpeg, [SHD_WEBP] = shd_decode_webp};
    const shd_format format = shd_format_sniff(data, size);
    *picture = (shd_decoded){0};
    *samples = NULL;
    if (format == SHD_FORMAT_COUNT)
        return shd_fail(error, SHD_SCENE, "",
                        "it begins as no PNG, JPEG, WebP, TIFF, OpenEXR or Radiance HDR does");
    const shd_status status = shd_decode_walk(format, data, size, error);
    if (status != SHD_OK) return status;
    if (own[format]) return own[format](decoder, data, size, picture, samples, error);
    if (decoder->oiio) return decode_by_oiio(decoder, format, data, size, picture, samples, error);
    return shd_fail(error, SHD_SCENE, "", "OpenImageIO is not installed, which reads %s",
                    suffixes[format]);
}
