/* Whether a picture is that of a scene: random pixels of it against the exact tier's, in intervals.
 *
 * The exact tier's pixel is within its bound of the model, and the picture's within that of its own
 * plan. So the picture's linear color is in a cube around the exact one, with both bounds on each
 * side. What an output makes of a cube is taken between the least and the most of its corners and
 * its middle, which is all of it if colors are a curve of a matrix. Then come what f32 makes of the
 * conversion, rounding to the sample, and what the codec loses. */
#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/json_memory.h"
#include "bound/shown/shown.h"
#include "render/planning.h"
#include "render/request.h"
#include "render/show/conversion.h"
#include "render/show/output.h"
#include "render/tell/json.h"
#include "render/tell/sample_file.h"

enum { CORNERS = 9, TOLD = 64 };

/* What f32 makes of a color's conversion: relative to 1 for integers, and to the value for floats.
 * OpenColorIO's curves were seen to be off by 1e-6. */
static const double CONVERSION = 4e-6;

typedef struct verifying {
    shd_rendering *r;
    const shd_verify_options *options;
    const shd_scene *scene; /* the exact tier's, with the one output */
    const shd_output *output;
    shd_film film;         /* the exact one */
    const shd_plan *own;   /* the picture's plan */
    shd_pixel_bound bound; /* and what it tells of a pixel */
    const shd_color_transform *transform;
    bool flat;
    shd_pack pack;
    shd_samples samples; /* of the picture */
    double tolerance;    /* codes */
    size_t checked, failed, unbounded;
    json_t *failures;
} verifying;

/* What a sample may be. */
typedef struct range {
    double least, most;
} range;

/* ---- The exact picture ---- */

/* The scene in the exact tier, with the output that the picture is of and a layer of bounds. */
static shd_status make_scene(verifying *v, const shd_scene *given, shd_format format,
                             shd_error *error) {
    static const shd_layer bounds = {.kind = SHD_LAYER_BOUND, .name = "bound"};
    shd_scene *scene = shd_arena_alloc(v->r->arena, 1, sizeof *scene);
    shd_output *output = shd_arena_alloc(v->r->arena, 1, sizeof *output);
    if (!scene || !output) return shd_rendering_full(v->r, "check", error);
    size_t which = 0;
    while (which < given->output_count && given->outputs[which].format != format) which++;
    if (which == given->output_count)
        return shd_fail(error, SHD_SCENE, given->multipart ? "/outputs" : "/output/format",
                        "the scene asks for no %s", shd_format_get(format)->name);
    *scene = *given;
    *output = given->outputs[which];
    if (output->scope)
        return shd_fail(error, SHD_SCENE, given->multipart ? "/outputs" : "/output/scope",
                        "a scope shows no pixels of the scene");
    output->layers = &bounds;
    output->layer_count = 1;
    scene->outputs = output;
    scene->output_count = 1;
    scene->accuracy = (shd_accuracy){.tier = SHD_EXACT};
    v->scene = scene;
    return SHD_OK;
}

static shd_status render_exactly(verifying *v, const shd_render_options *options,
                                 shd_error *error) {
    shd_rendering *r = v->r;
    shd_sight *sight;
    shd_stage_begin(r);
    shd_status status = shd_rendering_plan(r, v->scene, error);
    if (status == SHD_OK) status = shd_rendering_admit(r, NULL, true, error);
    shd_stage_end(r, &r->times.plan);
    if (status == SHD_OK) status = shd_sight_new(r->plan, r->cancelled, r->arena, &sight, error);
    if (status != SHD_OK) return status;
    v->film = (shd_film){0};
    return shd_film_render(r, sight, NULL, options, &v->film, error);
}

/* ---- What a pixel may be ---- */

/* How far the picture's linear components are from the exact tier's. */
static double find_reach(const verifying *v, size_t pixel) {
    const float *rgba = v->film.rgba + 4 * pixel;
    const double rgb[3] = {(double)rgba[0], (double)rgba[1], (double)rgba[2]},
                 exact = (double)v->film.bound[pixel];
    /* The exact tier's own picture, whose rays went the same ways. */
    if (v->own->extended && !(v->own->point_off > 0) && !shd_has_models32(v->own)) return 2 * exact;
    return exact + shd_pixel_bound_at(&v->bound, rgb);
}

