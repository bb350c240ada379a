#include "render/tell/sample_file.h"

#include <stdio.h>
#include <stdlib.h>

#include "assets/decoder.h"
#include "render/engine.h"

typedef struct reading {
    int width, height; /* that are wanted; 0: any */
    void *room;
} reading;

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

static void *make_room(void *context, const shd_decoded *picture, size_t bytes, shd_error *error) {
    reading *r = context;
    if (r->width && (picture->width != r->width || picture->height != r->height)) {
        shd_fail(error, SHD_SCENE, "", "the picture has %d x %d pixels, not %d x %d",
                 picture->width, picture->height, r->width, r->height);
        return NULL;
    }
    r->room = malloc(bytes);
    if (!r->room) shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    return r->room;
}

/* Codes of integers. */
static shd_status take(const shd_decoded *picture, const void *codes, shd_samples *out,
                       shd_error *error) {
    const size_t count = (size_t)picture->width * (size_t)picture->height * (size_t)picture->count;
    *out = (shd_samples){.width = picture->width,
                         .height = picture->height,
                         .count = picture->count,
                         .alpha = picture->alpha,
                         .depth = (shd_depth)picture->depth,
                         .values = malloc(count * sizeof *out->values)};
    if (!out->values) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    for (size_t i = 0; i < count; i++)
        out->values[i] = picture->depth == SHD_U8 ? (float)((const uint8_t *)codes)[i]
                                                  : (float)((const uint16_t *)codes)[i];
    return SHD_OK;
}

static shd_status decode(shd_request *request, const unsigned char *data, size_t size,
                         shd_format format, reading *r, shd_samples *out, shd_error *error) {
    const char *name = shd_format_get(format)->name;
    if (!data) return shd_fail(error, SHD_SCENE, "", "the file cannot be read");
    if (shd_format_sniff(data, size) != format)
        return shd_fail(error, SHD_SCENE, "", "the picture cannot be read as %s", name);
    const shd_decode_job job = {.data = data,
                                .size = size,
                                .most = request->limits.pixels,
                                .budget = request->rendering.engine->budget,
                                .cancelled = request->rendering.cancelled,
                                .room = make_room,
                                .context = r,
                                .loose = &request->loose_decoder};
    shd_decoded picture;
    const shd_status status = shd_decode_file(&job, &picture, error);
    return status == SHD_OK ? take(&picture, r->room, out, error) : status;
}

shd_status shd_sample_file_read(shd_request *request, const char *path, shd_format format,
                                int width, int height, shd_samples *out, shd_error *error) {
    *out = (shd_samples){.width = width, .height = height};
    if (shd_format_takes_oiio(format))
        return width ? shd_image_read(path, width, height, out, error)
                     : shd_image_read_any(path, request->limits.pixels, out, error);
    size_t size;
    reading r = {.width = width, .height = height};
    unsigned char *data = read_all(path, &size);
    const shd_status status = decode(request, data, size, format, &r, out, error);
    free(r.room);
    free(data);
    return status;
}
