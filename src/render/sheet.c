/* A sheet is read: all of its variants are, and what their picture will take is known. */
#include "render/sheet.h"

#include <math.h>
#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <stdlib.h>
#include <string.h>

#include "image/pack.h"
#include "render/sheet_label.h"
#include "render/tell/estimate.h"
#include "scene/variants.h"

/* What is found while variants are read. */
typedef struct reading {
    shd_request *request;
    shd_contact_sheet *sheet;
    struct sha256_ctx hash;
    uint64_t samples, light_samples, needs; /* sums, and the most of a single one */
} reading;

/* ---- Variants ---- */

shd_status shd_sheet_cell(shd_request *request, size_t index, shd_request **out, shd_error *error) {
    const size_t used = shd_arena_used(request->rendering.arena);
    const uint64_t most = request->limits.memory;
    char *text;
    size_t length;
    shd_request *cell = NULL;
    /* Before each of many, others take their turn. */
    request->rendering.beside -= shd_pool_lend(request->rendering.engine->pool);
    shd_status status = shd_request_new(request->rendering.engine, &cell, error);
    if (status != SHD_OK) return status;
    cell->rendering.cancelled = request->rendering.cancelled;
    shd_request_hold(cell, used < most ? most - used : 0);
    status = shd_variants_document(request->batch, index, request->rendering.cancelled, &text,
                                   &length, error);
    if (status != SHD_OK) {
        shd_request_drop(cell);
        return status;
    }
    shd_request_read(cell, text, length, request->sheet->fallback);
    free(text);
    *out = cell;
    return SHD_OK;
}

/* Says of a variant what is wrong at a place of its document. */
static void blame_variant(const reading *a, size_t index, shd_status status, const char *pointer,
                          const char *detail) {
    shd_report *report = &a->request->report;
    char *place = shd_variants_place(a->request->batch, index, pointer);
    for (size_t i = 0; place && i < shd_report_errors_kept(report); i++) {
        if (strcmp(report->errors[i].pointer, place) || strcmp(report->errors[i].detail, detail))
            continue; /* what is wrong with the scene is so with all */
        free(place);
        return;
    }
    const bool named = place && !strncmp(place, "/variants/", strlen("/variants/")) && *pointer;
    shd_report_error(report, status, place ? place : "", "%s%s%s", named ? pointer : "",
                     named ? ": " : "", detail);
    free(place);
}

static void blame_report(const reading *a, size_t index, const shd_report *report) {
    for (size_t i = 0; i < shd_report_errors_kept(report); i++)
        blame_variant(a, index, report->status, report->errors[i].pointer,
                      report->errors[i].detail);
    if (report->status == SHD_LIMIT || report->status == SHD_MEMORY)
        shd_report_limit(&a->request->report, report->limit);
}

/* What all cells have is the first one's. */
static void take_first(shd_contact_sheet *sheet, const shd_scene *scene) {
    const shd_output *output = scene->outputs;
    sheet->cell_width = scene->raster.w;
    sheet->cell_height = scene->raster.h;
    sheet->format = output->format;
    sheet->depth = output->depth;
    sheet->channel = output->channel;
}

/* Color, a channel of it, or alpha: they have different samples. */
static int find_kind(int channel) {
    return channel < 0 ? -1 : channel == 3;
}

static bool check_cell(const reading *a, size_t index, const shd_scene *scene) {
    static const char size[] = "all pictures of a sheet have the size of the first one";
    const shd_contact_sheet *sheet = a->sheet;
    const shd_output *output = scene->outputs;
    const char *pointer = NULL, *detail = NULL;
    if (scene->multipart) {
        pointer = "/outputs";
        detail = "a variant has one picture: give one `output` instead";
    } else if (output->depth != SHD_U8 && output->depth != SHD_U16) {
        pointer = "/output";
        detail = "a sheet has samples of 8 or 16 bits: it is png, jpeg, webp or tiff";
    } else if (shd_is_shared(&scene->accuracy)) {
        pointer = "/accuracy/maxError";
        detail =
            "what a sheet or a turntable loses in JPEG or WebP is not measured: a budget wants "
            "another format";
    } else if (scene->raster.w != sheet->cell_width || scene->raster.h != sheet->cell_height) {
        pointer = scene->raster.w != sheet->cell_width ? "/image/width" : "/image/height";
        detail = size;
    } else if (output->format != sheet->format) {
        pointer = "/output/format";
        detail = "all pictures of a sheet have the format of the first one";
    } else if (output->depth != sheet->depth) {
        pointer = "/output/bitDepth";
        detail = "all pictures of a sheet have the depth of the first one";
    } else if (find_kind(output->channel) != find_kind(sheet->channel)) {
        pointer = "/output/channel";
        detail = "all pictures of a sheet are of color, of one channel, or of alpha";
    }
    if (pointer) blame_variant(a, index, SHD_SCENE, pointer, detail);
    return !pointer;
}

