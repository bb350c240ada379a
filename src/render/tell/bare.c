#include "render/tell/bare.h"

#include "render/planning.h"
#include "render/request.h"

/* The scene without the layers of its outputs, of which nothing is told. */
static const shd_scene *without_layers(const shd_scene *given, shd_arena *arena) {
    shd_scene *scene = shd_arena_alloc(arena, 1, sizeof *scene);
    shd_output *outputs = shd_arena_alloc(arena, given->output_count, sizeof *outputs);
    if (!scene || !outputs) return NULL;
    *scene = *given;
    for (size_t i = 0; i < given->output_count; i++) {
        outputs[i] = given->outputs[i];
        outputs[i].layer_count = 0;
    }
    scene->outputs = outputs;
    return scene;
}

shd_status shd_bare_render(shd_rendering *r, const shd_scene *given,
                           const shd_render_options *options, shd_film *film, shd_error *error) {
    const shd_scene *scene = without_layers(given, r->arena);
    if (!scene) return shd_rendering_full(r, "picture", error);
    shd_stage_begin(r);
    shd_status status = shd_rendering_plan(r, scene, error);
    if (status == SHD_OK) status = shd_rendering_admit(r, NULL, true, error);
    shd_stage_end(r, &r->times.plan);
    shd_sight *sight;
    if (status == SHD_OK) status = shd_sight_new(r->plan, r->cancelled, r->arena, &sight, error);
    shd_stage_end(r, &r->times.visibility);
    if (status == SHD_OK) status = shd_film_render(r, sight, NULL, options, film, error);
    return status;
}
