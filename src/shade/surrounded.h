/* What an environment adds at a point, by any model but microgeometry. Only for shade/. */
#pragma once

#include "shade/brdf.h"
#include "shade/packed.h"

/* The weights of all terms: rows are those of shd_brdf_weigh, times the map in the working space,
 * without the light's intensity. Lambert's light and Phong's lobes are read from tables, if the
 * plan has these, or integrated (environment.h); others are walked for (around.h), by `kernels`, or
 * without vectors if that is NULL. */
void shd_weigh_environment(const shd_plan *plan, const shd_lighting *kernels,
                           const shd_plan_light *light, const shd_surface *at,
                           double row[SHD_BRDF_ROWS]);
