/* The centers of pixels that the means of neighbors share (plan/nodes.h): each is cast and lit once
 * for all of a tile's bundles that need it. */
#pragma once

#include <stdint.h>

#include "plan/nodes.h"
#include "render/tiles/paint.h"

enum { SHD_CENTERS_SIDE = SHD_TILE + 2 * SHD_FRINGE };

/* Those of a tile that are needed: bit x + SHD_FRINGE of rows[y + SHD_FRINGE] is that of the cell
 * in column x and row y, which may be beside the tile. */
typedef struct shd_centers {
    uint64_t rows[SHD_CENTERS_SIDE];
} shd_centers;

/* Adds the centers up to `rim` away from pixels of a block, as bits, whose upper left one is
 * `cell`.
 */
void shd_centers_add(shd_centers *centers, uint16_t cell, uint64_t pixels, int rim);

/* Where the shots through them go, row by row, in [count] as shd_tile_scratch has them, if the
 * tile's cell of the grid begins at (left, top). `cell` tells what is kept of the shots (keep.h),
 * and is no other shot's. Returns how many there are. */
size_t shd_centers_list(const shd_centers *centers, int left, int top, int32_t *x, int32_t *y,
                        uint16_t *cell);

/* Spreads what the same shots have over a plane, where filters find their neighbors. The rest of it
 * stays as it is. */
void shd_centers_spread(const shd_centers *centers, const float *values,
                        double plane[SHD_CENTERS_SIDE][SHD_CENTERS_SIDE]);
