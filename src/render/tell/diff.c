/* How far two pictures are apart, in figures and as a map. */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "analysis/figures.h"
#include "analysis/flip.h"
#include "base/json_memory.h"
#include "color/delta_e.h"
#include "image/image.h"
#include "render/pair.h"
#include "render/tell/json.h"
#include "render/tell/side.h"

enum { ROWS = 32, P50 = 3, P95 = 5, P99 = 6 };

typedef struct diffing {
    shd_rendering *r;
    const shd_side *a, *b;
    shd_flip filters;
    size_t pixels, scratch_size;
    float *scratch;        /* of each slot */
    float *flip, *delta_e; /* [pixels] */
} diffing;

/* ---- Finding ---- */

/* Of linear light that may be beyond sRGB's gamut. */
static void lab_of(const diffing *d, const float rgb[3], double lab[3]) {
    double f[3];
    for (int row = 0; row < 3; row++) {
        const double *by = d->filters.to_xyz[row];
        f[row] =
            shd_lab_curve(by[0] * (double)rgb[0] + by[1] * (double)rgb[1] + by[2] * (double)rgb[2]);
    }
    lab[0] = 116 * f[1] - 16;
    lab[1] = 500 * (f[0] - f[1]);
    lab[2] = 200 * (f[1] - f[2]);
}

static void find_delta_e(const diffing *d, size_t first, size_t count) {
    for (size_t i = first; i < first + count; i++) {
        if (shd_is_cancelled_at(d->r->cancelled, i)) return;
        const float *a = d->a->rgb + 3 * i, *b = d->b->rgb + 3 * i;
        double from[3], to[3];
        d->delta_e[i] = 0;
        if (!memcmp(a, b, 3 * sizeof *a)) continue;
        lab_of(d, a, from);
        lab_of(d, b, to);
        d->delta_e[i] = (float)shd_delta_e_2000(from, to);
    }
}

static void diff_band(void *context, size_t index, unsigned slot) {
    diffing *d = context;
    if (shd_is_cancelled(d->r->cancelled)) return;
    const int first = (int)index * ROWS, left = d->a->height - first;
    const int rows = left < ROWS ? left : ROWS;
    const size_t wide = (size_t)d->a->width, at = (size_t)first * wide;
    find_delta_e(d, at, (size_t)rows * wide);
    shd_flip_band(&d->filters, d->a->rgb, d->b->rgb, d->a->width, d->a->height, first, rows,
                  d->r->cancelled, d->scratch + slot * d->scratch_size, d->flip + at);
}

static bool find_figures(const diffing *d, const float *values, double high, shd_apart *out) {
    shd_figures_scratch *scratch = shd_figures_scratch_new(d->r->arena);
    shd_figures f;
    if (!scratch ||
        !shd_figures_find(values, d->pixels, (shd_extent){0, high}, scratch, d->r->cancelled, &f))
        return false;
    *out = (shd_apart){.mean = f.mean,
                       .p50 = f.percentiles[P50],
                       .p95 = f.percentiles[P95],
                       .p99 = f.percentiles[P99],
                       .max = f.max};
    size_t most = 0;
    while (most < d->pixels - 1 && (double)values[most] < f.max) most++;
    out->x = (int)(most % (size_t)d->a->width);
    out->y = (int)(most / (size_t)d->a->width);
    return true;
}

static void count_pixels(const diffing *d, shd_diff *out) {
    for (size_t i = 0; i < d->pixels; i++) {
        if (shd_is_cancelled_at(d->r->cancelled, i)) return;
        const double alpha = fabs((double)d->a->alpha[i] - (double)d->b->alpha[i]);
        out->alpha = fmax(out->alpha, alpha);
        out->pixels +=
            alpha > 0 || memcmp(d->a->rgb + 3 * i, d->b->rgb + 3 * i, 3 * sizeof(float)) != 0;
    }
}

static shd_status find_difference(diffing *d, double density, shd_diff *out, shd_error *error) {
    shd_rendering *r = d->r;
    const unsigned slots = shd_pool_slots(r->engine->pool);
    const size_t bands = ((size_t)d->a->height + ROWS - 1) / ROWS;
    shd_flip_make(density, &d->filters);
    d->scratch_size = shd_flip_scratch(&d->filters, d->a->width, ROWS);
    d->flip = shd_arena_alloc(r->arena, d->pixels, sizeof *d->flip);
    d->delta_e = shd_arena_alloc(r->arena, d->pixels, sizeof *d->delta_e);
    d->scratch = shd_arena_alloc(r->arena, d->scratch_size, slots * sizeof *d->scratch);
    if (!d->flip || !d->delta_e || !d->scratch) return shd_rendering_full(r, "comparison", error);
    shd_stage_spread(r, bands, diff_band, d);
    if (shd_is_cancelled(r->cancelled)) return shd_rendering_cancelled(error);
    *out = (shd_diff){.width = d->a->width, .height = d->a->height};
    const bool found =
        find_figures(d, d->delta_e, 100, &out->delta_e) && find_figures(d, d->flip, 1, &out->flip);
    count_pixels(d, out);
    if (shd_is_cancelled(r->cancelled)) return shd_rendering_cancelled(error);
    return found ? SHD_OK : shd_rendering_full(r, "comparison", error);
}

/* ---- Telling ---- */

static json_t *tell_apart(const shd_apart *a) {
    return json_pack("{sf sf sf sf sf s[ii]}", "mean", a->mean, "p50", a->p50, "p95", a->p95, "p99",
                     a->p99, "max", a->max, "at", a->x, a->y);
}

