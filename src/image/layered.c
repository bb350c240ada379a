/* TIFF, EXR and HDR: turns a picture and its layers into planes for the OpenImageIO module. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "image/encoders.h"
#include "image/icc.h"
#include "image/load.h"
#include "image/pack.h"
#include "image/spread.h"

static const float HALF_MAX = 65504;

static size_t stored_bytes(const shd_oiio_plane *plane) {
    static const size_t bytes[] = {
        [SHD_OIIO_U8] = 1, [SHD_OIIO_U16] = 2, [SHD_OIIO_HALF] = 2, [SHD_OIIO_FLOAT] = 4};
    return bytes[plane->sample] * (size_t)plane->count;
}

static shd_oiio_sample picture_sample(shd_depth depth) {
    switch (depth) {
    case SHD_U8:
        return SHD_OIIO_U8;
    case SHD_U16:
        return SHD_OIIO_U16;
    case SHD_HALF:
        return SHD_OIIO_HALF;
    case SHD_FLOAT:
        break;
    }
    return SHD_OIIO_FLOAT;
}

/* Makes the picture itself. HDR has no signs, so that negative values become 0 there. */
static shd_status picture_plane(const shd_image *image, shd_format format, shd_arena *scratch,
                                shd_oiio_plane *out, int *alpha, shd_error *error) {
    static const char *const color[] = {"R", "G", "B", "A"}, *const grey[] = {"Y", "A"};
    shd_pack pack = shd_pack_of(image, format);
    const void *values;
    if (format == SHD_HDR) pack.least = 0;
    const shd_status status = shd_pack_samples(&pack, image, scratch, &values, error);
    if (status) return status;
    *out = (shd_oiio_plane){pack.count < 3 ? grey : color, pack.count, picture_sample(image->depth),
                            values};
    *alpha = pack.alpha ? pack.count - 1 : -1;
    return SHD_OK;
}

/* Half cannot hold all of float, and conversion would make infinities: a layer that goes beyond
 * is copied and saturated, the others are used as they are. NULL: no memory. */
static const float *fit_half(const float *values, size_t count, shd_arena *scratch) {
    size_t beyond = 0;
    for (size_t i = 0; i < count; i++) beyond += fabsf(values[i]) > HALF_MAX;
    if (!beyond) return values;
    float *copy = shd_arena_alloc(scratch, count, sizeof *copy);
    if (!copy) return NULL;
    for (size_t i = 0; i < count; i++) {
        float v = values[i];
        copy[i] = v > HALF_MAX ? HALF_MAX : v < -HALF_MAX ? -HALF_MAX : v;
    }
    return copy;
}

static shd_status layer_plane(const shd_image *image, const shd_image_layer *layer,
                              shd_arena *scratch, shd_oiio_plane *out, shd_error *error) {
    if (!shd_encode_goes_on(image)) return shd_encode_cancelled(error);
    size_t pixels = (size_t)image->width * (size_t)image->height;
    if (layer->count < 1 || pixels > SIZE_MAX / sizeof(float) / (size_t)layer->count)
        return shd_encode_no_memory(error);
    const char **names = shd_arena_alloc(scratch, (size_t)layer->count, sizeof *names);
    if (!names) return shd_encode_no_memory(error);
    for (int c = 0; c < layer->count; c++) {
        names[c] = shd_arena_printf(scratch, "%s.%s", layer->name, layer->channels[c]);
        if (!names[c]) return shd_encode_no_memory(error);
    }
    bool full = layer->full_float || image->depth == SHD_FLOAT;
    const float *values = layer->values;
    if (!full) values = fit_half(values, pixels * (size_t)layer->count, scratch);
    if (!values) return shd_encode_no_memory(error);
    *out = (shd_oiio_plane){names, layer->count, full ? SHD_OIIO_FLOAT : SHD_OIIO_HALF, values};
    return SHD_OK;
}

/* The name of what a viewer shows as R, G, B or as grey though it is not that: "YIQ", "H", "A".
 * NULL: it is that, or memory is short. */
static const char *shown_channels(const shd_image *image, shd_arena *scratch) {
    const char *const *names = image->channel_names;
    if (image->channel == 3) return "A";
    if (!names) return NULL;
    if (image->channel >= 0) return names[image->channel];
    if (!strcmp(names[0], "R") && !strcmp(names[1], "G") && !strcmp(names[2], "B")) return NULL;
    return shd_arena_printf(scratch, "%s%s%s", names[0], names[1], names[2]);
}

