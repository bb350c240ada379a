/* A scene's plan, from its draft to what is chosen. */
#pragma once

#include "bound/bound.h"
#include "render/rendering.h"

/* Plans for kernels of the instruction set `isa`, and for the outputs `shown`
 * ([scene->output_count], or NULL: see shd_choose). SHD_SCENE: nothing meets the budget.
 * SHD_MEMORY, or SHD_CANCELLED if `cancelled` (or NULL) is raised. */
shd_status shd_plan_make(const shd_scene *scene, shd_isa isa, const shd_shown *shown,
                         const atomic_bool *cancelled, shd_arena *arena, const shd_plan **out,
                         shd_error *error);

/* The scene's plan, for its outputs: sets r->plan. */
shd_status shd_rendering_plan(shd_rendering *r, const shd_scene *scene, shd_error *error);
