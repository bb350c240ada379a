#include "render/tell/side.h"

#include <math.h>
#include <stdlib.h>

#include "base/primaries.h"
#include "base/sample.h"
#include "render/assets.h"
#include "render/show/displayed.h"
#include "render/tell/bare.h"
#include "render/tell/sample_file.h"

enum { BLOCK = 1024 };

/* From what an encoding means to sRGB's linear light. */
typedef struct meaning {
    shd_lab_space space;
    bool is_srgb;
    double to_rgb[3][3]; /* from XYZ divided by the white */
} meaning;

/* A side in the making, of a scene, of a file or of an asset. */
typedef struct making {
    shd_side *side;
    const atomic_bool *cancelled;
    meaning meaning;
    const shd_displayed *displayed; /* or */
    const shd_samples *samples;     /* or */
    const shd_asset *asset;
    double max; /* of codes; 0: values are not rounded to any */
    size_t pixels;
} making;

/* ---- Colors ---- */

/* Primaries that were measured through a transform are sRGB's if they are to 1e-4. */
static meaning meaning_of(const shd_lab_space *space) {
    shd_lab_space srgb;
    shd_lab_space_make(SHD_TRANSFER_SRGB, shd_rec709, &srgb);
    meaning out = {.space = space ? *space : srgb, .is_srgb = true};
    for (int i = 0; i < 9; i++)
        if (fabs(out.space.to_xyz[i / 3][i % 3] - srgb.to_xyz[i / 3][i % 3]) > 1e-4)
            out.is_srgb = false;
    shd_matrix_invert(srgb.to_xyz, out.to_rgb);
    return out;
}

/* Encoded and straight, held in [0,1]. */
static void put_pixel(const making *m, size_t at, const double rgb[3], double alpha) {
    double light[3], xyz[3];
    float *out = m->side->rgb + 3 * at;
    for (int c = 0; c < 3; c++)
        light[c] = shd_curve_decode(m->meaning.space.transfer, rgb[c] * alpha);
    m->side->alpha[at] = (float)alpha;
    if (m->meaning.is_srgb) {
        for (int c = 0; c < 3; c++) out[c] = (float)light[c];
        return;
    }
    for (int row = 0; row < 3; row++) {
        const double *by = m->meaning.space.to_xyz[row];
        xyz[row] = by[0] * light[0] + by[1] * light[1] + by[2] * light[2];
    }
    for (int c = 0; c < 3; c++) {
        const double *by = m->meaning.to_rgb[c];
        out[c] = (float)(by[0] * xyz[0] + by[1] * xyz[1] + by[2] * xyz[2]);
    }
}

static double code_of(const making *m, float value) {
    if (!(m->max > 0)) return shd_hold((double)value, 1);
    return shd_code((double)value * m->max, m->max) / m->max;
}

static void take_displayed(const making *m, size_t first, size_t count) {
    float colors[4 * BLOCK];
    shd_displayed_colors(m->displayed, first, count, colors);
    for (size_t i = 0; i < count; i++) {
        double rgb[3];
        for (int c = 0; c < 3; c++) rgb[c] = code_of(m, colors[4 * i + (size_t)c]);
        put_pixel(m, first + i, rgb, code_of(m, m->displayed->rgba[4 * (first + i) + 3]));
    }
}

/* Grey is three times the same. */
static void take_samples(const making *m, size_t first, size_t count) {
    const shd_samples *s = m->samples;
    const size_t colors = (size_t)(s->count - s->alpha);
    for (size_t i = first; i < first + count; i++) {
        const float *at = s->values + i * (size_t)s->count;
        const double alpha = s->alpha ? (double)at[colors] / m->max : 1;
        const double by = s->associated && alpha > 0 ? m->max * alpha : m->max;
        double rgb[3];
        for (size_t c = 0; c < 3; c++) rgb[c] = (double)at[colors < 3 ? 0 : c] / by;
        put_pixel(m, i, rgb, alpha);
    }
}

static void take_asset(const making *m, size_t first, size_t count) {
    const shd_decoded *p = m->asset->picture;
    const size_t samples = (size_t)p->count, colors = samples - (size_t)p->alpha;
    for (size_t i = first; i < first + count; i++) {
        double value[4], rgb[3];
        for (size_t c = 0; c < samples; c++)
            value[c] = p->depth == SHD_U8
                           ? (double)((const uint8_t *)m->asset->samples)[i * samples + c]
                           : (double)((const uint16_t *)m->asset->samples)[i * samples + c];
        const double alpha = p->alpha ? value[colors] / m->max : 1;
        const double by = p->associated && alpha > 0 ? m->max * alpha : m->max;
        for (size_t c = 0; c < 3; c++) rgb[c] = value[colors < 3 ? 0 : c] / by;
        put_pixel(m, i, rgb, alpha);
    }
}

