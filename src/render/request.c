/* A request's life: read, render, give pictures. */
#include <assert.h>
#include <nettle/base16.h>
#include <nettle/sha2.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "plan/cost.h"
#include "render/maps.h"
#include "render/pair.h"
#include "render/pictures.h"
#include "render/request.h"
#include "render/sheet.h"
#include "render/show/output.h"
#include "render/tell/estimate.h"
#include "render/tiles/fragments.h"
#include "render/westin_tables.h"
#include "scene/variants.h"
#include "shade/glow_needs.h"

shd_status shd_request_new(shd_engine *engine, shd_request **out, shd_error *error) {
    shd_request *request = calloc(1, sizeof *request);
    shd_limits limits = engine->limits;
    const uint64_t most = shd_budget_most(engine->budget);
    if (most < limits.memory) limits.memory = most;
    shd_arena *arena = shd_arena_new_from(engine->spares, limits.memory);
    if (!request || !arena) {
        free(request);
        shd_arena_drop(arena);
        return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    }
    request->limits = limits;
    request->rendering = (shd_rendering){.engine = engine,
                                         .arena = arena,
                                         .limits = &request->limits,
                                         .cancelled = &request->cancelled,
                                         .lease = &request->lease,
                                         .tables = &request->tables};
    shd_report_init(&request->report, arena);
    *out = request;
    return SHD_OK;
}

void shd_request_hold(shd_request *request, uint64_t bytes) {
    if (bytes >= request->limits.memory) return;
    request->limits.memory = bytes;
    shd_arena_hold(request->rendering.arena, bytes);
}

void shd_request_drop(shd_request *request) {
    if (!request) return;
    for (size_t i = 0; i < request->picture_count; i++) free(request->pictures[i].data);
    for (const shd_held_mesh *m = request->held; m; m = m->next) shd_stored_drop(m->stored);
    for (int i = 0; request->pair && i < 2; i++) shd_request_drop(request->pair->sides[i]);
    shd_request_drop_pictures(request);
    shd_request_drop_maps(request);
    shd_held_tables_drop(request->tables);
    shd_arena_drop(request->rendering.arena);
    shd_color_lease_drop(request->lease);
    shd_variants_drop(request->batch);
    free(request);
}

static const char crowded_text[] =
    "other requests have the memory just now: the limit `memory` leaves too little";

shd_status shd_request_blame(const shd_request *request, shd_status status, shd_error *error) {
    if (status != SHD_MEMORY || request->full || shd_arena_full(request->rendering.arena))
        return status;
    if (request->crowded || shd_arena_crowded(request->rendering.arena))
        return shd_fail(error, SHD_CROWDED, "", "%s", crowded_text);
    return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
}

/* The report says nothing else any more. */
static shd_status report_only(shd_request *request, shd_status status, const char *text) {
    shd_report_init(&request->report, request->rendering.arena);
    shd_report_error(&request->report, status, "", "%s", text);
    return status;
}

shd_status shd_request_blame_report(shd_request *request, shd_status status) {
    shd_error error;
    const shd_status blamed = shd_request_blame(request, status, &error);
    return blamed == status ? status : report_only(request, blamed, error.text);
}

static void put_words(struct sha256_ctx *hash, const char *separator, const char *word) {
    sha256_update(hash, strlen(separator), (const uint8_t *)separator);
    sha256_update(hash, strlen(word), (const uint8_t *)word);
}

/* It depends on all that decides the bytes: the document, the negotiated formats, the color
 * configuration, the version; and the kernel, if its bits are its own or its cost may decide on the
 * tier. */
static void make_etag(shd_request *request) {
    const shd_scene *scene = request->scene;
    const shd_engine *engine = request->rendering.engine;
    struct sha256_ctx hash;
    uint8_t bytes[(sizeof request->etag - 1) / 2];
    sha256_init(&hash);
    put_words(&hash, "", scene->digest);
    put_words(&hash, " ", shd_color_config_digest(engine->color));
    put_words(&hash, " ", shd_version());
    if (scene->accuracy.budget || !shd_isa_fuses(engine->isa))
        put_words(&hash, " ", shd_isa_name(engine->isa));
    for (size_t o = 0; o < scene->output_count; o++)
        put_words(&hash, " ", shd_format_get(scene->outputs[o].format)->name);
    sha256_digest(&hash, sizeof bytes, bytes);
    base16_encode_update(request->etag, sizeof bytes, bytes);
}

bool shd_writes(shd_format format) {
    return shd_image_writes(format);
}

static shd_status fail_format(const shd_scene *scene, size_t output, shd_status status,
                              const char *why, shd_error *error) {
    char pointer[64];
    snprintf(pointer, 64, scene->multipart ? "/outputs/%zu/format" : "/output/format", output);
    return shd_fail(error, status, pointer, "no %s pictures are made here: %s",
                    shd_format_get(scene->outputs[output].format)->name, why);
}

