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

static shd_status read_webp(const char *path, int width, int height, shd_samples *out,
                            shd_error *error) {
    size_t size;
    unsigned char *data = read_all(path, &size);
    WebPBitstreamFeatures features;
    const bool known = data && WebPGetFeatures(data, size, &features) == VP8_STATUS_OK;
    const size_t pixels = (size_t)width * (size_t)height;
    unsigned char *codes = known ? malloc(pixels * 4) : NULL;
    out->alpha = known && features.has_alpha;
    out->count = out->alpha ? 4 : 3;
    out->depth = SHD_U8;
    const size_t samples = pixels * (size_t)out->count;
    out->values = codes ? malloc(samples * sizeof *out->values) : NULL;
    const bool read = out->values && decode_webp(data, size, width, height, out->count, codes);
    for (size_t i = 0; read && i < samples; i++) out->values[i] = codes[i];
    free(codes);
    free(data);
    if (read) return SHD_OK;
    free(out->values);
    out->values = NULL;
    if (known && (features.width != width || features.height != height))
        return shd_fail(error, SHD_SCENE, "", "the picture has %d x %d pixels, not %d x %d",
                        features.width, features.height, width, height);
    return shd_fail(error, SHD_SCENE, "", "the picture cannot be read as WebP");
}

shd_status shd_image_read(const char *path, shd_format format, int width, int height,
                          shd_samples *out, shd_error *error) {
    *out = (shd_samples){.width = width, .height = height};
    if (format == SHD_WEBP) return read_webp(path, width, height, out, error);
    shd_oiio_file file = {.path = path, .width = width, .height = height};
    const shd_status status = shd_oiio_read_file(&file, error);
    if (status != SHD_OK) return status;
    if (!file.values)
        return shd_fail(error, SHD_SCENE, "", "the picture has %d x %d pixels, not %d x %d",
                        file.found_width, file.found_height, width, height);
    out->count = file.count;
    out->alpha = file.alpha;
    out->depth = file.depth;
    out->values = file.values;
    const size_t samples = (size_t)width * (size_t)height * (size_t)file.count;
    const float most = file.depth == SHD_U8 ? 255 : 65535;
    for (size_t i = 0; i < samples && (file.depth == SHD_U8 || file.depth == SHD_U16); i++)
        file.values[i] = roundf(file.values[i] * most);
    return SHD_OK;
}
