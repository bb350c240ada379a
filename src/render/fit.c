/* A scene and its photo are read, the photo from what is kept. */
#include <string.h>

#include "render/assets.h"
#include "render/pair.h"
#include "scene/pair.h"

/* What a fit costs beside one picture: its renderings, of eight exponents in the exact tier. */
enum { FITTING = 18 * 8 * 4 };

static const char scene_place[] = "/scene", photo_place[] = "/photo";

/* In the side's arena. */
static shd_status take_samples(shd_request *side, const shd_asset *asset, const shd_samples **out,
                               shd_error *error) {
    shd_arena *arena = side->rendering.arena;
    shd_samples *samples = shd_arena_alloc(arena, 1, sizeof *samples);
    float *values = shd_arena_alloc(arena, shd_asset_count(asset), sizeof *values);
    if (!samples || !values) return shd_rendering_full(&side->rendering, "fit", error);
    *samples = shd_asset_samples(asset, values, side->rendering.cancelled);
    *out = samples;
    return SHD_OK;
}

static shd_status open_photo(shd_request *side, const char *name, shd_pair *pair,
                             shd_error *error) {
    shd_asset asset;
    shd_status status = shd_asset_open(side, name, &asset, error);
    if (status != SHD_OK) return status;
    const char *dot = strrchr(asset.name, '.');
    if (!dot || !shd_format_find(dot + 1, &pair->format)) pair->format = SHD_PNG;
    status = take_samples(side, &asset, &pair->photo, error);
    shd_stored_drop(asset.thing);
    return shd_request_blame(side, status, error);
}

static void check_size(shd_request *request) {
    const shd_pair *pair = request->pair;
    const shd_raster *raster = &pair->sides[0]->scene->raster;
    if (pair->photo->width != raster->w || pair->photo->height != raster->h)
        shd_report_error(&request->report, SHD_SCENE, photo_place,
                         "the picture has %d x %d pixels, not %d x %d", pair->photo->width,
                         pair->photo->height, raster->w, raster->h);
}

static shd_status read_fit(shd_request *request, const char *json, size_t length) {
    shd_fit_texts texts;
    shd_error error;
    shd_report *report = &request->report;
    if (shd_fit_read(json, length, &request->limits, request->rendering.cancelled,
                     request->rendering.arena, &texts, report) != SHD_OK)
        return report->status;
    shd_pair *pair = shd_pair_new(request);
    if (!pair || shd_pair_new_side(request, scene_place, 1, &pair->sides[0]) != SHD_OK)
        return report->status;
    shd_request *side = pair->sides[0];
    pair->object = texts.object;
    /* A scene that names no format has that of its photo. */
    const shd_status opened = open_photo(side, texts.photo, pair, &error);
    shd_request_read(side, texts.scene.at, (size_t)(texts.scene.end - texts.scene.at),
                     pair->format);
    shd_pair_take_report(request, scene_place, &side->report);
    if (opened != SHD_OK) {
        shd_report_error(report, opened, photo_place, "%s", error.text);
        shd_report_limit(report, error.limit);
    }
    if (report->status != SHD_OK) return report->status;
    check_size(request);
    if (__builtin_mul_overflow(shd_request_work(side), (uint64_t)FITTING, &pair->work))
        pair->work = UINT64_MAX;
    return report->status;
}

shd_status shd_request_read_fit(shd_request *request, const char *json, size_t length) {
    shd_stage_begin(&request->rendering);
    const shd_status status = read_fit(request, json, length);
    shd_stage_end(&request->rendering, &request->rendering.times.parse);
    return shd_request_blame_report(request, status);
}
