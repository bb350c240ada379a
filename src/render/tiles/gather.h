/* Samples of a chunk, lit, become fragments of pixels. */
#pragma once

#include "render/tiles/shots.h"

/* Appends the chunk's samples, averaged within its pixels, to s->fragments. They are in s->runs,
 * their sums in s->sums and their cells in s->cell. */
void shd_add_fragments(const shd_scenery *scenery, shd_tile_scratch *s, const shd_chunk *chunk);