static void add_saturated(uint64_t *sum, uint64_t value) {
    if (__builtin_add_overflow(*sum, value, sum)) *sum = UINT64_MAX;
}

static void add_cell(reading *a, size_t index, const shd_request *cell) {
    const shd_scene *scene = cell->scene;
    shd_contact_sheet *sheet = a->sheet;
    if (!index) take_first(sheet, scene);
    if (!check_cell(a, index, scene)) return;
    const uint64_t needs = shd_estimate_memory(scene);
    sheet->alpha = sheet->alpha || (scene->transparent && !scene->outputs->scope &&
                                    shd_format_get(sheet->format)->alpha);
    a->needs = needs > a->needs ? needs : a->needs;
    add_saturated(&sheet->work, shd_estimate_work(scene));
    add_saturated(&a->samples, (uint64_t)scene->raster.w * (uint64_t)scene->raster.h *
                                   (uint64_t)scene->raster.samples);
    add_saturated(&a->light_samples, shd_estimate_light_samples(scene));
    sha256_update(&a->hash, strlen(cell->etag), (const uint8_t *)cell->etag);
    for (size_t i = 0; !index && i < shd_report_warnings_kept(&cell->report); i++)
        shd_report_warning(&a->request->report, cell->report.warnings[i].pointer, "%s",
                           cell->report.warnings[i].detail);
}

/* False: the others are not looked at, as nothing is known of them, or nobody wants it. */
static bool read_cell(reading *a, size_t index) {
    shd_request *cell;
    shd_error error;
    const shd_status status = shd_sheet_cell(a->request, index, &cell, &error);
    if (status != SHD_OK) {
        blame_variant(a, index, status, "", error.text);
        return status == SHD_SCENE;
    }
    const shd_status found = cell->report.status;
    if (found == SHD_OK)
        add_cell(a, index, cell);
    else
        blame_report(a, index, &cell->report);
    shd_request_drop(cell);
    return found == SHD_OK || found == SHD_SCENE;
}

/* ---- The whole ---- */

enum { LEAST_GAP = 4, MOST_GAP = 16, LEAST_TEXT = 10, MOST_TEXT = 16 };

static int hold(int value, int least, int most) {
    return value < least ? least : value > most ? most : value;
}

/* Labels are all as high as the one with most lines. False: memory. */
static bool measure_labels(reading *a) {
    shd_contact_sheet *sheet = a->sheet;
    size_t most = 0;
    sheet->label_size = hold(8 + sheet->cell_width / 40, LEAST_TEXT, MOST_TEXT);
    for (size_t i = 0; i < sheet->count; i++) {
        char lines[SHD_LABEL_LINES][SHD_LABEL_SIZE];
        char *text = shd_variants_label(a->request->batch, i);
        if (!text) return false;
        const size_t count = shd_label_break(text, sheet->label_size, sheet->cell_width, lines);
        most = count > most ? count : most;
        sha256_update(&a->hash, strlen(text) + 1, (const uint8_t *)text);
        free(text);
    }
    if (most)
        sheet->label_height = (int)ceil(sheet->label_size * (SHD_LABEL_LEAD * (double)most + 0.4));
    return true;
}

static void lay_out(shd_contact_sheet *sheet, int columns) {
    const int w = sheet->cell_width, h = sheet->cell_height;
    if (!columns) {
        columns = (int)ceil(sqrt((double)sheet->count * h / w) - 1e-9);
        columns = hold(columns, 1, (int)sheet->count);
    }
    sheet->columns = (size_t)columns;
    sheet->rows = (sheet->count + sheet->columns - 1) / sheet->columns;
    sheet->gap = hold((w < h ? w : h) / 20, LEAST_GAP, MOST_GAP);
    sheet->width = sheet->gap + columns * (w + sheet->gap);
    sheet->height = sheet->gap + (int)sheet->rows * (h + sheet->label_height + sheet->gap);
}

static void check_limit(shd_report *report, const char *place, const char *what, uint64_t value,
                        shd_limit limit, uint64_t most) {
    if (value <= most) return;
    shd_report_error(report, SHD_LIMIT, place, "%s %llu; the limit `%s` is %llu", what,
                     (unsigned long long)value, shd_limit_names[limit], (unsigned long long)most);
    shd_report_limit(report, limit);
}

