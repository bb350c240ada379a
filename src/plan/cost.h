/* What rays and lights cost, by a simple model with constants that were measured once, because it
 * decides which tier meets a budget at the least cost. */
#pragma once

#include "plan/plan.h"

/* Nanoseconds of a light at a hit, and of each specular lobe of it. The first was measured with a
 * shininess of 1e5, whose lobe few points see, and the second with 50. */
typedef struct shd_kernel_cost {
    double light, lobe;
} shd_kernel_cost;

/* Nanoseconds of one core. */
typedef struct shd_ray_cost {
    double rays, light;   /* of all samples of a pixel, on the average of the whole picture */
    double shadow, trace; /* the same of rays to lights, and of those that go on */
    double meshes;        /* once, to make triangles findable */
} shd_ray_cost;

/* The tiers' costs with the kernels of plan->isa, [SHD_EXACT + 1]: plan/kernel_costs.h. */
const shd_kernel_cost *shd_plan_kernel_costs(const shd_plan *plan);

/* What the plan costs in a tier, if lights cost `costs`. */
shd_ray_cost shd_plan_ray_cost(const shd_plan *plan, shd_tier tier, const shd_kernel_cost *costs);

/* No less than the whole of that, but for rounding, and in a fraction of its time: it looks at
 * spheres around objects alone. Infinite where this is not told: of triangles, bunches of lights,
 * or extended plans. */
double shd_plan_most_cost(const shd_plan *plan, shd_tier tier, const shd_kernel_cost *costs);

/* Nanoseconds of a light at a hit in an extended plan, of which `vectors` are those of a point on
 * Phong's model; but for the rays to it. Inside of plan/. */
double shd_beyond_cost(const shd_plan *plan, const shd_plan_material *m,
                       const shd_plan_light *light, shd_tier tier, double vectors);

/* Triangles of the tree that a picture builds for an object. 0: it needs none, or there is one: the
 * mesh is kept, or an earlier object has it. */
size_t shd_plan_built_triangles(const shd_scene *scene, size_t object);

/* Sorts the tiers by what the plan costs in each, the cheapest first, and the more exact one first
 * if two cost the same. The order is the same for any region of a picture. */
void shd_plan_rank_tiers(const shd_plan *plan, const shd_kernel_cost *costs,
                         shd_tier out[SHD_EXACT + 1]);
