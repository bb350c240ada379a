/* TIFF, EXR and HDR: turns a picture and its layers into planes for the OpenImageIO module. */
#include <assert.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/primaries.h"
#include "image/encoders.h"
#include "image/icc.h"
#include "image/load.h"
#include "image/pack.h"
#include "image/spread.h"

static const float HALF_MAX = 65504;

/* Bytes of a pixel's samples in the file. */
static size_t stored_bytes(shd_depth depth, int count) {
    return (size_t)count * (depth == SHD_U8 ? 1 : depth == SHD_FLOAT ? 4 : 2);
}

static shd_depth layer_depth(const shd_image *image, const shd_image_layer *layer) {
    return layer->full_float ? SHD_FLOAT : image->depth;
}

/* Makes the picture itself. HDR has no signs, so that negative values become 0 there. */
static shd_status picture_plane(const shd_image *image, shd_format format, shd_arena *scratch,
                                shd_oiio_plane *out, int *alpha, shd_error *error) {
    static const char *const color[] = {"R", "G", "B", "A"}, *const grey[] = {"Y", "A"};
    shd_pack pack = shd_pack_of(image, format);
    if (format == SHD_HDR) pack.least = 0;
    *out = (shd_oiio_plane){pack.count < 3 ? grey : color, pack.count, image->depth, NULL};
    *alpha = pack.alpha ? pack.count - 1 : -1;
    return shd_pack_samples(&pack, image, scratch, &out->values, error);
}

/* Half cannot hold all of float, and conversion would make infinities: a layer that goes beyond
 * is copied and saturated, the others are used as they are. NULL: no memory. */
static const float *fit_half(const float *values, size_t count, shd_arena *scratch) {
    size_t beyond = 0;
    for (size_t i = 0; i < count; i++) beyond += fabsf(values[i]) > HALF_MAX;
    if (!beyond) return values;
    float *copy = shd_arena_alloc(scratch, count, sizeof *copy);
    for (size_t i = 0; copy && i < count; i++)
        copy[i] = values[i] > HALF_MAX ? HALF_MAX : values[i] < -HALF_MAX ? -HALF_MAX : values[i];
    return copy;
}

static shd_status layer_plane(const shd_image *image, const shd_image_layer *layer,
                              shd_arena *scratch, shd_oiio_plane *out, shd_error *error) {
    assert(layer->count >= 1 && layer->count <= 4); /* so that no size overflows */
    if (!shd_encode_goes_on(image)) return shd_encode_cancelled(error);
    const size_t samples = (size_t)image->width * (size_t)image->height * (size_t)layer->count;
    const char **names = shd_arena_alloc(scratch, (size_t)layer->count, sizeof *names);
    if (!names) return shd_encode_no_memory(error);
    for (int c = 0; c < layer->count; c++) {
        names[c] = shd_arena_printf(scratch, "%s.%s", layer->name, layer->channels[c]);
        if (!names[c]) return shd_encode_no_memory(error);
    }
    const shd_depth depth = layer_depth(image, layer);
    const float *values =
        depth == SHD_HALF ? fit_half(layer->values, samples, scratch) : layer->values;
    *out = (shd_oiio_plane){names, layer->count, depth, values};
    return values ? SHD_OK : shd_encode_no_memory(error);
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

/* Whether the samples are scene-linear light of known primaries, as EXR and HDR have it. */
static bool is_light(const shd_image *image) {
    return image->has_primaries && image->channel < 0 && image->transfer == SHD_TRANSFER_LINEAR;
}

/* Chromaticities, which are of linear samples by definition, so that encoded ones get none, and
 * names: the configuration's, and the Color Interop Forum's. */
static void tell_exr(const shd_image *image, shd_arena *scratch, float primaries[8],
                     shd_oiio_job *job) {
    static const struct {
        const double *xy;
        const char *name;
    } known[] = {{shd_rec709, "lin_rec709_scene"},
                 {shd_display_p3, "lin_p3d65_scene"},
                 {shd_rec2020, "lin_rec2020_scene"},
                 {shd_acescg, "lin_ap1_scene"},
                 {shd_aces2065_1, "lin_ap0_scene"}};
    job->shown = shown_channels(image, scratch);
    job->space = image->space;
    if (!is_light(image)) return;
    for (int i = 0; i < 8; i++) primaries[i] = (float)image->primaries[i];
    job->primaries = primaries;
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++)
        if (!memcmp(image->primaries, known[i].xy, sizeof image->primaries))
            job->interop = known[i].name;
}