/* What OpenImageIO takes for a file of as many bytes of pixels, which compression may make longer
 * by a little, and for itself. */
static uint64_t file_bytes(uint64_t stored) {
    return stored / 8 * 9 + (1 << 20);
}

uint64_t shd_oiio_scratch(const shd_image *image, shd_format format, bool samples) {
    const shd_pack pack = shd_pack_of(image, format);
    const uint64_t pixels = (uint64_t)image->width * (uint64_t)image->height;
    const uint64_t packed = (uint64_t)pack.count * shd_pack_bytes(&pack);
    const shd_oiio_plane picture = {.count = pack.count, .sample = picture_sample(image->depth)};
    uint64_t stored = stored_bytes(&picture);
    for (size_t i = 0; i < image->layer_count; i++) {
        const shd_image_layer *l = &image->layers[i];
        const bool full = l->full_float || image->depth == SHD_FLOAT;
        stored += (uint64_t)l->count * (full ? 4 : 2);
    }
    const bool woven = image->layer_count || picture.sample == SHD_OIIO_HALF;
    return pixels * ((samples ? 0 : packed) + (woven ? stored : 0)) + file_bytes(pixels * stored);
}

/* Calls the module, and counts the file that it makes. */
static shd_status encode_job(shd_oiio_encode_fn *encode, const shd_oiio_job *job, size_t file,
                             shd_arena *scratch, shd_bytes *out, shd_error *error) {
    if (!shd_arena_borrow(scratch, file)) return shd_encode_no_memory(error);
    unsigned char *data;
    size_t size;
    char text[400];
    int failed = encode(job, &data, &size, text, sizeof text);
    shd_arena_repay(scratch, file);
    if (failed == 2) return shd_encode_cancelled(error);
    if (failed > 0) return shd_encode_no_memory(error);
    if (failed) return shd_fail(error, SHD_INTERNAL, "", "%s", text);
    if (!shd_arena_borrow(scratch, size)) {
        free(data);
        return shd_encode_no_memory(error);
    }
    *out = (shd_bytes){data, size};
    return SHD_OK;
}

shd_status shd_encode_oiio(const shd_image *image, shd_format format, shd_arena *scratch,
                           shd_bytes *out, shd_error *error) {
    shd_oiio_encode_fn *encode;
    shd_status status = shd_oiio_load(&encode, error);
    if (status) return status;

    shd_oiio_job job = {.abi = sizeof job,
                        .suffix = shd_format_get(format)->name,
                        .width = image->width,
                        .height = image->height,
                        .plane_count = 1 + image->layer_count,
                        .go_on = image->go_on,
                        .context = image->context};
    shd_oiio_plane *planes = shd_arena_alloc(scratch, job.plane_count, sizeof *planes);
    if (!planes) return shd_encode_no_memory(error);
    status = picture_plane(image, format, scratch, planes, &job.alpha, error);
    for (size_t i = 0; !status && i < image->layer_count; i++)
        status = layer_plane(image, &image->layers[i], scratch, &planes[1 + i], error);
    if (status) return status;
    job.planes = planes;

    /* Room for the pixels as stored; a single plane that needs no narrowing is used in place. */
    size_t pixel = 0;
    for (size_t i = 0; i < job.plane_count; i++) pixel += stored_bytes(&planes[i]);
    if (job.plane_count > 1 || planes[0].sample == SHD_OIIO_HALF) {
        size_t pixels = (size_t)image->width * (size_t)image->height;
        job.pixels = shd_arena_alloc(scratch, pixels, pixel);
        if (!job.pixels) return shd_encode_no_memory(error);
        job.pixels_size = pixels * pixel;
    }

    /* Color metadata: a profile in TIFF; chromaticities in EXR, whose samples are linear by
     * definition, so encoded ones get none. */
    shd_icc icc = {.size = 0};
    float primaries[8];
    if (format == SHD_TIFF) icc = shd_icc_make(image);
    job.icc = icc.data;
    job.icc_size = icc.size;
    if (format == SHD_EXR && image->has_primaries && image->channel < 0 &&
        image->transfer == SHD_TRANSFER_LINEAR) {
        for (int i = 0; i < 8; i++) primaries[i] = (float)image->primaries[i];
        job.primaries = primaries;
    }
    if (format == SHD_EXR) job.shown = shown_channels(image, scratch);

    const size_t file = file_bytes((uint64_t)image->width * (uint64_t)image->height * pixel);
    return encode_job(encode, &job, file, scratch, out, error);
}