/* Frames are counted as if they were one picture. */
static void check_limits(const reading *a, uint64_t pixels) {
    shd_report *report = &a->request->report;
    const shd_limits *limits = &a->request->limits;
    const char *place = a->sheet->turns ? "/turntable" : "/sheet";
    check_limit(report, place, "its pixels are", pixels, SHD_LIMIT_PIXELS, limits->pixels);
    check_limit(report, place, "the samples of its pictures are", a->samples, SHD_LIMIT_SAMPLES,
                limits->samples);
    check_limit(report, place, "samples times lights times terms of its pictures are",
                a->light_samples, SHD_LIMIT_LIGHT_SAMPLES, limits->light_samples);
    check_limit(report, place, "the bytes that it and its pictures take at least are",
                a->sheet->needs, SHD_LIMIT_MEMORY, limits->memory);
}

static void check_grid(reading *a) {
    shd_contact_sheet *sheet = a->sheet;
    const shd_format_info *format = shd_format_get(sheet->format);
    const uint64_t pixels = (uint64_t)sheet->width * (uint64_t)sheet->height;
    if (sheet->width > format->side || sheet->height > format->side) {
        shd_report_error(&a->request->report, SHD_SCENE, "/sheet",
                         "a %s picture is at most %d pixels wide and high, not %d x %d",
                         format->name, format->side, sheet->width, sheet->height);
        return;
    }
    const shd_image image = shd_sheet_image(sheet);
    const uint64_t scratch = shd_image_scratch(&image, sheet->format, true);
    const shd_pack pack = shd_pack_of(&image, sheet->format);
    sheet->needs = pixels * (uint64_t)pack.count * pack.bytes;
    add_saturated(&sheet->needs, scratch > a->needs ? scratch : a->needs);
    check_limits(a, pixels);
}

static void check_frames(reading *a) {
    a->sheet->needs = a->needs;
    check_limits(a, (uint64_t)a->sheet->cell_width * (uint64_t)a->sheet->cell_height *
                        a->sheet->count);
}

shd_image shd_sheet_image(const shd_contact_sheet *sheet) {
    return (shd_image){.width = sheet->width,
                       .height = sheet->height,
                       .channel = sheet->channel,
                       .alpha = sheet->alpha,
                       .depth = sheet->depth,
                       .quality = 100,
                       .slots = 1};
}

static void make_etag(reading *a, int shape_given) {
    uint8_t bytes[(sizeof a->request->etag - 1) / 2];
    const uint32_t shape[] = {(uint32_t)shape_given, (uint32_t)a->sheet->columns,
                              (uint32_t)a->sheet->label_height};
    sha256_update(&a->hash, sizeof shape, (const uint8_t *)shape);
    sha256_digest(&a->hash, sizeof bytes, bytes);
    base16_encode_update(a->request->etag, sizeof bytes, bytes);
}

static void read_grid(reading *a) {
    const shd_sheet_wish wish = shd_variants_sheet(a->request->batch);
    shd_report *report = &a->request->report;
    if (wish.labels && !measure_labels(a)) {
        shd_report_error(report, SHD_EXHAUSTED, "", "out of memory");
        return;
    }
    lay_out(a->sheet, wish.columns);
    check_grid(a);
    make_etag(a, wish.columns);
}

static shd_status read_all(shd_request *request, shd_format fallback) {
    static const char *const kinds[] = {"sheet 1", "turntable 1"};
    const shd_turn turn = shd_variants_turn(request->batch);
    shd_report *report = &request->report;
    shd_contact_sheet *sheet = shd_arena_zalloc(request->rendering.arena, 1, sizeof *sheet);
    if (!sheet) {
        shd_report_error(report, SHD_MEMORY, "", "the limit `memory` is reached");
        return report->status;
    }
    request->sheet = sheet;
    sheet->count = shd_variants_count(request->batch);
    sheet->turns = turn.frames;
    sheet->fallback = fallback;
    reading a = {.request = request, .sheet = sheet};
    sha256_init(&a.hash);
    sha256_update(&a.hash, strlen(kinds[sheet->turns]), (const uint8_t *)kinds[sheet->turns]);
    for (size_t i = 0; i < sheet->count && read_cell(&a, i); i++) continue;
    if (report->status != SHD_OK) return report->status;
    if (sheet->turns) {
        check_frames(&a);
        make_etag(&a, turn.milliseconds);
    } else {
        read_grid(&a);
    }
    return report->status;
}

shd_status shd_request_read_one(shd_request *request, shd_batch *batch, shd_format fallback) {
    request->batch = batch;
    shd_stage_begin(&request->rendering);
    const shd_status status = read_all(request, fallback);
    shd_stage_end(&request->rendering, &request->rendering.times.parse);
    return shd_request_blame_report(request, status);
}
