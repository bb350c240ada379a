/* Faceted objects (flat, gouraud) are lit at the points of their faces or vertices before any tile
 * is.
 *
 * Of most of them the radiance of these points is kept, and interpolated. If a material has
 * patterns, each coefficient is another one at each sample. Radiance is linear in the sums of light
 * that coefficients multiply (shade/lighting.h), and so these sums are kept instead, interpolated
 * and multiplied at the sample: by a coefficient of one color that is the interpolated radiance. */
#pragma once

#include "render/tiles/tile.h"
#include "sight/ray.h"

/* Lights them on the pool: scenery->facets[object] becomes [point][plane][channel], or, of a
 * material with patterns, scenery->lit[object] [point][plane][1 + term][channel]. The first of
 * these is the radiance of the material in its low colors, in the exact tier alone; the others are
 * sums of light (shd_sum_of), of planes that do not share those of plane 0. Adds to
 * r->times.shade. False: the arena is full. If the request is cancelled the light is undefined. */
bool shd_facets_light(shd_rendering *r, shd_scenery *scenery);

/* The radiance of a run of hits without patterns: [plane][channel] of `sums`. */
void shd_facets_interpolate(const shd_scenery *scenery, const shd_hits *hits, shd_run run,
                            float *const *sums);

/* Fills s->sums for a run of hits of a group that is faceted, whose patterns are in s->weights: as
 * of any other group in the standard tier, with radiance in the exact one. */
void shd_facets_sum(const shd_scenery *scenery, const shd_hits *hits, shd_run run,
                    shd_tile_scratch *s);

/* The radiance, in the exact tier, of an object with patterns that a further ray meets, which are
 * in s->beam. */
void shd_facets_meet(const shd_scenery *scenery, const shd_meeting *met, const shd_tile_scratch *s,
                     double out[3]);