static void convert_cube(const verifying *v, size_t pixel, double reach, float out[4 * CORNERS]) {
    const float *rgba = v->film.rgba + 4 * pixel;
    for (int k = 0; k < CORNERS; k++) {
        for (int c = 0; c < 3; c++) {
            const double side = k == CORNERS - 1 ? 0 : k >> c & 1 ? reach : -reach;
            out[4 * k + c] = (float)fmax(fmin((double)rgba[c] + side, FLT_MAX), -FLT_MAX);
        }
        out[4 * k + 3] = rgba[3];
    }
    if (v->flat) shd_output_flatten(v->output->matte, out, CORNERS);
    shd_color_apply(v->transform, out, CORNERS);
    for (int k = 0; v->output->dither && k < CORNERS; k++)
        shd_output_dither(&v->scene->raster, out + 4 * k, pixel, pixel + 1);
}

/* The range of a sample before it is stored: of integers in codes. */
static range range_of(const verifying *v, const float cube[4 * CORNERS], int sample) {
    const shd_pack *pack = &v->pack;
    const int c = pack->source[sample];
    const double alpha = pack->premultiply && c < 3 ? (double)cube[3] : 1;
    range out = {INFINITY, -INFINITY};
    for (int k = 0; k < CORNERS; k++) {
        double value = isnan(cube[4 * k + c]) ? 0 : (double)cube[4 * k + c];
        /* Integers clip before alpha multiplies them. */
        if (pack->max > 0) value = fmax(fmin(value, 1), 0) * pack->max;
        out.least = fmin(out.least, value * alpha);
        out.most = fmax(out.most, value * alpha);
    }
    return out;
}

static range widen_codes(const verifying *v, range in) {
    const double max = v->pack.max, by = 0.5 + CONVERSION * max + v->tolerance;
    const double least = ceil(in.least - by), most = floor(in.most + by);
    return (range){fmax(least, 0), fmin(most, max)};
}

/* `largest`: of the pixel's channels, whose exponent HDR has. */
static range widen_floats(const verifying *v, range in, double largest) {
    const bool hdr = v->output->format == SHD_HDR, half = v->output->depth == SHD_HALF;
    const double size = fmax(fabs(in.least), fabs(in.most)), limit = half ? 65504 : (double)FLT_MAX,
                 by = CONVERSION * size + v->tolerance +
                      (hdr    ? largest / 128 + 1e-38
                       : half ? size * 0x1p-11 + 0x1p-25
                              : size * 0x1p-23);
    const double least = hdr ? fmax(in.least - by, 0) : in.least - by;
    return (range){fmax(least, -limit), fmin(hdr ? fmax(in.most + by, 0) : in.most + by, limit)};
}

/* ---- A pixel of the picture ---- */

static void note_failure(verifying *v, size_t pixel, int sample, double value, range may) {
    static const char *const names[] = {"R", "G", "B", "A"};
    const size_t width = (size_t)v->film.width;
    const int c = v->pack.source[sample];
    const char *name =
        c == 3 ? "A" : shd_channel_names(shd_color_describe(v->transform)->channels)[c];
    if (json_array_size(v->failures) >= TOLD) return;
    json_array_append_new(v->failures,
                          json_pack("{sI sI ss so so so}", "x", (json_int_t)(pixel % width), "y",
                                    (json_int_t)(pixel / width), "channel", name ? name : names[c],
                                    "value", shd_tell_number(value), "least",
                                    shd_tell_number(may.least), "most", shd_tell_number(may.most)));
}

static void check_pixel(verifying *v, size_t pixel) {
    const shd_pack *pack = &v->pack;
    const double reach = find_reach(v, pixel);
    if (!isfinite(reach)) {
        v->unbounded++;
        return;
    }
    float cube[4 * CORNERS];
    convert_cube(v, pixel, reach, cube);
    const bool hidden = pack->alpha && v->output->format == SHD_WEBP &&
                        (double)cube[3] * pack->max < 0.5; /* its color may be anything */
    range all[4];
    double largest = 0;
    for (int s = 0; s < pack->count; s++) {
        all[s] = range_of(v, cube, s);
        largest = fmax(largest, fmax(fabs(all[s].least), fabs(all[s].most)));
    }
    bool failed = false;
    for (int s = 0; s < pack->count; s++) {
        const bool color = pack->source[s] < 3;
        const range may = pack->max > 0 ? widen_codes(v, all[s]) : widen_floats(v, all[s], largest);
        const size_t at = pixel * (size_t)v->samples.count + (size_t)s;
        const double value =
            s < v->samples.count ? (double)v->samples.values[at] : pack->max; /* opaque WebP */
        if ((hidden && color) || (value >= may.least && value <= may.most)) continue;
        failed = true;
        note_failure(v, pixel, s, value, may);
    }
    v->checked++;
    v->failed += failed;
}

