/* Lights of a run of hits that are far enough to be lit as one (shade/far.h). */
#pragma once

#include "shade/far.h"

/* Takes lights out of `lights` ([count], ascending indices in plan->lights) whose diffuse light is
 * told by `out`, and whose highlights are too faint to count, as long as what that leaves out of
 * the material's color at the patch is within most of *room, in any channel, and takes it from
 * *room. `points`: of the patch. `costs`: room for [count]. Returns how many stay; if all do,
 * out->lights is 0. What is taken depends on the patch alone. */
size_t shd_far_gather(const shd_plan *plan, const shd_plan_material *material,
                      const shd_patch *patch, size_t points, double *room, uint32_t *lights,
                      size_t count, double *costs, shd_far *out);
