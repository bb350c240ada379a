#include "image/read.h"

#include <math.h>
#include <turbojpeg.h>
#include <webp/decode.h>

#include "image/load.h"

static bool decode_webp(const unsigned char *data, size_t size, int width, int height, int count,
                        unsigned char *out) {
    int w, h;
    const size_t room = (size_t)width * (size_t)height * (size_t)count;
    if (!WebPGetInfo(data, size, &w, &h) || w != width || h != height) return false;
    if (count == 4) return WebPDecodeRGBAInto(data, size, out, room, 4 * width) != NULL;
    return count == 3 && WebPDecodeRGBInto(data, size, out, room, 3 * width) != NULL;
}

static bool decode_jpeg(const unsigned char *data, size_t size, int width, int height, int count,
                        unsigned char *out) {
    int w, h, sampling, space;
    tjhandle reader = tjInitDecompress();
    const bool read = reader && (count == 1 || count == 3) &&
                      !tjDecompressHeader3(reader, data, size, &w, &h, &sampling, &space) &&
                      w == width && h == height &&
                      !tjDecompress2(reader, data, size, out, width, 0, height,
                                     count == 1 ? TJPF_GRAY : TJPF_RGB, TJFLAG_ACCURATEDCT);
    if (reader) tjDestroy(reader);
    return read;
}

bool shd_image_decode(shd_format format, const unsigned char *data, size_t size, int width,
                      int height, int count, unsigned char *out) {
    return (format == SHD_WEBP ? decode_webp : decode_jpeg)(data, size, width, height, count, out);
}

/* What may be read: one size, or with the width 0 any of so many pixels. */
typedef struct wanted {
    int width, height;
    size_t most;
} wanted;

static shd_status wrong_size(const wanted *w, int width, int height, shd_error *error) {
    if (w->width)
        return shd_fail(error, SHD_SCENE, "", "the picture has %d x %d pixels, not %d x %d", width,
                        height, w->width, w->height);
    shd_fail(error, SHD_LIMIT, "", "the picture has %d x %d pixels; the limit `pixels` is %zu",
             width, height, w->most);
    return shd_fail_limit(error, SHD_LIMIT_PIXELS);
}

static shd_status read_wanted(const char *path, const wanted *w, shd_samples *out,
                              shd_error *error) {
    shd_oiio_file file = {.path = path, .width = w->width, .height = w->height, .most = w->most};
    const shd_status status = shd_oiio_read_file(&file, error);
    if (status != SHD_OK) return status;
    if (!file.values) return wrong_size(w, file.found_width, file.found_height, error);
    out->width = file.found_width;
    out->height = file.found_height;
    out->count = file.count;
    out->alpha = file.alpha;
    out->associated = file.associated;
    out->depth = file.depth;
    out->values = file.values;
    const size_t samples = (size_t)out->width * (size_t)out->height * (size_t)file.count;
    const float most = file.depth == SHD_U8 ? 255 : 65535;
    for (size_t i = 0; i < samples && (file.depth == SHD_U8 || file.depth == SHD_U16); i++)
        file.values[i] = roundf(file.values[i] * most);
    return SHD_OK;
}

shd_status shd_image_read(const char *path, int width, int height, shd_samples *out,
                          shd_error *error) {
    const wanted w = {.width = width, .height = height};
    *out = (shd_samples){.width = width, .height = height};
    return read_wanted(path, &w, out, error);
}

shd_status shd_image_read_any(const char *path, size_t most, shd_samples *out, shd_error *error) {
    const wanted w = {.most = most};
    *out = (shd_samples){0};
    return read_wanted(path, &w, out, error);
}
