/* A scene's plan, from its draft to what is chosen. */
#pragma once

#include "bound/bound.h"
#include "render/rendering.h"

/* Plans without tables of microgeometry (shade/westin.h), for kernels of the instruction set `isa`,
 * and for the outputs `shown`
 * ([scene->output_count], or NULL: see shd_choose). SHD_SCENE: nothing meets the budget.
 * SHD_MEMORY, or SHD_CANCELLED if `cancelled` (or NULL) is raised. */
shd_status shd_plan_make(const shd_scene *scene, shd_isa isa, const shd_shown *shown,
                         const atomic_bool *cancelled, shd_arena *arena, const shd_plan **out,
                         shd_error *error);

/* Simulates what microgeometry the scene has, and plans with that for the engine's kernels.
 * *drafted is the draft of an earlier plan of the same scene, which differs by its accuracy alone,
 * or NULL, for which it is set; `drafted` may be NULL. */
shd_status shd_rendering_plan_for(shd_rendering *r, const shd_scene *scene, const shd_shown *shown,
                                  const shd_plan **drafted, const shd_plan **out, shd_error *error);

/* The scene's plan, for its outputs: sets r->plan. If no plan meets the part of a budget that lossy
 * formats leave, it is the exact tier's, which may then have all of it. */
shd_status shd_rendering_plan(shd_rendering *r, const shd_scene *scene, shd_error *error);

/* The same scene, whose whole budget is to be met by the exact tier alone. SHD_MEMORY. */
shd_status shd_scene_exactly(const shd_scene *scene, shd_arena *arena, const shd_scene **out,
                             shd_error *error);
