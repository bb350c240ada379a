#include "render/tell/sample_file.h"

#include <stdio.h>
#include <stdlib.h>

#include "render/assets.h"

/* malloc. NULL: it cannot be read. */
static unsigned char *read_all(const char *path, size_t *size) {
    FILE *file = fopen(path, "rbe");
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

static shd_status decode(shd_request *request, const unsigned char *data, size_t size,
                         shd_format format, int width, int height, shd_samples *out,
                         shd_error *error) {
    if (!data) return shd_fail(error, SHD_SCENE, "", "the file cannot be read");
    if (shd_format_sniff(data, size) != format)
        return shd_fail(error, SHD_SCENE, "", "the picture cannot be read as %s",
                        shd_format_get(format)->name);
    shd_asset asset;
    float *values;
    shd_status status = shd_asset_decode(request, data, size, &asset, error);
    if (status != SHD_OK) return status;
    const shd_decoded *p = asset.picture;
    if (width && (p->width != width || p->height != height))
        status = shd_fail(error, SHD_SCENE, "", "the picture has %d x %d pixels, not %d x %d",
                          p->width, p->height, width, height);
    else if (!(values = malloc(shd_asset_count(&asset) * sizeof *values)))
        status = shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    else
        *out = shd_asset_samples(&asset, values, request->rendering.cancelled);
    shd_stored_drop(asset.thing);
    return status;
}

shd_status shd_sample_file_read(shd_request *request, const char *path, shd_format format,
                                int width, int height, shd_samples *out, shd_error *error) {
    *out = (shd_samples){.width = width, .height = height};
    if (shd_format_takes_oiio(format))
        return width ? shd_image_read(path, width, height, out, error)
                     : shd_image_read_any(path, request->limits.pixels, out, error);
    size_t size;
    unsigned char *data = read_all(path, &size);
    const shd_status status = decode(request, data, size, format, width, height, out, error);
    free(data);
    return status;
}
