#include "image/encoders.h"
#include "image/spread.h"

static const struct {
    shd_encoder *encode;
    shd_encoder_scratch *scratch;
} encoders[SHD_FORMAT_COUNT] = {[SHD_PNG] = {shd_encode_png, shd_png_scratch},
                                [SHD_JPEG] = {shd_encode_jpeg, shd_jpeg_scratch},
                                [SHD_WEBP] = {shd_encode_webp, shd_webp_scratch},
                                [SHD_TIFF] = {shd_encode_oiio, shd_oiio_scratch},
                                [SHD_EXR] = {shd_encode_oiio, shd_oiio_scratch},
                                [SHD_HDR] = {shd_encode_oiio, shd_oiio_scratch}};

uint64_t shd_image_scratch(const shd_image *image, shd_format format, bool samples) {
    return encoders[format].scratch(image, format, samples);
}

shd_status shd_image_encode(const shd_image *image, shd_format format, shd_arena *scratch,
                            shd_bytes *out, shd_error *error) {
    const shd_format_info *info = shd_format_get(format);
    if (image->width < 1 || image->height < 1 || image->width > info->side ||
        image->height > info->side)
        return shd_fail(error, SHD_INTERNAL, "",
                        "a %s picture has 1 to %d pixels a side, not %d x %d", info->name,
                        info->side, image->width, image->height);
    if (!(info->depths & (unsigned)image->depth))
        return shd_fail(error, SHD_INTERNAL, "", "%s has no samples of depth %s", info->name,
                        shd_depth_name(image->depth));
    if (image->alpha && !info->alpha)
        return shd_fail(error, SHD_INTERNAL, "", "%s has no alpha", info->name);
    if (image->samples && image->depth != SHD_U8 && image->depth != SHD_U16)
        return shd_fail(error, SHD_INTERNAL, "", "ready samples are integers");
    if (image->layer_count && format != SHD_EXR)
        return shd_fail(error, SHD_INTERNAL, "", "%s has no layers", info->name);
    /* No sample, filter byte or compressor's bound takes more than 32 bytes a pixel; sides are
     * below 2^25, so this cannot overflow itself. */
    uint64_t pixels = (uint64_t)image->width * (uint64_t)image->height;
    if (pixels > SIZE_MAX / 32 / 2) return shd_encode_no_memory(error);
    return encoders[format].encode(image, format, scratch, out, error);
}
