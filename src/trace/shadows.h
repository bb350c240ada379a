/* Shadows: how much of a light arrives at a point.
 *
 * The light of a point, a spot or a direction comes along one ray, and loses 1 - opacity, channel
 * by channel, at each surface that the ray crosses: an object that is seen through from one side
 * and out of the other counts twice, as it does to the eye. Transmission does not count. A mesh's
 * triangle is itself a surface between its front and a light behind it, even where the interpolated
 * normal faces the light.
 *
 * From a light with a shape comes the mean over `shadowSamples` points of it, each weighed by what
 * it adds to a diffuse surface there: (N.L)+ times the cosine at the light over the square of the
 * distance (a sphere's points are even in solid angle and weigh (N.L)+). The points are those of J.
 * M. Hammersley, "Monte Carlo methods for solving multivariable problems", 1960: point i of n is at
 * ((i + 1/2) / n, the bits of i mirrored at the point, plus 1/(2n)). They are the same for every
 * point of a surface, so that there is no noise; the model is this mean. The shape itself shadows
 * nothing. */
#pragma once

#include "plan/occluders.h"
#include "shade/lighting.h"
#include "sight/ray.h"

/* Fills `out`, whose context lives in the arena. SHD_MEMORY is false, and so is a cancellation. */
bool shd_shadows_make(const shd_plan *plan, const shd_caster *caster, shd_arena *arena,
                      shd_shadows *out);

/* [object]: whether nothing is seen through it. NULL: the arena is full. */
const bool *shd_solid_objects(const shd_plan *plan, shd_arena *arena);
