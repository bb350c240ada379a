/* Through which pixels of a tile rays are cast and in what order, and the casting. */
#pragma once

#include "render/tiles/tile.h"

/* What is cast and lit at once: bundles of s->bundles. */
typedef struct shd_chunk {
    const shd_bundle *bundles;
    size_t count, pixels, shots;
    size_t samples;       /* of each of these that are taken */
    const shd_rule *rule; /* whose nodes these are; NULL: all weigh as much */
} shd_chunk;

/* Fills s->pixels and s->bundles with all pixels of blocks where the survey of the tile's cell of
 * the grid says that something may be seen. They are listed block by block or, if that saves
 * nothing and nobody needs blocks, row by row as pictures have them. Within plan->mean_room, blocks
 * take one sample a pixel; these are listed first. Then come those that take nodes of rules, or
 * whose quarters do. Blocks that a plan sketches are drawn at once, to s->sketch, and not listed.
 */
void shd_list_pixels(const shd_scenery *scenery, shd_tile tile, shd_tile_scratch *s);

/* Takes as many bundles from `first` on as there is room for and as take as many samples, and fills
 * s->x, y, sample and shot_cell, and s->centers if they share these. `pattern` is how many samples
 * a pixel has. */
shd_chunk shd_make_chunk(shd_tile tile, shd_tile_scratch *s, size_t first, size_t pattern);

/* Casts the chunk's shots, those of each bundle at what its block may show. Fills s->hits and
 * s->now. */
void shd_shoot_chunk(const shd_scenery *scenery, const shd_chunk *c, shd_tile_scratch *s);