static char *tell(const shd_diff *d, double density, const atomic_bool *cancelled) {
    shd_json_memory_watch();
    json_t *json =
        json_pack("{si si sf sI sf so so}", "width", d->width, "height", d->height,
                  "pixelsPerDegree", density, "differing", (json_int_t)d->pixels, "alpha", d->alpha,
                  "deltaE2000", tell_apart(&d->delta_e), "flip", tell_apart(&d->flip));
    return shd_tell_print(json, 9, cancelled);
}

/* Black over violet and orange to a pale yellow, in sRGB's codes: the stops of magma (S. van der
 * Walt, N. Smith, 2015, CC0), which the paper shows errors in. */
static void heat_of(double value, unsigned char out[3]) {
    static const unsigned char stops[9][3] = {{0, 0, 4},      {28, 16, 68},    {79, 18, 123},
                                              {129, 37, 129}, {181, 54, 122},  {229, 80, 100},
                                              {251, 135, 97}, {254, 194, 135}, {252, 253, 191}};
    const double at = 8 * fmin(fmax(value, 0), 1);
    const int below = at < 7 ? (int)at : 7;
    for (int c = 0; c < 3; c++)
        out[c] = (unsigned char)(stops[below][c] +
                                 (at - below) * (stops[below + 1][c] - stops[below][c]) + 0.5);
}

static bool goes_on(void *context) {
    return !shd_is_cancelled(((const diffing *)context)->r->cancelled);
}

static shd_status draw_map(diffing *d, unsigned char **data, size_t *size, shd_error *error) {
    shd_arena *arena = d->r->arena;
    unsigned char *rgb = shd_arena_alloc(arena, d->pixels, 3);
    if (!rgb) return shd_rendering_full(d->r, "map", error);
    for (size_t i = 0; i < d->pixels; i++) {
        if (shd_is_cancelled_at(d->r->cancelled, i)) return shd_rendering_cancelled(error);
        heat_of((double)d->flip[i], rgb + 3 * i);
    }
    const shd_image image = {.width = d->a->width,
                             .height = d->a->height,
                             .depth = SHD_U8,
                             .channel = -1,
                             .samples = rgb,
                             .transfer = SHD_TRANSFER_SRGB,
                             .go_on = goes_on,
                             .slots = 1,
                             .context = d};
    shd_bytes file;
    const shd_status status = shd_image_encode(&image, SHD_PNG, arena, &file, error);
    if (status != SHD_OK) return status;
    *data = file.data;
    *size = file.size;
    return SHD_OK;
}

/* ---- Requests ---- */

shd_status shd_request_read_picture(shd_request *request, const char *path, shd_format format,
                                    shd_error *error) {
    return shd_side_read(request, path, format, &request->side, error);
}

shd_status shd_request_show(shd_request *request, const shd_render_options *options,
                            shd_error *error) {
    return request->side ? SHD_OK : shd_side_render(request, options, &request->side, error);
}

static shd_status diff(shd_request *a, const shd_request *b, const shd_diff_options *options,
                       shd_diff *out, char **json, unsigned char **map, size_t *map_size,
                       shd_error *error) {
    const double density = options->density > 0 ? options->density : SHD_FLIP_USUAL;
    diffing d = {.r = &a->rendering, .a = a->side, .b = b->side};
    if (d.a->width != d.b->width || d.a->height != d.b->height)
        return shd_fail(error, SHD_SCENE, "", "the pictures have %d x %d and %d x %d pixels",
                        d.a->width, d.a->height, d.b->width, d.b->height);
    d.pixels = (size_t)d.a->width * (size_t)d.a->height;
    shd_status status = find_difference(&d, density, out, error);
    if (status == SHD_OK && options->map) status = draw_map(&d, map, map_size, error);
    if (status != SHD_OK || (*json = tell(out, density, d.r->cancelled))) return status;
    if (options->map) free(*map);
    return shd_is_cancelled(d.r->cancelled) ? shd_rendering_cancelled(error)
                                            : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
}

shd_status shd_request_diff(shd_request *a, const shd_request *b, const shd_diff_options *options,
                            shd_diff *out, char **json, unsigned char **map, size_t *map_size,
                            shd_error *error) {
    const shd_status status = diff(a, b, options, out, json, map, map_size, error);
    return shd_request_blame(a, status, error);
}

/* Says of which side it is. */
static shd_status show_side(shd_request *request, int which, shd_error *error) {
    shd_error why;
    shd_request *side = request->pair->sides[which];
    const shd_status status = shd_request_show(side, NULL, &why);
    shd_times_add(&request->rendering.times, &side->rendering.times);
    if (status == SHD_OK) return SHD_OK;
    char place[sizeof why.path];
    snprintf(place, sizeof place, "/%c%.*s", which ? 'b' : 'a', (int)sizeof place - 3, why.path);
    shd_fail(error, status, place, "%s", why.text);
    if (error) error->limit = why.limit;
    return status;
}

shd_status shd_request_diff_pair(shd_request *request, bool map, unsigned char **data, size_t *size,
                                 shd_error *error) {
    const shd_diff_options options = {.density = request->pair->density, .map = map};
    shd_diff found;
    char *json;
    unsigned char *picture = NULL;
    size_t picture_size = 0;
    shd_status status = SHD_OK;
    for (int i = 0; i < 2 && status == SHD_OK; i++) status = show_side(request, i, error);
    if (status == SHD_OK)
        status = shd_request_diff(request->pair->sides[0], request->pair->sides[1], &options,
                                  &found, &json, &picture, &picture_size, error);
    if (status != SHD_OK) return status;
    *data = map ? picture : (unsigned char *)json;
    *size = map ? picture_size : strlen(json);
    if (map) free(json);
    return SHD_OK;
}
