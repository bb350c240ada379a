/* What patterns are at the points of a tile, and the sums that they multiply (plan/textures.h).
 *
 * A sample sees the mean over its whole pixel, so that samples are for edges and light alone.
 * Weights are found from points of 48 bits in every tier, and differ by the rounding of these. */
#pragma once

#include "plan/textures.h"
#include "render/tiles/tile.h"
#include "shade/beam.h"

/* Fills s->weights for the hits first .. first + count - 1, and s->shares at their places. */
void shd_textured_weigh(const shd_scenery *scenery, const shd_plan_textures *textures,
                        const shd_hits *hits, size_t first, size_t count, shd_tile_scratch *s);

/* Fills s->beam for what a beam meets. */
void shd_textured_weigh_beam(const shd_scenery *scenery, const shd_plan_textures *textures,
                             const shd_beam *beam, shd_tile_scratch *s);

/* Fills out[channel][0 .. count - 1] with what facets reflect, or their index
 * (shd_points64.facets), where the fields of `slot`, shd_facet_slot's, have these weights. */
void shd_textured_facets(const shd_plan_material *material, const shd_plan_slot *slot,
                         double *const *weights, size_t count, double *const out[3]);

/* Fills the sums of the material's slots in a plane from its terms, from place `first` on. */
void shd_textured_sums(const shd_scenery *scenery, const shd_plan_material *material, size_t plane,
                       size_t first, size_t count, shd_tile_scratch *s);
