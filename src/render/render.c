/* The story: a scene becomes pictures. */
#include "base/clock.h"
#include "render/engine.h"
#include "render/show/output.h"
#include "render/show/shown.h"
#include "render/tiles/film.h"
#include "render/tiles/keep.h"

static shd_status render(shd_request *request, const shd_render_options *options,
                         shd_error *error) {
    const shd_scene *scene = request->scene;
    shd_arena *arena = request->arena;
    shd_status status = shd_request_prepare_formats(request, error);
    if (status != SHD_OK) return status;

    /* What does this scene need? */
    double began = shd_thread_seconds();
    status = shd_request_plan_make(request, scene, error);
    if (status != SHD_OK) return status;
    double planned = shd_thread_seconds();
    request->times.plan = planned - began;

    /* What is known of it, and what is there to be seen? */
    shd_recall recall = shd_recall_open(request->engine->reuse, request->plan);
    request->reused = recall.light      ? SHD_REUSED_LIGHT
                      : recall.geometry ? SHD_REUSED_GEOMETRY
                                        : SHD_REUSED_NOTHING;
    shd_film film = {0};
    shd_sight *sight = NULL;
    status = shd_output_prepare(request, &film, error);
    if (status == SHD_OK) status = shd_request_admit(request, &film, !recall.light, error);
    if (status == SHD_OK && !recall.light)
        status = shd_sight_new(request->plan, &request->cancelled, arena, &sight, error);
    request->times.visibility += shd_thread_seconds() - planned;

    /* What is seen, and how is it lit? */
    if (status == SHD_OK) status = shd_film_render(request, sight, &recall, options, &film, error);
    shd_recall_close(&recall, status == SHD_OK);
    if (status != SHD_OK) return status;

    /* How is it shown? */
    request->pictures = shd_arena_zalloc(arena, scene->output_count, sizeof *request->pictures);
    if (!request->pictures)
        return shd_fail(error, SHD_MEMORY, "/outputs", "the limit `memory` is reached");
    request->picture_count = scene->output_count;
    for (size_t i = 0; i < scene->output_count; i++) {
        status = shd_output_make(request, &film, i, error);
        if (status != SHD_OK) return status;
        if (atomic_load(&request->cancelled))
            return shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
    }
    return SHD_OK;
}

shd_status shd_request_render(shd_request *request, const shd_render_options *options,
                              shd_error *error) {
    return shd_request_blame(request, render(request, options, error), error);
}
