/* The most that surfaces can send, wherever they are seen from. Inside of bound/, and for what
 * tells of traced rays. */
#pragma once

#include "plan/parts.h"

/* A term's weights (shade/brdf.h) of light of 1. */
typedef struct shd_peak {
    double most;  /* from any one direction; infinite: there is no limit at grazing views */
    double whole; /* 1 / pi of the integral over all directions before the surface */
} shd_peak;

/* Term 0 is the diffuse one, 1 + k lobe k. Proofs are in brightest.c. */
shd_peak shd_peak_of(const shd_plan_material *m, size_t term);

/* The most that light with a shape, no point of which is nearer than `nearest`, makes of it. */
double shd_shape_most(const shd_light *shape, const shd_peak *peak, double nearest);

/* No point of the light's shape is nearer to the object than this. */
double shd_shape_distance(const shd_place *place, const shd_light *shape);

/* The largest component of all radiance that any ray can bring in the scene, after any number of
 * further steps: of surfaces, as lights with a shape show themselves, or of the background.
 * Infinite: it is not known, or mirrors and glass take nothing from it. */
double shd_brightest(const shd_plan *plan);
