/* What is seen of an environment behind all objects (shd_scene.backdrop). */
#pragma once

#include "render/tiles/tile.h"

/* Adds to a tile's pixels, [3][SHD_TILE_PIXELS], the mean of what each pixel's rays see of the
 * environment, times the share of them that meet no object: 1 - cover. */
void shd_sky_add(const shd_scene *scene, shd_tile tile, const float *cover,
                 float (*pixels)[SHD_TILE_PIXELS]);
