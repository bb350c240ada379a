/* What highlights are at the points of a tile where surfaces bend (shade/bend.h). */
#pragma once

#include "render/tiles/tile.h"

/* Fills s->sharp for the hits first .. first + count - 1, at their own places. The plan is of the
 * exact tier, as all that widen highlights are. */
void shd_bent_sharpen(const shd_scenery *scenery, const shd_plan_material *material,
                      const shd_hits *hits, size_t first, size_t count, shd_tile_scratch *s);
