/* Exponents and roughness of lobes that are patterns or pictures of numbers.
 *
 * A lobe's number at a point is low + (high - low) w of the field's mean w over the footprint
 * there, as of any pattern (shade/texture.h). So the number is what is filtered, and a pixel that
 * sees many of them has the lobe of their mean, not the mean of their lobes: that is the model, and
 * no error of it. Maps of normals (shade/bump.h) and bends (shade/bend.h) then widen the lobe that
 * the point has. Any thread. */
#pragma once

#include "plan/plan.h"
#include "shade/wave.h"

/* The lobe's exponent or roughness over a footprint of the chart, between the least and the most
 * that its texture has. `uv` is not looked at if it has none. */
double shd_gloss_of(const shd_plan_material *material, size_t lobe, const shd_footprint *uv);