static void take_block(void *context, size_t index, unsigned slot) {
    (void)slot;
    const making *m = context;
    const size_t first = index * BLOCK, left = m->pixels - first;
    if (shd_is_cancelled(m->cancelled)) return;
    (m->displayed ? take_displayed
     : m->samples ? take_samples
                  : take_asset)(m, first, left < BLOCK ? left : BLOCK);
}

/* ---- Sides ---- */

static shd_status make_side(shd_rendering *r, making *m, int width, int height, shd_side **out,
                            shd_error *error) {
    m->pixels = (size_t)width * (size_t)height;
    m->cancelled = r->cancelled;
    shd_side *side = shd_arena_alloc(r->arena, 1, sizeof *side);
    if (!side) return shd_rendering_full(r, "comparison", error);
    *side = (shd_side){.width = width,
                       .height = height,
                       .rgb = shd_arena_alloc(r->arena, m->pixels, 3 * sizeof *side->rgb),
                       .alpha = shd_arena_alloc(r->arena, m->pixels, sizeof *side->alpha)};
    if (!side->rgb || !side->alpha) return shd_rendering_full(r, "comparison", error);
    m->side = side;
    shd_stage_spread(r, (m->pixels + BLOCK - 1) / BLOCK, take_block, m);
    *out = side;
    return shd_is_cancelled(r->cancelled) ? shd_rendering_cancelled(error) : SHD_OK;
}

static shd_status check_output(const shd_scene *scene, shd_error *error) {
    if (scene->multipart)
        return shd_fail(error, SHD_SCENE, "/outputs",
                        "one picture is compared: give one `output` instead");
    if (scene->outputs->scope)
        return shd_fail(error, SHD_SCENE, "/output/scope", "a scope shows no pixels of the scene");
    if (scene->outputs->channel >= 0)
        return shd_fail(error, SHD_SCENE, "/output/channel",
                        "colors are compared: give no `channel`");
    return SHD_OK;
}

shd_status shd_side_render(shd_request *request, const shd_render_options *options, shd_side **out,
                           shd_error *error) {
    shd_rendering *r = &request->rendering;
    const shd_output *output = request->scene->outputs;
    shd_film film = {0};
    shd_displayed displayed;
    shd_status status = check_output(request->scene, error);
    if (status == SHD_OK) status = shd_bare_render(r, request->scene, options, &film, error);
    if (status != SHD_OK) return shd_request_blame(request, status, error);
    shd_stage_begin(r);
    status = shd_displayed_make(r, r->plan->scene, output, &film, &displayed, error);
    if (status == SHD_OK && displayed.info->data)
        status = shd_fail(error, SHD_SCENE, "/output",
                          "its values are data, which mean no color that could be compared");
    if (status == SHD_OK) {
        making m = {.displayed = &displayed, .meaning = meaning_of(&displayed.showing.lab)};
        if (displayed.integers && !displayed.showing.detour)
            m.max = output->depth == SHD_U16 ? 65535 : 255;
        status = make_side(r, &m, film.width, film.height, out, error);
    }
    shd_stage_end(r, &r->times.color);
    return shd_request_blame(request, status, error);
}

/* What `shd_depth` means for a side. False: nothing, which is an error. */
static bool takes_depth(making *m, shd_depth depth, shd_error *error) {
    m->max = depth == SHD_U8 ? 255 : 65535;
    if (depth == SHD_U8 || depth == SHD_U16) return true;
    shd_fail(error, SHD_SCENE, "",
             "its samples are floats, which say nothing of what a display shows: 8 or 16 bits are "
             "compared");
    return false;
}

shd_status shd_side_open(shd_request *request, const char *name, shd_side **out, shd_error *error) {
    shd_asset asset;
    making m = {.asset = &asset, .meaning = meaning_of(NULL)};
    shd_status status = shd_asset_open(request, name, &asset, error);
    if (status != SHD_OK) return status;
    const shd_decoded *p = asset.picture;
    status = takes_depth(&m, (shd_depth)p->depth, error)
                 ? make_side(&request->rendering, &m, p->width, p->height, out, error)
                 : SHD_SCENE;
    shd_stored_drop(asset.thing);
    return shd_request_blame(request, status, error);
}

shd_status shd_side_read(shd_request *request, const char *path, shd_format format, shd_side **out,
                         shd_error *error) {
    shd_samples samples = {0};
    making m = {.samples = &samples, .meaning = meaning_of(NULL)};
    shd_status status = shd_sample_file_read(request, path, format, 0, 0, &samples, error);
    if (status != SHD_OK) return status;
    status = takes_depth(&m, samples.depth, error)
                 ? make_side(&request->rendering, &m, samples.width, samples.height, out, error)
                 : SHD_SCENE;
    free(samples.values);
    return shd_request_blame(request, status, error);
}
