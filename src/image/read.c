#include "image/read.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
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

/* malloc. NULL: it cannot be read. */
static unsigned char *read_all(const char *path, size_t *size) {
    FILE *file = fopen(path, "rb");
    unsigned char *data = NULL;
    *size = 0;
    for (size_t room = 1 << 16, got = 1; file && got; room *= 2) {
        unsigned char *more = realloc(data, room);
        if (!more) break;
        data = more;
        got = fread(data + *size, 1, room - *size, file);
        *size += got;
    }
    const bool whole = file && feof(file) && !ferror(file);
    if (file) fclose(file);
    if (whole) return data;
    free(data);
    return NULL;
}

/* What a JPEG or a WebP is. False: it is neither. */
static bool describe(shd_format format, const unsigned char *data, size_t size, shd_samples *out) {
    WebPBitstreamFeatures features;
    int sampling, space;
    if (format == SHD_WEBP) {
        if (WebPGetFeatures(data, size, &features) != VP8_STATUS_OK) return false;
        out->width = features.width;
        out->height = features.height;
        out->alpha = features.has_alpha;
        out->count = out->alpha ? 4 : 3;
        return true;
    }
    tjhandle reader = tjInitDecompress();
    const bool known = reader && !tjDecompressHeader3(reader, data, size, &out->width, &out->height,
                                                      &sampling, &space);
    if (reader) tjDestroy(reader);
    out->count = known && space == TJCS_GRAY ? 1 : 3;
    return known;
}

/* What may be read: one size, or with the width 0 any of so many pixels. */
typedef struct wanted {
    int width, height;
    size_t most;
} wanted;

static bool is_wanted(const wanted *w, int width, int height) {
    if (width < 1 || height < 1) return false;
    if (w->width) return width == w->width && height == w->height;
    return (size_t)width <= w->most / (size_t)height;
}

static shd_status wrong_size(const wanted *w, int width, int height, shd_error *error) {
    if (w->width)
        return shd_fail(error, SHD_SCENE, "", "the picture has %d x %d pixels, not %d x %d", width,
                        height, w->width, w->height);
    shd_fail(error, SHD_LIMIT, "", "the picture has %d x %d pixels; the limit `pixels` is %zu",
             width, height, w->most);
    return shd_fail_limit(error, SHD_LIMIT_PIXELS);
}

static shd_status read_lossy(const char *path, shd_format format, const wanted *w, shd_samples *out,
                             shd_error *error) {
    size_t size;
    unsigned char *data = read_all(path, &size);
    const bool known = data && describe(format, data, size, out);
    const bool fits = known && is_wanted(w, out->width, out->height);
    const size_t samples = (size_t)out->width * (size_t)out->height * (size_t)out->count;
    unsigned char *codes = fits ? malloc(samples) : NULL;
    out->depth = SHD_U8;
    out->values = codes ? malloc(samples * sizeof *out->values) : NULL;
    const bool read = out->values && shd_image_decode(format, data, size, out->width, out->height,
                                                      out->count, codes);
    for (size_t i = 0; read && i < samples; i++) out->values[i] = codes[i];
    free(codes);
    free(data);
    if (read) return SHD_OK;
    free(out->values);
    out->values = NULL;
    if (known && !fits) return wrong_size(w, out->width, out->height, error);
    return shd_fail(error, SHD_SCENE, "", "the picture cannot be read as %s",
                    shd_format_get(format)->name);
}

static shd_status read_wanted(const char *path, shd_format format, const wanted *w,
                              shd_samples *out, shd_error *error) {
    if (format == SHD_WEBP || format == SHD_JPEG) return read_lossy(path, format, w, out, error);
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

shd_status shd_image_read(const char *path, shd_format format, int width, int height,
                          shd_samples *out, shd_error *error) {
    const wanted w = {.width = width, .height = height};
    *out = (shd_samples){.width = width, .height = height};
    return read_wanted(path, format, &w, out, error);
}

shd_status shd_image_read_any(const char *path, shd_format format, size_t most, shd_samples *out,
                              shd_error *error) {
    const wanted w = {.most = most};
    *out = (shd_samples){0};
    return read_wanted(path, format, &w, out, error);
}
