#include "render/planning.h"

#include <string.h>

#include "render/glow_tables.h"
#include "render/show/shown.h"
#include "render/westin_tables.h"

/* Tells a draft of the tables that its materials have. False: memory. */
static bool add_tables(const shd_westin *const *tables, shd_arena *arena, const shd_plan **draft) {
    const size_t count = (*draft)->scene->material_count, all = shd_all_materials(*draft);
    if (!tables) return true;
    shd_plan *plan = shd_arena_alloc(arena, 1, sizeof *plan);
    shd_plan_material *materials = shd_arena_alloc(arena, all, sizeof *materials);
    if (!plan || !materials) return false;
    *plan = **draft;
    memcpy(materials, plan->materials, all * sizeof *materials);
    for (size_t m = 0; m < count; m++)
        if (tables[m]) materials[m].table = &tables[m]->limits;
    plan->materials = materials;
    plan->westin = tables;
    *draft = plan;
    return true;
}

/* Tells a draft of the tables of its environments. `r` is NULL where nobody keeps any. */
static shd_status add_glows(shd_rendering *r, shd_arena *arena, const shd_plan **draft,
                            shd_error *error) {
    const shd_glow *glows = NULL;
    if (!r) return SHD_OK;
    const struct shd_moments *const *moments;
    shd_status status = shd_rendering_glows(r, *draft, &glows, error);
    if (status == SHD_OK) status = shd_rendering_moments(r, *draft, &moments, error);
    if (status != SHD_OK || (!glows && !moments)) return status;
    shd_plan *plan = shd_arena_alloc(arena, 1, sizeof *plan);
    if (!plan) return SHD_MEMORY;
    *plan = **draft;
    plan->glows = glows;
    plan->moments = moments;
    *draft = plan;
    return SHD_OK;
}

/* A draft of the scene: the one of the same scene with another accuracy, if there is one. */
static bool make_draft(const shd_scene *scene, shd_isa isa, const atomic_bool *cancelled,
                       shd_arena *arena, const shd_plan **drafted, const shd_plan **out) {
    if (!drafted || !*drafted) {
        const bool made = shd_plan_draft(scene, isa, false, cancelled, arena, out);
        if (made && drafted) *drafted = *out;
        return made;
    }
    shd_plan *plan = shd_arena_alloc(arena, 1, sizeof *plan);
    if (!plan) return false;
    *plan = **drafted;
    plan->scene = scene;
    *out = plan;
    return true;
}

static shd_status make_plan(shd_rendering *r, const shd_scene *scene, shd_isa isa,
                            const shd_shown *shown, const shd_westin *const *tables,
                            const atomic_bool *cancelled, shd_arena *arena,
                            const shd_plan **drafted, const shd_plan **out, shd_error *error) {
    const shd_plan *draft;
    shd_choice choice;
    shd_status status = SHD_MEMORY;
    if (make_draft(scene, isa, cancelled, arena, drafted, &draft) &&
        add_tables(tables, arena, &draft))
        status = add_glows(r, arena, &draft, error);
    if (status == SHD_OK)
        status = shd_choose(draft, shown, shd_plan_kernel_costs(draft), arena, &choice, error);
    if (status == SHD_OK && !shd_plan_finish(&choice, arena, out)) status = SHD_MEMORY;
    /* Parts that are cancelled say that there is no memory. */
    if (status != SHD_OK && shd_is_cancelled(cancelled))
        return shd_fail(error, SHD_CANCELLED, "", "the planning was cancelled");
    if (status == SHD_MEMORY)
        shd_fail(error, SHD_MEMORY, "", "the limit `memory` is too small for this scene's plan");
    return status;
}

shd_status shd_plan_make(const shd_scene *scene, shd_isa isa, const shd_shown *shown,
                         const atomic_bool *cancelled, shd_arena *arena, const shd_plan **out,
                         shd_error *error) {
    return make_plan(NULL, scene, isa, shown, NULL, cancelled, arena, NULL, out, error);
}

shd_status shd_rendering_plan_for(shd_rendering *r, const shd_scene *scene, const shd_shown *shown,
                                  const shd_plan **drafted, const shd_plan **out,
                                  shd_error *error) {
    const shd_westin *const *tables;
    const shd_status status = shd_rendering_simulate(r, scene, &tables, error);
    if (status != SHD_OK) return status;
    return make_plan(r, scene, r->engine->isa, shown, tables, r->cancelled, r->arena, drafted, out,
                     error);
}

shd_status shd_scene_exactly(const shd_scene *scene, shd_arena *arena, const shd_scene **out,
                             shd_error *error) {
    shd_scene *exactly = shd_arena_alloc(arena, 1, sizeof *exactly);
    if (!exactly) return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached");
    *exactly = *scene;
    exactly->accuracy.exactly = true;
    exactly->accuracy.max_error = exactly->accuracy.whole;
    *out = exactly;
    return SHD_OK;
}

shd_status shd_rendering_plan(shd_rendering *r, const shd_scene *scene, shd_error *error) {
    const shd_shown *shown = NULL;
    const shd_plan *drafted = NULL;
    shd_status status = shd_shown_make(r, scene, &shown, error);
    if (status != SHD_OK) return status;
    status = shd_rendering_plan_for(r, scene, shown, &drafted, &r->plan, error);
    /* The exact tier leaves more to a lossy format than a part of the budget would. */
    if (status == SHD_SCENE && shd_is_shared(&scene->accuracy)) {
        status = shd_scene_exactly(scene, r->arena, &scene, error);
        if (status == SHD_OK)
            status = shd_rendering_plan_for(r, scene, shown, &drafted, &r->plan, error);
    }
    return status;
}
