/* Two scenes or pictures are read, each as a request of its own. */
#include "render/pair.h"

#include "render/tell/estimate.h"
#include "render/tell/side.h"
#include "scene/pair.h"

/* What comparing a pixel costs, in units of shd_request_work. */
enum { COMPARING = 1000 };

static const char *const places[] = {"/a", "/b"};

void shd_pair_take_report(shd_request *request, const char *place, const shd_report *from) {
    shd_report *report = &request->report;
    shd_arena *arena = request->rendering.arena;
    for (size_t i = 0; i < shd_report_errors_kept(from); i++) {
        const char *at = shd_arena_printf(arena, "%s%s", place, from->errors[i].pointer);
        shd_report_error(report, from->status, at ? at : place, "%s", from->errors[i].detail);
    }
    if (from->status == SHD_LIMIT || from->status == SHD_MEMORY)
        shd_report_limit(report, from->limit);
    for (size_t i = 0; i < shd_report_warnings_kept(from); i++) {
        const char *at = shd_arena_printf(arena, "%s%s", place, from->warnings[i].pointer);
        shd_report_warning(report, at ? at : place, "%s", from->warnings[i].detail);
    }
    if (from->status != SHD_OK && report->status == SHD_OK)
        shd_report_error(report, from->status, place, "it was not read");
}

shd_pair *shd_pair_new(shd_request *request) {
    request->pair = shd_arena_zalloc(request->rendering.arena, 1, sizeof *request->pair);
    if (!request->pair)
        shd_report_error(&request->report, SHD_MEMORY, "", "the limit `memory` is reached");
    return request->pair;
}

shd_status shd_pair_new_side(shd_request *request, const char *place, unsigned share,
                             shd_request **side) {
    const size_t used = shd_arena_used(request->rendering.arena);
    const uint64_t most = request->limits.memory;
    shd_error error;
    const shd_status status = shd_request_new(request->rendering.engine, side, &error);
    if (status != SHD_OK) {
        shd_report_error(&request->report, status, place, "%s", error.text);
        return status;
    }
    (*side)->rendering.cancelled = request->rendering.cancelled;
    shd_request_hold(*side, used < most ? (most - used) / share : 0);
    return SHD_OK;
}

/* Reads the side's scene, or opens the picture that is `name`d. */
static void fill_side(shd_request *side, const char *name, const shd_span *text) {
    shd_error error;
    if (!name) {
        shd_request_read(side, text->at, (size_t)(text->end - text->at), SHD_PNG);
        return;
    }
    const shd_status status = shd_side_open(side, name, &side->side, &error);
    if (status == SHD_OK) return;
    shd_report_error(&side->report, status, error.path, "%s", error.text);
    shd_report_limit(&side->report, error.limit);
}

static shd_status read_side(shd_request *request, int which, const shd_pair_texts *texts) {
    shd_request **side = &request->pair->sides[which];
    const shd_status status = shd_pair_new_side(request, places[which], 2, side);
    if (status != SHD_OK) return status;
    fill_side(*side, texts->names[which], &texts->sides[which]);
    shd_pair_take_report(request, places[which], &(*side)->report);
    return (*side)->report.status;
}

static void size_of(const shd_request *side, int size[2]) {
    size[0] = side->side ? side->side->width : side->scene->raster.w;
    size[1] = side->side ? side->side->height : side->scene->raster.h;
}

static void check_sizes(shd_request *request) {
    shd_pair *pair = request->pair;
    int a[2], b[2];
    size_of(pair->sides[0], a);
    size_of(pair->sides[1], b);
    if (a[0] != b[0] || a[1] != b[1]) {
        const char *place = pair->sides[1]->side ? "/b"
                            : a[0] != b[0]       ? "/b/image/width"
                                                 : "/b/image/height";
        shd_report_error(&request->report, SHD_SCENE, place,
                         "both pictures have one size: the other one has %d x %d pixels", a[0],
                         a[1]);
        return;
    }
    pair->work = (uint64_t)a[0] * (uint64_t)a[1] * COMPARING;
    for (int i = 0; i < 2; i++)
        if (!pair->sides[i]->side &&
            __builtin_add_overflow(pair->work, shd_request_work(pair->sides[i]), &pair->work))
            pair->work = UINT64_MAX;
}

static shd_status read_pair(shd_request *request, const char *json, size_t length) {
    shd_pair_texts texts;
    shd_report *report = &request->report;
    if (shd_pair_read(json, length, &request->limits, request->rendering.cancelled,
                      request->rendering.arena, &texts, report) != SHD_OK)
        return report->status;
    shd_pair *pair = shd_pair_new(request);
    if (!pair) return report->status;
    pair->density = texts.density;
    for (int i = 0; i < 2; i++) {
        const shd_status status = read_side(request, i, &texts);
        if (status != SHD_OK && status != SHD_SCENE && status != SHD_MISSING) return status;
    }
    if (report->status == SHD_OK) check_sizes(request);
    return report->status;
}

shd_status shd_request_read_pair(shd_request *request, const char *json, size_t length) {
    shd_stage_begin(&request->rendering);
    const shd_status status = read_pair(request, json, length);
    shd_stage_end(&request->rendering, &request->rendering.times.parse);
    return shd_request_blame_report(request, status);
}
