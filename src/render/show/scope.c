#include "render/show/scope.h"

#include <math.h>
#include <string.h>

#include "analysis/scopes.h"
#include "base/primaries.h"
#include "render/show/conversion.h"
#include "render/show/displayed.h"

enum { BLOCK = 1024 };

/* ---- Stops: of light, before any view. ---- */

typedef struct stopping {
    const shd_rendering *rendering;
    const shd_film *film;
    const shd_displayed *displayed;
    const shd_color_transform *transform; /* to linear Rec.709 */
    size_t pixels;
    float *stops;
} stopping;

static void find_stops(void *context, size_t index, unsigned slot) {
    (void)slot;
    const stopping *work = context;
    if (shd_is_cancelled(work->rendering->cancelled)) return;
    const size_t first = index * BLOCK, left = work->pixels - first,
                 count = left < BLOCK ? left : BLOCK;
    float rgba[4 * BLOCK];
    memcpy(rgba, work->film->rgba + 4 * first, 4 * count * sizeof *rgba);
    const shd_showing *showing = &work->displayed->showing;
    if (showing->flatten) shd_output_flatten(showing->matte, rgba, count);
    shd_color_apply(work->transform, rgba, count);
    for (size_t i = 0; i < count; i++) {
        const float *at = rgba + 4 * i;
        /* Rec. ITU-R BT.709: the row of Y. */
        const double y = 0.2126 * (double)at[0] + 0.7152 * (double)at[1] + 0.0722 * (double)at[2];
        work->stops[first + i] = (float)(y <= 0 ? (double)-INFINITY : log2(y / 0.18));
    }
}

static shd_status add_stops(shd_rendering *r, const shd_film *film, const shd_output *output,
                            const shd_displayed *displayed, shd_scoped *scoped, shd_error *error) {
    const shd_output light = {.color_space = shd_color_catalog(r->engine->color)->rec709,
                              .depth = SHD_FLOAT,
                              .adjust = {.exposure = output->adjust.exposure, .gamma = 1}};
    stopping work = {r, film, displayed, NULL, displayed->pixels, NULL};
    const shd_status status =
        shd_output_transform(r, r->plan->scene, &light, &work.transform, error);
    if (status != SHD_OK) return status;
    work.stops = shd_arena_alloc(r->arena, work.pixels, sizeof *work.stops);
    if (!work.stops) return shd_rendering_full(r, "scope", error);
    shd_stage_spread(r, (work.pixels + BLOCK - 1) / BLOCK, find_stops, &work);
    scoped->stops = work.stops;
    return SHD_OK;
}

/* ---- Chromaticity: of what a screen shows. ---- */

static void place_of(const double xyz[3], double uv[2]) {
    const double sum = xyz[0] + 15 * xyz[1] + 3 * xyz[2];
    uv[0] = 4 * xyz[0] / sum;
    uv[1] = 9 * xyz[1] / sum;
}

static void place_of_xy(const double xy[2], double uv[2]) {
    place_of((const double[3]){xy[0], xy[1], 1 - xy[0] - xy[1]}, uv);
}

/* CIE 15:2004, the inverse of CIELAB's curve. */
static double uncurve(double f) {
    return f > 6.0 / 29 ? f * f * f : 3 * (6.0 / 29) * (6.0 / 29) * (f - 4.0 / 29);
}

typedef struct placing {
    const shd_rendering *rendering;
    const shd_displayed *displayed;
    double white[3]; /* XYZ */
    float (*places)[2];
} placing;

/* By Lab of what a screen shows, whose white is the encoding's. */
static void find_places(void *context, size_t index, unsigned slot) {
    static const double DARK = 0.5; /* L*, below which a color is black to the eye */
    (void)slot;
    const placing *work = context;
    if (shd_is_cancelled(work->rendering->cancelled)) return;
    const shd_displayed *d = work->displayed;
    const size_t first = index * BLOCK, left = d->pixels - first,
                 count = left < BLOCK ? left : BLOCK;
    float seen[4 * BLOCK];
    shd_displayed_colors(d, first, count, seen);
    for (size_t i = 0; i < count; i++) {
        double lab[3], uv[2] = {NAN, NAN};
        shd_lab_of(&d->showing.lab, seen + 4 * i, lab);
        const double y = (lab[0] + 16) / 116;
        if (lab[0] > DARK)
            place_of((const double[3]){work->white[0] * uncurve(y + lab[1] / 500), uncurve(y),
                                       work->white[2] * uncurve(y - lab[2] / 200)},
                     uv);
        work->places[first + i][0] = (float)uv[0];
        work->places[first + i][1] = (float)uv[1];
    }
}

static shd_status add_places(shd_rendering *r, const shd_displayed *d, shd_scoped *scoped,
                             shd_error *error) {
    const shd_color_transform *seen = d->showing.detour ? d->showing.detour : d->showing.transform;
    const shd_color_info *info = shd_color_describe(seen);
    const double *xy = info->has_primaries ? info->primaries : shd_rec709;
    placing work = {r, d, {xy[6] / xy[7], 1, (1 - xy[6] - xy[7]) / xy[7]}, .places = NULL};
    work.places = shd_arena_alloc(r->arena, d->pixels, sizeof *work.places);
    if (!work.places) return shd_rendering_full(r, "scope", error);
    shd_stage_spread(r, (d->pixels + BLOCK - 1) / BLOCK, find_places, &work);
    for (size_t k = 0; k < 4; k++) place_of_xy(xy + 2 * k, scoped->primaries[k]);
    scoped->places = (const float(*)[2])work.places;
    return SHD_OK;
}

/* ---- The picture. ---- */

shd_status shd_scope_make(shd_rendering *r, const shd_film *film, const shd_output *output,
                          const void **samples, shd_error *error) {
    shd_displayed d;
    shd_status status = shd_displayed_make(r, r->plan->scene, output, film, &d, error);
    if (status != SHD_OK) return status;
    shd_scoped scoped = {film->width,      film->height,  d.rgba,
                         d.info->channels, .stops = NULL, .places = NULL};
    if (output->scope == SHD_SCOPE_FALSECOLOR)
        status = add_stops(r, film, output, &d, &scoped, error);
    if (output->scope == SHD_SCOPE_CHROMATICITY) status = add_places(r, &d, &scoped, error);
    if (status != SHD_OK) return status;
    unsigned char *rgb = shd_arena_alloc(r->arena, d.pixels, 3);
    if (!rgb || !shd_scope_paint(output->scope, &scoped, rgb, r->arena, r->cancelled))
        return shd_is_cancelled(r->cancelled) ? shd_rendering_cancelled(error)
                                              : shd_rendering_full(r, "scope", error);
    *samples = rgb;
    return SHD_OK;
}

uint64_t shd_scope_size(const shd_output *output, uint64_t pixels) {
    const uint64_t floats = 4 + (output->scope == SHD_SCOPE_FALSECOLOR     ? 1
                                 : output->scope == SHD_SCOPE_CHROMATICITY ? 2
                                                                           : 0);
    return pixels * (floats * sizeof(float) + 3) + shd_scope_scratch(output->scope, (size_t)pixels);
}

void shd_scope_describe(const shd_rendering *r, const shd_output *output, shd_image *image) {
    image->about =
        shd_arena_printf(r->arena, "%s of %s", shd_scope_names[output->scope], image->space);
    image->alpha = false;
    image->channel = -1;
    image->transfer = SHD_TRANSFER_SRGB;
    image->has_primaries = true;
    memcpy(image->primaries, shd_rec709, sizeof image->primaries);
    image->space = "sRGB";
    image->channel_names = shd_channel_names(SHD_RGB);
}