/* Radiance's header is lines up to an empty one. OpenImageIO writes no primaries. */
static shd_status add_primaries(const shd_image *image, shd_arena *scratch, shd_bytes *file,
                                shd_error *error) {
    if (!is_light(image)) return SHD_OK;
    char line[160];
    const double *xy = image->primaries;
    const size_t length =
        (size_t)snprintf(line, sizeof line, "PRIMARIES= %.5g %.5g %.5g %.5g %.5g %.5g %.5g %.5g\n",
                         xy[0], xy[1], xy[2], xy[3], xy[4], xy[5], xy[6], xy[7]);
    const unsigned char *end = memmem(file->data, file->size, "\n\n", 2);
    unsigned char *data = NULL;
    if (end && shd_arena_borrow(scratch, length)) data = realloc(file->data, file->size + length);
    if (!data) {
        free(file->data);
        return shd_encode_no_memory(error);
    }
    const size_t at = (size_t)(end + 1 - file->data);
    memmove(data + at + length, data + at, file->size - at);
    memcpy(data + at, line, length);
    *file = (shd_bytes){data, file->size + length};
    return SHD_OK;
}

/* What OpenImageIO takes for a file of as many bytes of pixels, which compression may make longer
 * by a little, and for itself. */
static uint64_t file_bytes(uint64_t stored) {
    return stored / 8 * 9 + (1 << 20);
}

uint64_t shd_oiio_scratch(const shd_image *image, shd_format format, bool samples) {
    const shd_pack pack = shd_pack_of(image, format);
    const uint64_t pixels = (uint64_t)image->width * (uint64_t)image->height;
    const uint64_t packed = (uint64_t)pack.count * pack.bytes;
    uint64_t stored = stored_bytes(image->depth, pack.count);
    for (size_t i = 0; i < image->layer_count; i++)
        stored += stored_bytes(layer_depth(image, &image->layers[i]), image->layers[i].count);
    const bool woven = image->layer_count || image->depth == SHD_HALF;
    return pixels * ((samples ? 0 : packed) + (woven ? stored : 0)) + file_bytes(pixels * stored);
}

/* Calls the module, and counts the file that it makes. */
static shd_status encode_job(shd_oiio_encode_fn *encode, const shd_oiio_job *job, size_t file,
                             shd_arena *scratch, shd_bytes *out, shd_error *error) {
    if (!shd_arena_borrow(scratch, file)) return shd_encode_no_memory(error);
    shd_bytes made = {NULL, 0};
    char text[400];
    int failed = encode(job, &made.data, &made.size, text, sizeof text);
    shd_arena_repay(scratch, file);
    if (failed == 2) return shd_encode_cancelled(error);
    if (failed < 0) return shd_fail(error, SHD_INTERNAL, "", "%s", text);
    if (failed || !shd_arena_borrow(scratch, made.size)) {
        free(made.data);
        return shd_encode_no_memory(error);
    }
    *out = made;
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
                        .about = image->about,
                        .compression = format == SHD_EXR ? image->compression : NULL,
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
    const size_t pixels = (size_t)image->width * (size_t)image->height;
    size_t pixel = 0;
    for (size_t i = 0; i < job.plane_count; i++)
        pixel += stored_bytes(planes[i].depth, planes[i].count);
    if (job.plane_count > 1 || image->depth == SHD_HALF) {
        job.pixels = shd_arena_alloc(scratch, pixels, pixel);
        if (!job.pixels) return shd_encode_no_memory(error);
    }

    shd_icc icc = {.size = 0};
    float primaries[8];
    if (format == SHD_TIFF) icc = shd_icc_make(image);
    job.icc = icc.data;
    job.icc_size = icc.size;
    if (format == SHD_EXR) tell_exr(image, scratch, primaries, &job);
    status = encode_job(encode, &job, file_bytes((uint64_t)pixels * pixel), scratch, out, error);
    return status || format != SHD_HDR ? status : add_primaries(image, scratch, out, error);
}
