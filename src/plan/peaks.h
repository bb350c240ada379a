/* The most that the weights of models can be. */
#pragma once

#include "plan/plan.h"

/* A term's weights (shade/brdf.h) of light of 1. */
typedef struct shd_peak {
    double most;  /* from any one direction; infinite: there is no limit at grazing views */
    double whole; /* 1 / pi of the integral over all directions before the surface */
} shd_peak;

/* Term 0 is the diffuse one, 1 + k lobe k. Proofs are in peaks.c. */
shd_peak shd_peak_of(const shd_plan_material *m, size_t term);

/* The most that light with a shape, no point of which is nearer than `nearest`, makes of it. */
double shd_shape_most(const shd_light *shape, const shd_peak *peak, double nearest);
