/* The light of many lights that are far from a few points, as one polynomial.
 *
 * A light at v from a point sends E = Il f(|v|) v / |v| there, and N.E is what diffuse surfaces
 * show of it, as long as N.E is not below 0. Where the point moves by h from a center, at which v =
 * D n, the terms of E up to the third degree in h are products of scalars, of n and of h alone, so
 * that the sums of those scalars times monomials of n tell them for all lights together: moments.
 * The rest of the series is bounded, for each light, by shd_far_rest.
 *
 * The series of 1 / |v| in h are Gegenbauer polynomials of the angle between n and h, whose
 * largest values are known. So are those of the gradients of Legendre's (Sonin: P^2 + (1 - t^2)
 * P'^2 / (n (n + 1)) is at most 1). All is f64 and pure. Any thread. */
#pragma once

#include "plan/plan.h"

enum {
    SHD_FAR_MOMENTS = 45,
    SHD_FAR_LEAST = 64 /* points and lights that it is made for; fewer are lit as fast */
};

typedef struct shd_far {
    shd_vec3 center; /* world frame */
    int channels;    /* 1: all lights are grey */
    size_t lights;
    double moments[3][SHD_FAR_MOMENTS];
} shd_far;

/* An upper bound of what the third degree leaves out of |E|, over Il f(distance), at points within
 * `radius` of a center that is `distance` away from the light. Infinite: not known. */
double shd_far_rest(const shd_plan_light *light, double distance, double radius);

/* Adds a light without a shape, a spot as if it had no cone. */
void shd_far_add(const shd_plan_light *light, shd_far *to);

/* Adds the sum of N.E Il to the points' rows, those of points32 in the plan's frame. Sums below 0
 * are 0: lights' colors must not be negative. Rounds once. */
void shd_far_light(const shd_plan *plan, const shd_far *far, size_t count,
                   const float *const position[3], const float *const low[3],
                   const float *const normal[3], float *const diffuse[3]);
