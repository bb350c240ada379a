/* What an environment adds at a point, by any model but microgeometry. Only for shade/. */
#pragma once

#include "shade/brdf.h"
#include "shade/packed.h"

/* Whether an environment's light on the lobes has to be summed bin by bin: what facets mirror of it
 * depends on the wavelength as its own light does. */
static inline bool shd_is_by_bins(const shd_plan *plan, const shd_plan_light *light,
                                  const shd_plan_material *m) {
    return plan->bins && light->environment && m->model == SHD_MODEL_COOK_TORRANCE;
}

/* By these: what lobe k mirrors of the map in each bin, [bins->count], without the light's
 * intensity and the lobe's color. */
void shd_weigh_environment_bins(const shd_plan *plan, const shd_lighting *kernels,
                                const shd_plan_light *light, const shd_surface *at, size_t k,
                                double *out);

/* What a quick walk may take for nothing, in the map's own channels: SHD_QUICK_FLOOR of what bounds
 * take for the most that the map adds (bound/light/sums.c), which know that facets' peak is
 * the lower the more straight they are seen. Beside the whole map's most, all that a small sun adds
 * there would be nothing. `alone` has no lobe but the point's own, if it is one. */
double shd_walk_floor(const shd_light *from, const shd_plan_material *alone, bool is_lobe,
                      const shd_surface *at);

/* The weights of one term that is walked for. `share`: what of itself a quick walk may be off. */
void shd_walk_environment(const shd_plan *plan, const shd_lighting *kernels,
                          const shd_plan_light *light, const shd_surface *at, size_t term,
                          double share, double row[3]);

/* The weights of all terms, but for lobes that are summed by bins, which have 0: rows are those of
 * shd_brdf_weigh, times the map in the working space, without the light's intensity. Lambert's
 * light and Phong's lobes are read from tables, if the plan has these, or integrated
 * (environment.h); others, and lobes of Phong's that are not the table's at the point, are read
 * from what is known there, or walked for (around.h), by `kernels`, or without vectors if that is
 * NULL. */
void shd_weigh_environment(const shd_plan *plan, const shd_lighting *kernels,
                           const shd_plan_light *light, const shd_surface *at,
                           double row[SHD_BRDF_ROWS]);
