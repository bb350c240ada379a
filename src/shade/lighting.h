/* Light sums: what a material's colors multiply, for any number of points.
 *
 *     D = sum_j wd_j Il_j,   S_k = sum_j ws_jk Il_j,   I = constant + kd D + sum_k ks_k S_k
 *
 * with the weights of docs/model.md: wd = f s (N.L)+ and ws = f s g (R.V)+^ns. Neither D nor S
 * holds a material's color. Everything here is constant or belongs to the caller, so that threads
 * share a shd_lighting. Kernels cannot fail: everything was checked before.
 *
 * A point's sums depend on that point and the list of lights alone, not on its neighbors, on the
 * instruction set or on lights that add exactly 0, to the bit. Lights are summed in the order
 * of `which` in f32 over groups of SHD_LIGHT_GROUP neighbors in the scene's list, and in f64 over
 * the groups; by the exact tier in f64, and by all where no instruction fuses f32 products into
 * sums (shd_isa_fuses): there the bits are others. So another light in the scene's list, a black
 * one too, may move others into other groups and change last bits. */
#ifndef SHD_SHADE_LIGHTING_H
#define SHD_SHADE_LIGHTING_H

#include "base/arena.h"
#include "plan/plan.h"
#include "plan/tier.h"

enum {
    SHD_LANES = 16 /* arrays of points are as long as the next multiple of this */
};

/* Points of one material. Every array has `count` entries, and from there to the next multiple of
 * SHD_LANES any finite ones (repeat the last); their results are as meaningless. 64-byte aligned
 * arrays are faster. */

/* For the standard tier, in the plan's frame: (p - plan->origin) plan->scale. */
typedef struct shd_points32 {
    size_t count;
    const float *position[3];
    const float *low[3];    /* what rounding took from `position`; low[0] NULL: nothing */
    const float *normal[3]; /* N */
    const float *mirror[3]; /* W = 2(N.V)N - V, rounded from f64 */
} shd_points32;

/* For the exact tier, in the world's frame. */
typedef struct shd_points64 {
    size_t count;
    const double *position[3], *normal[3], *view[3];
} shd_points64;

/* The plan's lights and lobes as kernels want them. */
typedef struct shd_lighting shd_lighting;

/* Lives in `arena`, and borrows the plan. NULL where the arena is full. */
shd_lighting *shd_lighting_new(const shd_plan *plan, shd_arena *arena);

/* The sums over the lights which[0..n): indices in plan->lights, ascending. `material` is one of
 * plan->materials. diffuse[c] and specular[3 lobe + c] are rows as long as the points' arrays, and
 * all of them are written, but of grey lights (plan->grey_lights) only those with c = 0.
 * `diffuse` may be NULL.
 *
 * What is beyond f32 is infinite, and NaN where infinite light meets infinite negative light. Once
 * plan->cancelled is raised, rows are written in part. */
void shd_light_sums32(const shd_lighting *lighting, const shd_plan_material *material,
                      const uint32_t *which, size_t n, const shd_points32 *points,
                      float *const diffuse[3], float *const *specular);

/* The same in f64, for the exact tier: sums in f64 in the order of `which`. Only `count` entries of
 * the rows are written. */
void shd_light_sums64(const shd_lighting *lighting, const shd_plan_material *material,
                      const uint32_t *which, size_t n, const shd_points64 *points,
                      double *const diffuse[3], double *const *specular);

#endif
