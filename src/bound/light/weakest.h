/* The lights that a budget leaves out of a patch of surface. */
#ifndef SHD_BOUND_LIGHT_WEAKEST_H
#define SHD_BOUND_LIGHT_WEAKEST_H

#include "plan/plan.h"

/* Of `lights` (indices in plan->lights, ascending, as shd_plan_cull has left them of the patch of
 * an object's surface) the weakest go, as long as all of them together add no more than
 * `tolerance`, and plan->drop_relative times what is seen there, in any channel. Returns how many
 * stay. With tolerance 0 none goes; with more, a picture does not depend on how it is cut only
 * where patches do not. Some 100 ns a light. */
size_t shd_drop_weakest(const shd_plan *plan, size_t object, const shd_patch *patch,
                        double tolerance, uint32_t *lights, size_t count);

#endif
