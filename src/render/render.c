/* The story: a scene becomes pictures. */
#include <stdlib.h>

#include "render/planning.h"
#include "render/request.h"
#include "render/sheet.h"
#include "render/show/output.h"
#include "render/tiles/keep.h"

static shd_status render_film(shd_request *request, const shd_scene *scene,
                              const shd_render_options *options, shd_film *film, shd_error *error) {
    shd_rendering *r = &request->rendering;
    shd_status status = shd_request_prepare_formats(request, error);
    if (status != SHD_OK) return status;

    /* What does this scene need? */
    shd_stage_begin(r);
    status = shd_rendering_plan(r, scene, error);
    if (status != SHD_OK) return status;
    shd_stage_end(r, &r->times.plan);

    /* What is known of it, and what is there to be seen? */
    shd_recall recall = shd_recall_open(r->engine->reuse, r->plan);
    request->reused = recall.light      ? SHD_REUSED_LIGHT
                      : recall.geometry ? SHD_REUSED_GEOMETRY
                                        : SHD_REUSED_NOTHING;
    shd_sight *sight = NULL;
    status = shd_output_prepare(r, film, error);
    if (status == SHD_OK) status = shd_rendering_admit(r, film, !recall.light, error);
    shd_stage_end(r, &r->times.visibility);
    if (status == SHD_OK && !recall.light)
        status = shd_sight_new(r->plan, r->cancelled, r->arena, &sight, error);
    const bool built = sight && shd_sight_has_built(sight);
    shd_stage_end(r, built ? &r->times.build : &r->times.visibility);

    /* What is seen, and how is it lit? */
    if (status == SHD_OK) status = shd_film_render(r, sight, &recall, options, film, error);
    shd_recall_close(&recall, status == SHD_OK);
    return status;
}

static shd_status render_scene(shd_request *request, const shd_scene *scene,
                               const shd_render_options *options, shd_error *error) {
    shd_rendering *r = &request->rendering;
    shd_film film = {0};
    shd_status status = render_film(request, scene, options, &film, error);
    if (status != SHD_OK) return status;

    /* How is it shown? */
    request->pictures = shd_arena_zalloc(r->arena, scene->output_count, sizeof *request->pictures);
    if (!request->pictures)
        return shd_fail(error, SHD_MEMORY, "/outputs", "the limit `memory` is reached");
    request->picture_count = scene->output_count;
    for (size_t i = 0; i < scene->output_count; i++) {
        status = shd_output_make(r, &film, i, &request->pictures[i], error);
        if (status != SHD_OK) return status;
        if (shd_is_cancelled(r->cancelled)) return shd_rendering_cancelled(error);
    }
    return SHD_OK;
}

/* A variant's pixels, for a picture of several. */
static shd_status render_cell(shd_request *cell, const shd_render_options *options, shd_image *out,
                              shd_error *error) {
    shd_film film = {0};
    const shd_status status = render_film(cell, cell->scene, options, &film, error);
    return status == SHD_OK ? shd_output_paint(&cell->rendering, &film, 0, out, error) : status;
}

/* Whether the exact tier might meet the budget where this did not: a lossy format takes more of it
 * than light has left. */
static bool exact_may_meet(const shd_rendering *r, const shd_scene *scene) {
    const shd_plan *plan = r->plan;
    return shd_is_shared(&scene->accuracy) && plan && !plan->scene->accuracy.exactly &&
           (plan->tier != SHD_EXACT || plan->point_off > 0);
}

/* As if nothing had been rendered, but for the time that it took. */
static void begin_again(shd_request *request) {
    shd_rendering *r = &request->rendering;
    for (size_t i = 0; i < request->picture_count; i++) {
        shd_arena_repay(r->arena, request->pictures[i].size);
        free(request->pictures[i].data);
    }
    request->picture_count = 0;
    r->saturated = r->clipped = r->rays = r->ray_edges = 0;
    r->cut = r->ray_error = 0;
    r->codec = NULL;
}

static shd_status render_within(shd_request *request, const shd_render_options *options,
                                shd_error *error) {
    shd_rendering *r = &request->rendering;
    const shd_scene *scene = request->scene, *exactly;
    const shd_arena_mark mark = shd_arena_mark_here(r->arena);
    shd_status status = render_scene(request, scene, options, error);
    if (status != SHD_SCENE || !exact_may_meet(r, scene)) return status;
    begin_again(request);
    shd_arena_return(r->arena, mark);
    status = shd_scene_exactly(scene, r->arena, &exactly, error);
    return status == SHD_OK ? render_scene(request, exactly, options, error) : status;
}

shd_status shd_request_render(shd_request *request, const shd_render_options *options,
                              shd_error *error) {
    shd_status status;
    if (!request->sheet)
        status = render_within(request, options, error);
    else if (request->sheet->turns)
        status = shd_turn_render(request, options, render_cell, error);
    else
        status = shd_sheet_render(request, options, render_cell, error);
    return shd_request_blame(request, status, error);
}
