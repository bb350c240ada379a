/* How far the kernels' weights are from the model: upper bounds, for error bounds of pictures.
 *
 * All are for weights of f = s = 1 and points whose f32 positions are split, or whose rounding
 * moves no direction to the light by more than `moved`, which is 0 then. On edges, where the model
 * jumps (N.L = 0 under a highlight, the rim of a cone without penumbra), a point within rounding
 * may fall on the other side; no bound counts that. tests/unit/shade_errors.c fails where an error
 * exceeds its bound, and where a bound is more than ten times the largest error. */
#ifndef SHD_SHADE_ERROR_H
#define SHD_SHADE_ERROR_H

#include "plan/plan.h"

/* |d wd| <= relative wd + absolute + moved. */
typedef struct shd_diffuse_error {
    double relative, absolute;
} shd_diffuse_error;

shd_diffuse_error shd_tier_diffuse_error(shd_tier tier);

/* Of ws, absolute. Directions that are off by e move d = 1 - R.V by sqrt(2 d) e, and
 * exp(-ns d) by at most ns sqrt(2 d) exp(-ns d) e, which is largest at d = 1/2ns: 0.61 sqrt(ns) e.
 * The functions' own errors and those relative to d are a constant beside it. */
double shd_tier_specular_error(shd_tier tier, double shininess, double moved);

/* Of s, absolute; of lights that the tier does in its own precision. */
double shd_tier_spot_error(shd_tier tier, const shd_plan_light *light, double moved);

/* Of f, relative; of attenuated lights. A distance that is off by a part `moved` of itself adds at
 * most twice that. */
double shd_tier_attenuation_error(shd_tier tier, double moved);

/* What a position's and a light's rounding to f32 moves the direction by, where positions are not
 * split: half an ulp in three coordinates of each, over their distance. `size` is the largest
 * coordinate of the points and `reach` the light's, in the plan's frame. */
double shd_rounding_moves(double size, double reach, double distance);

#endif
