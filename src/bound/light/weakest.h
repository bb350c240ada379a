/* The lights that a budget leaves out of a patch of surface. */
#pragma once

#include "base/bits.h"
#include "plan/plan.h"

/* What may be left out of each channel of a patch of an object's surface: `tolerance`, and
 * plan->drop_relative times the least that is seen of it by these lights; 0 if `tolerance` is 0.
 * `lights` are ascending indices in plan->lights, which shd_plan_cull has left of the patch. */
double shd_patch_room(const shd_plan *plan, size_t object, const shd_patch *patch, double tolerance,
                      const uint32_t *lights, size_t count);

/* Takes the weakest out of `lights`, as long as all of these together add no more, in any channel,
 * than `room`. Returns how many stay: all if it is 0. This takes some 100 ns a light. */
size_t shd_drop_weakest(const shd_plan *plan, size_t object, const shd_patch *patch, double room,
                        uint32_t *lights, size_t count);

enum { SHD_STRENGTH_STEPS = 64 };

/* Which of so many powers of two a share of the room is in, 0 the least; SHD_STRENGTH_STEPS: it is
 * more than all of it, or not a number. One pass sorts lights well enough by it. */
static inline int shd_strength_step(double most, double room) {
    if (!(most <= room)) return SHD_STRENGTH_STEPS;
    /* Shares in (1/2, 1) have the exponent 1022, and 0 has 0. */
    const int exponent = (int)(shd_bits64_of(most / room) >> 52) - 1022;
    if (exponent > 1) return SHD_STRENGTH_STEPS; /* both are infinite */
    return exponent < 2 - SHD_STRENGTH_STEPS ? 0 : exponent + SHD_STRENGTH_STEPS - 2;
}
