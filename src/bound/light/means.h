/* How far light at the center of a pixel is from its mean over the pixel's samples. */
#pragma once

#include "plan/bend.h"
#include "plan/plan.h"

/* Whether light on the object of `bend`, at the center of any pixel of the block, is within `room`
 * of its mean over samples of such a spread, in each channel. The plan is not
 * extended and the material has no pattern. It takes some 100 ns a light. Any thread. The proof is
 * in means.c. */
bool shd_mean_is_central(const shd_plan *plan, const shd_bend *bend,
                         const shd_pattern_spread *spread, const shd_mean_room *room);