/* SplitMix64 (Steele, Lea, Flood, "Fast splittable pseudorandom number generators", 2014). */
static uint64_t draw(uint64_t *state) {
    uint64_t z = *state += 0x9E3779B97F4A7C15u;
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9u;
    z = (z ^ z >> 27) * 0x94D049BB133111EBu;
    return z ^ z >> 31;
}

/* So many of all pixels, each set of them as likely as any other: D. E. Knuth, "The Art of Computer
 * Programming" 2, algorithm 3.4.2 S. */
static shd_status check_pixels(verifying *v, shd_error *error) {
    const size_t total = (size_t)v->film.width * (size_t)v->film.height;
    size_t left = v->options->pixels < total ? v->options->pixels : total;
    uint64_t state = v->options->seed;
    for (size_t i = 0; i < total && left; i++) {
        if (shd_is_cancelled_at(v->r->cancelled, i)) return shd_rendering_cancelled(error);
        const double chance = (double)(draw(&state) >> 11) * 0x1p-53;
        if ((double)(total - i) * chance >= (double)left) continue;
        left--;
        check_pixel(v, i);
    }
    return SHD_OK;
}

/* ---- What the codec loses ---- */

static void look_away(void *nothing, size_t first, size_t rows, const unsigned char *given,
                      const unsigned char *made) {
    (void)nothing, (void)first, (void)rows, (void)given, (void)made;
}

/* The exact picture's samples, 8 bits. NULL: memory. */
static unsigned char *make_codes(const verifying *v) {
    const size_t pixels = (size_t)v->film.width * (size_t)v->film.height,
                 count = (size_t)v->pack.count;
    float row[4 * 1024];
    unsigned char *codes = shd_arena_alloc(v->r->arena, pixels, count);
    for (size_t i = 0; codes && i < pixels; i += 1024) {
        const size_t some = pixels - i < 1024 ? pixels - i : 1024;
        if (shd_is_cancelled(v->r->cancelled)) break;
        memcpy(row, v->film.rgba + 4 * i, 4 * some * sizeof *row);
        if (v->flat) shd_output_flatten(v->output->matte, row, some);
        shd_color_apply(v->transform, row, some);
        if (v->output->dither) shd_output_dither(&v->scene->raster, row, i, i + some);
        shd_pack_row(&v->pack, row, (int)some, codes + i * count);
    }
    return codes;
}

static shd_status measure_codec(verifying *v, const shd_image *image, shd_error *error) {
    const size_t pixels = (size_t)image->width * (size_t)image->height,
                 count = (size_t)v->pack.count;
    shd_bytes file;
    const shd_status status = shd_image_encode(image, v->output->format, v->r->arena, &file, error);
    if (status != SHD_OK) return status;
    const unsigned char *codes = image->samples;
    unsigned char *made = shd_arena_alloc(v->r->arena, pixels, count);
    const bool read = made && shd_image_decode(v->output->format, file.data, file.size,
                                               image->width, image->height, (int)count, made);
    shd_arena_repay(v->r->arena, file.size);
    free(file.data);
    if (!read) return shd_rendering_full(v->r, "check", error);
    int most = 0;
    for (size_t i = 0; i < pixels * count; i++) {
        const size_t alpha = i - i % count + count - 1;
        if (v->pack.alpha && !codes[alpha]) continue;
        const int off = abs(codes[i] - made[i]);
        if (off > most) most = off;
    }
    v->tolerance = most + 1;
    return SHD_OK;
}

/* As given, or what the exact picture loses at the scene's quality, and a code more, by which its
 * own codes may differ. */
