/* What rays and lights cost, about: a simple model, with constants measured once. It decides which
 * tier meets a budget for the least, so that nothing that is measured while a program runs may be
 * in it. */
#ifndef SHD_PLAN_COST_H
#define SHD_PLAN_COST_H

#include "plan/plan.h"

/* Nanoseconds of a light at a hit, and what each specular lobe of it adds: of shininess 1e5, where
 * few points see the lobe, and at 50. */
typedef struct shd_kernel_cost {
    double light, lobe;
} shd_kernel_cost;

/* Nanoseconds of one core. */
typedef struct shd_ray_cost {
    double rays, light; /* a pixel of the whole picture, on the average: all of its samples */
    double meshes;      /* once: to make triangles findable */
} shd_ray_cost;

/* The tiers' costs with the kernels of plan->isa, [SHD_EXACT + 1]: plan/kernel_costs.h. */
const shd_kernel_cost *shd_plan_kernel_costs(const shd_plan *plan);

/* Of the plan in that tier, where its lights cost what the table says. */
shd_ray_cost shd_plan_ray_cost(const shd_plan *plan, shd_tier tier, const shd_kernel_cost *costs);

/* The tiers by what the plan costs in each, the cheapest first; of those that cost the same, the
 * more exact one. The same for any region of a picture. */
void shd_plan_rank_tiers(const shd_plan *plan, const shd_kernel_cost *costs,
                         shd_tier out[SHD_EXACT + 1]);

#endif
