#include "render/show/displayed.h"

#include <math.h>
#include <string.h>

#include "analysis/axes.h"
#include "base/sample.h"
#include "render/show/conversion.h"

enum { BLOCK = 1024 };

static size_t block_count(size_t pixels) {
    return (pixels + BLOCK - 1) / BLOCK;
}

static size_t block_size(size_t pixels, size_t index) {
    const size_t left = pixels - index * BLOCK;
    return left < BLOCK ? left : BLOCK;
}

/* ---- Converting. ---- */

typedef struct converting {
    shd_displayed *displayed;
    const atomic_bool *cancelled;
    const shd_color_transform *codes; /* NULL: nothing is clipped; or that to floats */
    shd_pack pack;
    atomic_uint_least64_t clipped, beyond, not_finite, transparent;
} converting;

static bool is_finite(const float rgb[3]) {
    return isfinite(rgb[0]) && isfinite(rgb[1]) && isfinite(rgb[2]);
}

static void copy_pixels(const shd_displayed *d, size_t first, size_t count, float *out) {
    memcpy(out, d->film->rgba + 4 * first, 4 * count * sizeof *out);
    if (d->showing.flatten) shd_output_flatten(d->showing.matte, out, count);
}

static uint64_t count_clipped(const shd_pack *pack, const float *rgba, size_t count) {
    uint64_t clipped = 0;
    for (size_t i = 0; i < count; i++) {
        if (!(rgba[4 * i + 3] > 0)) continue;
        for (int s = 0; s < pack->count; s++) {
            const size_t c = (size_t)pack->source[s];
            clipped += c < 3 && shd_is_clipped((double)rgba[4 * i + c] * pack->max, pack->max);
        }
    }
    return clipped;
}

static void convert_block(void *context, size_t index, unsigned slot) {
    (void)slot;
    converting *work = context;
    if (shd_is_cancelled(work->cancelled)) return;
    const shd_displayed *d = work->displayed;
    const size_t count = block_size(d->pixels, index);
    float *rgba = d->rgba + 4 * BLOCK * index, codes[4 * BLOCK];
    copy_pixels(d, index * BLOCK, count, rgba);
    shd_color_apply(d->showing.transform, rgba, count);
    if (work->codes && work->codes != d->showing.transform) {
        copy_pixels(d, index * BLOCK, count, codes);
        shd_color_apply(work->codes, codes, count);
        atomic_fetch_add(&work->clipped, count_clipped(&work->pack, codes, count));
    } else if (work->codes) {
        atomic_fetch_add(&work->clipped, count_clipped(&work->pack, rgba, count));
    }
    uint64_t beyond = 0, not_finite = 0, transparent = 0;
    for (size_t i = 0; i < count; i++) {
        const float *at = rgba + 4 * i;
        if (!(at[3] > 0)) {
            transparent++;
        } else if (!is_finite(at)) {
            not_finite++;
        } else {
            for (int c = 0; c < 3; c++)
                if (at[c] < 0 || at[c] > 1) {
                    beyond++;
                    break;
                }
        }
    }
    atomic_fetch_add(&work->beyond, beyond);
    atomic_fetch_add(&work->not_finite, not_finite);
    atomic_fetch_add(&work->transparent, transparent);
}

shd_status shd_displayed_make(shd_rendering *r, const shd_scene *scene, const shd_output *output,
                              const shd_film *film, shd_displayed *out, shd_error *error) {
    const size_t pixels = (size_t)film->width * (size_t)film->height;
    *out = (shd_displayed){.film = film,
                           .pixels = pixels,
                           .integers = output->depth == SHD_U8 || output->depth == SHD_U16};
    shd_status status = shd_showing_floats(r, scene, output, &out->showing, error);
    if (status != SHD_OK) return status;
    converting work = {.displayed = out, .cancelled = r->cancelled};
    if (out->integers) status = shd_output_transform(r, scene, output, &work.codes, error);
    if (status != SHD_OK) return status;
    const shd_image image = {.channel = output->channel, .depth = output->depth};
    work.pack = shd_pack_of(&image, output->format);
    out->info = shd_color_describe(out->showing.transform);
    out->color = out->info->channels == SHD_RGB && !out->info->data;
    out->rgba = shd_arena_alloc(r->arena, pixels, 4 * sizeof *out->rgba);
    if (!out->rgba) return shd_rendering_full(r, "analysis", error);
    shd_stage_spread(r, block_count(pixels), convert_block, &work);
    out->clipped = atomic_load(&work.clipped);
    out->beyond = atomic_load(&work.beyond);
    out->not_finite = atomic_load(&work.not_finite);
    out->transparent = atomic_load(&work.transparent);
    return shd_is_cancelled(r->cancelled) ? shd_rendering_cancelled(error) : SHD_OK;
}

/* ---- Axes. ---- */

typedef struct turning {
    const shd_displayed *displayed;
    const atomic_bool *cancelled;
    shd_axes axes;
    float *planes;
} turning;

void shd_displayed_colors(const shd_displayed *displayed, size_t first, size_t count, float *out) {
    if (displayed->showing.detour) {
        copy_pixels(displayed, first, count, out);
        shd_color_apply(displayed->showing.detour, out, count);
    } else {
        memcpy(out, displayed->rgba + 4 * first, 4 * count * sizeof *out);
    }
}

static void turn_block(void *context, size_t index, unsigned slot) {
    (void)slot;
    const turning *work = context;
    if (shd_is_cancelled(work->cancelled)) return;
    const shd_displayed *d = work->displayed;
    const size_t count = block_size(d->pixels, index);
    const float *rgba = d->rgba + 4 * BLOCK * index, *from = rgba;
    float seen[4 * BLOCK];
    if (work->axes == SHD_AXES_LAB) {
        shd_displayed_colors(d, index * BLOCK, count, seen);
        from = seen;
    }
    for (size_t i = 0; i < count; i++) {
        const float *at = from + 4 * i;
        double value[3] = {(double)at[0], (double)at[1], (double)at[2]};
        if (work->axes == SHD_AXES_HSV) shd_hsv_of(at, value);
        if (work->axes == SHD_AXES_YIQ) shd_yiq_of(at, value);
        if (work->axes == SHD_AXES_LAB) shd_lab_of(&d->showing.lab, at, value);
        const bool counts = rgba[4 * i + 3] > 0 && is_finite(rgba + 4 * i);
        for (size_t c = 0; c < 3; c++)
            work->planes[c * d->pixels + index * BLOCK + i] = counts ? (float)value[c] : NAN;
    }
}

bool shd_displayed_axes(shd_rendering *r, const shd_displayed *displayed, shd_axes axes,
                        float *planes) {
    turning work = {displayed, r->cancelled, axes, planes};
    shd_stage_spread(r, block_count(displayed->pixels), turn_block, &work);
    return !shd_is_cancelled(r->cancelled);
}
