/* Draft's way of drawing blocks of pixels that see a mesh. */
#pragma once

#include "render/tiles/tile.h"

/* Casts the samples of a block that sees one mesh alone, as `standard` does, and draws it in f32 to
 * s->sketch. True: it is drawn, or nothing is seen. False: the standard tier has to draw it. */
bool shd_draw_flat(const shd_scenery *scenery, size_t block, shd_tile_scratch *s);
