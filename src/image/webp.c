/* WebP with libwebp itself: OpenImageIO 2.4 takes color as premultiplied by linear-light alpha
 * whatever "oiio:UnassociatedAlpha" says, so that straight alpha comes back wrong (200 becomes 251
 * under alpha 51), writes no profile, and always compresses at the slowest effort. */
#include <stdlib.h>
#include <string.h>
#include <webp/encode.h>
#include <webp/mux.h>

#include "image/encoders.h"
#include "image/icc.h"
#include "image/pack.h"
#include "image/spread.h"

static shd_status encoder_error(int code, shd_error *error) {
    switch (code) {
    case VP8_ENC_ERROR_OUT_OF_MEMORY:
    case VP8_ENC_ERROR_BITSTREAM_OUT_OF_MEMORY:
        return shd_encode_no_memory(error);
    case VP8_ENC_ERROR_USER_ABORT:
        return shd_encode_cancelled(error);
    default:
        return shd_fail(error, SHD_INTERNAL, "", "libwebp failed with error %d", code);
    }
}

static int ask_to_go_on(int percent, const WebPPicture *picture) {
    (void)percent;
    const shd_image *image = picture->user_data;
    return image->go_on(image->context);
}

/* What libwebp takes beside: the picture as it sees it, and what it compares. The most that version
 * 1.2.4 was seen to take, of noise at any effort, is 21 bytes a pixel of opaque lossy pictures, and
 * 55 where a plane or all of it is lossless; smooth pictures take 2 and 26. */
static size_t working_bytes(const shd_image *image, bool lossless) {
    const size_t pixels = (size_t)image->width * (size_t)image->height;
    return pixels * (lossless || image->alpha ? 56 : 24) + (1 << 20);
}

uint64_t shd_webp_scratch(const shd_image *image, bool samples) {
    const shd_pack pack = shd_pack_of(image, SHD_WEBP);
    const uint64_t pixels = (uint64_t)image->width * (uint64_t)image->height;
    return (samples ? 0 : pixels * (uint64_t)pack.count) +
           working_bytes(image, image->quality >= 100);
}

/* Wraps the stream into an extended file with the profile. */
static shd_status add_profile(const WebPMemoryWriter *stream, const shd_icc *icc, shd_bytes *out,
                              shd_error *error) {
    WebPMux *mux = WebPMuxNew();
    if (!mux) return shd_encode_no_memory(error);
    WebPData image = {stream->mem, stream->size}, profile = {icc->data, icc->size}, file;
    WebPDataInit(&file);
    WebPMuxError failed = WebPMuxSetImage(mux, &image, 0);
    if (failed == WEBP_MUX_OK) failed = WebPMuxSetChunk(mux, "ICCP", &profile, 0);
    if (failed == WEBP_MUX_OK) failed = WebPMuxAssemble(mux, &file);
    WebPMuxDelete(mux);
    if (failed == WEBP_MUX_MEMORY_ERROR) return shd_encode_no_memory(error);
    if (failed != WEBP_MUX_OK)
        return shd_fail(error, SHD_INTERNAL, "", "libwebp's muxer failed with error %d", failed);
    *out = (shd_bytes){(unsigned char *)file.bytes, file.size};
    return SHD_OK;
}

/* What to encode, and how; without pixels. False: libwebp is another version. */
static bool set_up(const shd_image *image, WebPConfig *config, WebPPicture *picture) {
    if (!WebPConfigPreset(config, WEBP_PRESET_DEFAULT, (float)image->quality) ||
        !WebPPictureInit(picture))
        return false;
    config->method = image->effort;
    if (image->quality >= 100) {
        WebPConfigLosslessPreset(config, image->effort);
        config->exact = 1; /* color under alpha 0 stays too */
        picture->use_argb = 1;
    }
    if (image->go_on) {
        picture->progress_hook = ask_to_go_on;
        picture->user_data = (void *)(size_t)image;
    }
    picture->width = image->width;
    picture->height = image->height;
    return true;
}

/* Encodes into `stream`, which the caller clears. */
static shd_status encode_stream(const shd_image *image, shd_arena *scratch,
                                WebPMemoryWriter *stream, shd_error *error) {
    shd_pack pack = shd_pack_of(image, SHD_WEBP);
    const void *pixels;
    const shd_status packed = shd_pack_samples(&pack, image, scratch, &pixels, error);
    if (packed) return packed;
    WebPConfig config;
    WebPPicture picture;
    if (!set_up(image, &config, &picture))
        return shd_fail(error, SHD_INTERNAL, "", "libwebp is not the version built against");
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = stream;
    int stride = image->width * pack.count;
    const size_t working = working_bytes(image, picture.use_argb);
    if (!shd_arena_borrow(scratch, working)) return shd_encode_no_memory(error);
    int imported = pack.count == 4 ? WebPPictureImportRGBA(&picture, pixels, stride)
                                   : WebPPictureImportRGB(&picture, pixels, stride);
    int encoded = imported && WebPEncode(&config, &picture);
    int code = picture.error_code;
    WebPPictureFree(&picture);
    shd_arena_repay(scratch, working);
    if (!imported) return shd_encode_no_memory(error);
    return encoded ? SHD_OK : encoder_error(code, error);
}

shd_status shd_encode_webp(const shd_image *image, shd_arena *scratch, shd_bytes *out,
                           shd_error *error) {
    WebPMemoryWriter stream;
    WebPMemoryWriterInit(&stream);
    shd_status status = encode_stream(image, scratch, &stream, error);
    shd_icc icc = {.size = 0};
    if (!shd_image_is_srgb(image)) icc = shd_icc_make(image);
    shd_bytes file = {NULL, 0};
    if (!status && icc.size) status = add_profile(&stream, &icc, &file, error);
    if (!status && !icc.size) {
        /* Allocated by libwebp with malloc: the caller's free ends it. */
        file = (shd_bytes){stream.mem, stream.size};
        stream.mem = NULL;
    }
    WebPMemoryWriterClear(&stream);
    if (status) return status;
    if (!shd_arena_borrow(scratch, file.size)) {
        free(file.data);
        return shd_encode_no_memory(error);
    }
    *out = file;
    return SHD_OK;
}
