/* The lights that a budget leaves out of a patch of surface. */
#pragma once

#include "plan/plan.h"

/* Takes the weakest out of `lights`, as long as all of these together add no more, in any channel,
 * than `tolerance` and plan->drop_relative times what is seen. Returns how many stay: all if
 * `tolerance` is 0. `lights` are ascending indices in plan->lights, which shd_plan_cull has left of
 * the patch of an object's surface. This takes some 100 ns a light. */
size_t shd_drop_weakest(const shd_plan *plan, size_t object, const shd_patch *patch,
                        double tolerance, uint32_t *lights, size_t count);
