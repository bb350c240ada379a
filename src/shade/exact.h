/* The reference: the equations of docs/model.md in f64, one light at one point at a time. Kernels
 * are tested against it, and leave to it what their own arithmetic cannot hold. */
#pragma once

#include "plan/plan.h"

/* f s at a point, and the unit vector toward the light. 0: no light arrives. */
double shd_arriving(const shd_plan_light *light, shd_vec3 position, shd_vec3 *toward);

/* In the world frame; `normal` N and `mirror` W = 2(N.V)N - V are unit. Returns wd = f s (N.L)+.
 * For shd_weigh_lobe, *factor is f s if the light is before the surface and otherwise 0, and *off
 * is 1 - R.V. */
double shd_weigh_light(const shd_plan_light *light, shd_vec3 position, shd_vec3 normal,
                       shd_vec3 mirror, double *factor, double *off);

/* ws = factor (R.V)+^shininess. */
double shd_weigh_lobe(double shininess, double factor, double off);
