/* What is told of lights with a shape. */
#pragma once

#include "plan/plan.h"
#include "shade/area.h"

/* How light j of the plan, which has a shape, is summed at worst, over all objects that it reaches.
 * *off: as shd_area_choose has it. */
shd_area_method shd_lamp_method(const shd_plan *plan, uint32_t j, double *off);

/* "point", "closed form", "quadrature" */
const char *shd_lamp_method_name(shd_area_method method);

/* How an environment of the plan is summed: "tables", or "quadrature" if some term has none. *off:
 * how far off that is at most, of the most that the environment adds to the term. */
const char *shd_around_method(const shd_plan *plan, uint32_t j, double *off);