static shd_status check_formats(shd_request *request) {
    const shd_scene *scene = request->scene;
    shd_error error;
    for (size_t o = 0; o < scene->output_count; o++) {
        if (shd_image_writes(scene->outputs[o].format)) continue;
        fail_format(scene, o, SHD_SCENE, "OpenImageIO is not installed", &error);
        shd_report_error(&request->report, error.status, error.path, "%s", error.text);
    }
    return request->report.status;
}

shd_status shd_request_prepare_formats(shd_request *request, shd_error *error) {
    const shd_scene *scene = request->scene;
    shd_error why;
    shd_stage_begin(&request->rendering);
    for (size_t o = 0; o < scene->output_count; o++) {
        const shd_status status =
            shd_image_prepare(scene->outputs[o].format, request->rendering.engine->budget,
                              request->rendering.cancelled, &why);
        if (status != SHD_OK) return fail_format(scene, o, status, why.text, error);
    }
    shd_stage_end(&request->rendering, &request->rendering.times.encode);
    return SHD_OK;
}

/* What the pictures take is known once the whole scene is. */
static shd_status check_memory(shd_request *request) {
    const uint64_t limit = request->limits.memory;
    uint64_t needed = shd_arena_used(request->rendering.arena);
    for (const shd_held_mesh *m = request->held; m; m = m->next)
        needed += shd_stored_size(m->stored);
    needed += request->held_bytes;
    needed += shd_glow_needs_of(request->scene).bytes;
    if (__builtin_add_overflow(shd_estimate_memory(request->scene), needed, &needed))
        needed = UINT64_MAX;
    if (needed <= limit) return SHD_OK;
    shd_report_error(&request->report, SHD_LIMIT, "/image",
                     "the pictures%s%s take at least %llu bytes; the limit `memory` is %llu",
                     request->held_pictures ? ", the kept meshes and the assets"
                     : request->held        ? " and the kept meshes"
                                            : "",
                     shd_glow_needs_of(request->scene).bytes ? " and the tables of environments"
                                                             : "",
                     (unsigned long long)needed, (unsigned long long)limit);
    shd_report_limit(&request->report, SHD_LIMIT_MEMORY);
    return SHD_LIMIT;
}

static void check_product(shd_report *report, const char *product, uint64_t value, shd_limit limit,
                          uint64_t most) {
    if (value <= most) return;
    shd_report_error(report, SHD_LIMIT, "/lights", "%s are %llu; the limit `%s` is %llu", product,
                     (unsigned long long)value, shd_limit_names[limit], (unsigned long long)most);
    shd_report_limit(report, limit);
}

/* Lists of lights multiply: by samples and by objects. */
static shd_status check_lights(shd_request *request) {
    check_product(&request->report, "samples times lights times terms of the material with most",
                  shd_estimate_light_samples(request->scene), SHD_LIMIT_LIGHT_SAMPLES,
                  request->limits.light_samples);
    check_product(&request->report, "objects times lights",
                  shd_estimate_object_lights(request->scene), SHD_LIMIT_OBJECT_LIGHTS,
                  request->limits.object_lights);
    return request->report.status;
}

double shd_rendering_seconds(const shd_rendering *r) {
    const shd_plan *plan = r->plan;
    const shd_raster *raster = &plan->scene->raster;
    const shd_ray_cost cost = shd_plan_ray_cost(plan, plan->tier, shd_plan_kernel_costs(plan));
    const double pixels = (double)raster->w * raster->h;
    return (pixels * (cost.rays + cost.light + cost.shadow + cost.trace) + cost.meshes) / 1e9;
}

static shd_status check_work(const shd_rendering *r, shd_error *error) {
    const shd_plan *plan = r->plan;
    const double pixels = (double)plan->scene->raster.w * plan->scene->raster.h,
                 most = shd_plan_most_cost(plan, plan->tier, shd_plan_kernel_costs(plan)),
                 work = (double)r->limits->work;
    if (pixels * most / 1e9 <= work) return SHD_OK;
    const double seconds = shd_rendering_seconds(r);
    if (seconds <= work) return SHD_OK;
    shd_fail(error, SHD_LIMIT, "",
             "it is expected to take %.0f seconds of one processor; the limit `work` is %llu",
             seconds, (unsigned long long)r->limits->work);
    return shd_fail_limit(error, SHD_LIMIT_WORK);
}

