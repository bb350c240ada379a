/* What a plan costs, roughly: a simple model whose constants were measured once. */
#ifndef SHD_RENDER_TELL_COST_H
#define SHD_RENDER_TELL_COST_H

#include "plan/plan.h"

/* Milliseconds of one core. */
typedef struct shd_cost {
    double visibility, shade, color, encode, total;
} shd_cost;

/* `codes`: for each output, whether its colors go straight to codes. */
shd_cost shd_cost_of(const shd_plan *plan, const bool *codes);

#endif
