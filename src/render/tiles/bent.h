/* What the normals and highlights of a tile's points are where maps turn normals (shade/bump.h),
 * where surfaces bend (shade/bend.h), and where exponents are patterns (shade/gloss.h). */
#pragma once

#include "render/tiles/tile.h"

/* Fills s->sharp for the hits first .. first + count - 1, at their own places, and turns their
 * normals if the material has a map. The plan is of the exact tier, as all of such materials are. A
 * lobe is what its pattern makes of it, is widened by the map, and then by how the surface itself
 * bends, around the normal that the map gives. */
void shd_bent_sharpen(const shd_scenery *scenery, const shd_plan_material *material,
                      const shd_hits *hits, size_t first, size_t count, shd_tile_scratch *s);