static shd_status find_tolerance(verifying *v, const shd_scene *given, shd_error *error) {
    const shd_output *o = v->output;
    const shd_accuracy *accuracy = &given->accuracy;
    v->tolerance = fmax(v->options->tolerance, 0);
    if (v->options->tolerance >= 0) return SHD_OK;
    if (o->format != SHD_JPEG && !(o->format == SHD_WEBP && o->quality < 100)) return SHD_OK;
    if (!o->quality && accuracy->metric == SHD_CODE) v->tolerance = ceil(accuracy->whole);
    if (!o->quality && accuracy->metric == SHD_CODE) return SHD_OK;
    if (!o->quality)
        return shd_fail(error, SHD_SCENE, "/accuracy/metric",
                        "the budget found this picture's quality, and tells nothing of codes: give "
                        "the most that the codec may lose, as a tolerance in codes");
    const shd_image image = {.width = v->film.width,
                             .height = v->film.height,
                             .samples = make_codes(v),
                             .channel = o->channel,
                             .alpha = v->pack.alpha,
                             .depth = SHD_U8,
                             .quality = o->quality,
                             .effort = o->effort,
                             .decoded = o->measured ? look_away : NULL};
    if (!image.samples) return shd_rendering_full(v->r, "check", error);
    return measure_codec(v, &image, error);
}

/* ---- The whole ---- */

static shd_status check_form(const verifying *v, shd_error *error) {
    const shd_samples *s = &v->samples;
    const bool opaque_webp = v->output->format == SHD_WEBP && v->pack.alpha && s->count == 3;
    if (v->output->format != SHD_HDR && s->depth != v->output->depth)
        return shd_fail(error, SHD_SCENE, "", "the picture has samples of depth %s, not %s",
                        shd_depth_name(s->depth), shd_depth_name(v->output->depth));
    if (s->count == v->pack.count || opaque_webp) return SHD_OK;
    return shd_fail(error, SHD_SCENE, "", "the picture has %d channels, not %d", s->count,
                    v->pack.count);
}

static shd_status prepare(verifying *v, const shd_scene *given, shd_format format,
                          shd_error *error) {
    shd_status status = make_scene(v, given, format, error);
    if (status != SHD_OK) return status;
    v->output = v->scene->outputs;
    const shd_image image = {.channel = v->output->channel,
                             .alpha = v->scene->transparent && shd_format_get(format)->alpha,
                             .depth = v->output->depth};
    v->pack = shd_pack_of(&image, format);
    v->flat = shd_output_is_flat(v->scene, v->output);
    status = shd_output_transform(v->r, v->scene, v->output, &v->transform, error);
    if (status == SHD_OK) status = shd_rendering_plan(v->r, given, error);
    if (status != SHD_OK) return status;
    v->own = v->r->plan;
    return shd_pixel_bound_make(v->own, v->r->arena, &v->bound)
               ? SHD_OK
               : shd_rendering_full(v->r, "check", error);
}

static char *tell(verifying *v) {
    const size_t total = (size_t)v->film.width * (size_t)v->film.height;
    json_t *json = json_pack("{sb sI sI sI sI sI ss sf sO}", "verified", v->checked && !v->failed,
                             "checked", (json_int_t)v->checked, "failed", (json_int_t)v->failed,
                             "unbounded", (json_int_t)v->unbounded, "pixels", (json_int_t)total,
                             "seed", (json_int_t)v->options->seed, "plan", v->own->summary,
                             "tolerance", v->tolerance, "failures", v->failures);
    return shd_tell_print(json, 9, NULL);
}

static shd_status verify(shd_request *request, const char *path, shd_format format,
                         const shd_verify_options *options,
                         const shd_render_options *render_options, verifying *v, char **json,
                         shd_error *error) {
    const shd_raster *raster = &request->scene->raster;
    v->r = &request->rendering;
    v->options = options;
    shd_status status =
        shd_sample_file_read(request, path, format, raster->w, raster->h, &v->samples, error);
    if (status == SHD_OK) status = prepare(v, request->scene, format, error);
    if (status == SHD_OK) status = check_form(v, error);
    if (status == SHD_OK) status = render_exactly(v, render_options, error);
    if (status == SHD_OK) status = find_tolerance(v, request->scene, error);
    shd_json_memory_watch();
    v->failures = json_array();
    if (status == SHD_OK) status = check_pixels(v, error);
    if (status == SHD_OK && !(*json = tell(v)))
        status = shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    return status;
}

shd_status shd_request_verify(shd_request *request, const char *path, shd_format format,
                              const shd_verify_options *options,
                              const shd_render_options *render_options, shd_verdict *verdict,
                              char **json, shd_error *error) {
    verifying *v = shd_arena_zalloc(request->rendering.arena, 1, sizeof *v);
    if (!v) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    const shd_status status =
        verify(request, path, format, options, render_options, v, json, error);
    *verdict = v->failed ? SHD_REFUTED : v->checked ? SHD_VERIFIED : SHD_UNDECIDED;
    json_decref(v->failures);
    free(v->samples.values);
    return shd_request_blame(request, status, error);
}
