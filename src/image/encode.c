#include <stdint.h>

#include "image/encoders.h"
#include "image/spread.h"

uint64_t shd_image_scratch(const shd_image *image, shd_format format, bool samples) {
    switch (format) {
    case SHD_PNG:
        return shd_png_scratch(image);
    case SHD_JPEG:
        return shd_jpeg_scratch(image, samples);
    case SHD_WEBP:
        return shd_webp_scratch(image);
    default:
        return shd_oiio_scratch(image, format, samples);
    }
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

    switch (format) {
    case SHD_PNG:
        return shd_encode_png(image, scratch, out, error);
    case SHD_JPEG:
        return shd_encode_jpeg(image, scratch, out, error);
    case SHD_WEBP:
        return shd_encode_webp(image, scratch, out, error);
    case SHD_TIFF:
    case SHD_EXR:
    case SHD_HDR:
        return shd_encode_oiio(image, format, scratch, out, error);
    case SHD_FORMAT_COUNT:
        break;
    }
    return shd_fail(error, SHD_INTERNAL, "", "no such format");
}