shd_status shd_rendering_admit(shd_rendering *r, const shd_film *film, bool lights,
                               shd_error *error) {
    const shd_plan *plan = r->plan;
    const size_t tiles = shd_tile_count(&plan->scene->raster);
    const unsigned hands = shd_pool_hands(r->engine->pool);
    const uint64_t threads = lights ? tiles < hands ? tiles : hands : 0;
    const uint64_t working = threads * shd_film_scratch_size(plan);
    const uint64_t room = shd_arena_room(r->arena);
    uint64_t pictures = 0;
    shd_status status = lights ? check_work(r, error) : SHD_OK;
    if (status == SHD_OK && film) status = shd_output_size(r, film, &pictures, error);
    if (status != SHD_OK) return status;
    if (!film || !film->codes)
        pictures += shd_film_size(&plan->scene->raster, plan->plane_count, plan->wants);
    if (pictures > room || working > room - pictures) {
        shd_fail(error, SHD_LIMIT, "/image",
                 "the pictures take at least %llu bytes, and rendering them on %llu threads %llu; "
                 "the limit `memory` is %llu",
                 (unsigned long long)pictures, (unsigned long long)threads,
                 (unsigned long long)working, (unsigned long long)r->limits->memory);
        return shd_fail_limit(error, SHD_LIMIT_MEMORY);
    }
    if (shd_arena_reserve(r->arena, pictures + working)) return SHD_OK;
    return shd_fail(error, SHD_CROWDED, "", "%s", crowded_text);
}

shd_status shd_request_read(shd_request *request, const char *json, size_t length,
                            shd_format fallback) {
    const shd_engine *engine = request->rendering.engine;
    const shd_shelf shelf = shd_shelf_of(request);
    shd_stage_begin(&request->rendering);
    shd_status status = shd_scene_read(json, length, &engine->catalog, &request->limits,
                                       request->rendering.cancelled, fallback, &shelf,
                                       request->rendering.arena, &request->scene, &request->report);
    if (status == SHD_MISSING && request->held_full) /* what is missing was not looked for */
        status = report_only(request, SHD_MEMORY, "the limit `memory` is reached");
    if (status == SHD_OK) status = check_formats(request);
    if (status == SHD_OK) status = check_lights(request);
    if (status == SHD_OK) status = check_memory(request);
    if (status == SHD_OK) make_etag(request);
    shd_stage_end(&request->rendering, &request->rendering.times.parse);
    return shd_request_blame_report(request, status);
}

const shd_report *shd_request_report(const shd_request *request) {
    return &request->report;
}

const char *shd_request_etag(const shd_request *request) {
    return request->etag;
}

uint64_t shd_request_work(const shd_request *request) {
    if (request->pair) return request->pair->work;
    return request->sheet ? request->sheet->work : shd_estimate_work(request->scene);
}

uint64_t shd_request_planning_work(const shd_request *request) {
    return request->scene ? shd_estimate_planning(request->scene) : 0;
}

uint64_t shd_request_needs(const shd_request *request) {
    return request->sheet ? request->sheet->needs : shd_estimate_memory(request->scene);
}

bool shd_request_multipart(const shd_request *request) {
    return request->scene && request->scene->multipart;
}

shd_format shd_request_format(const shd_request *request, size_t index) {
    return request->sheet ? request->sheet->format : request->scene->outputs[index].format;
}

void shd_request_cancel(shd_request *request) {
    atomic_store(&request->cancelled, true);
}

bool shd_request_is_cancelled(const shd_request *request) {
    return shd_is_cancelled(&request->cancelled);
}

const shd_picture *shd_request_pictures(const shd_request *request, size_t *count) {
    *count = request->picture_count;
    return request->pictures;
}

unsigned char *shd_request_take(shd_request *request, size_t index) {
    assert(index < request->picture_count);
    unsigned char *data = request->pictures[index].data;
    shd_arena_release(request->rendering.arena, request->pictures[index].size);
    request->pictures[index].data = NULL;
    request->pictures[index].size = 0;
    return data;
}

const shd_times *shd_request_times(const shd_request *request) {
    return &request->rendering.times;
}

const char *shd_request_plan(const shd_request *request) {
    if (request->sheet) return request->sheet->told;
    return request->rendering.plan ? request->rendering.plan->summary : "";
}

const char *shd_request_codec(const shd_request *request) {
    return request->rendering.codec;
}

size_t shd_request_memory(const shd_request *request) {
    size_t bytes = shd_arena_peak(request->rendering.arena);
    for (int i = 0; request->pair && i < 2; i++)
        if (request->pair->sides[i]) bytes += shd_request_memory(request->pair->sides[i]);
    return bytes;
}

bool shd_request_was_loose(const shd_request *request) {
    bool loose = atomic_load(&request->loose_decoder);
    for (int i = 0; request->pair && i < 2; i++)
        if (request->pair->sides[i]) loose |= shd_request_was_loose(request->pair->sides[i]);
    return loose;
}

uint64_t shd_request_saturated(const shd_request *request) {
    return request->rendering.saturated;
}

double shd_request_ray_error(const shd_request *request, uint64_t *edges) {
    *edges = request->rendering.ray_edges;
    return request->rendering.ray_error;
}

uint64_t shd_request_rays(const shd_request *request, double *cut) {
    *cut = request->rendering.cut;
    return request->rendering.rays;
}

uint64_t shd_request_clipped(const shd_request *request) {
    return request->rendering.clipped;
}

shd_reused shd_request_reused(const shd_request *request) {
    return request->reused;
}
