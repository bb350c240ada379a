/* The most that surfaces can send, wherever they are seen from. Inside of bound/, and for what
 * tells of traced rays. */
#pragma once

#include "plan/parts.h"
#include "plan/peaks.h"

/* No point of the light's shape is nearer to the object than this. */
double shd_shape_distance(const shd_place *place, const shd_light *shape);

/* The most that bins of what a material, or a visible light (or NULL), shows without other light
 * add up to in any channel: of tinted plans, in which rays bring any share of each. */
double shd_tinted_most(const shd_plan *plan, const shd_plan_material *material,
                       const shd_light *emitter);

/* The largest component of all radiance that any ray can bring in the scene, after any number of
 * further steps: of surfaces, as lights with a shape show themselves, or of the background.
 * Infinite: it is not known, or mirrors and glass take nothing from it. */
double shd_brightest(const shd_plan *plan);
