/* Where the points of a run of hits are, and where they face. Pure; any thread. */
#pragma once

#include "render/tiles/tile.h"

/* A sphere around the hits [first, first + count), and a cone around their normals, with what
 * rounding to f32 has moved them by; in the world's frame. */
shd_patch shd_patch_of(const shd_scenery *scenery, const shd_hits *hits, size_t first,
                       size_t count);
