/* Faceted objects (flat, gouraud) are lit at the points of their faces or vertices before any tile
 * is. */
#pragma once

#include "render/tiles/tile.h"

/* Lights them on the pool: scenery->facets[object] becomes [point][plane][channel]. Adds to
 * r->times.shade. False: the arena is full. If the request is cancelled the radiance is
 * undefined. */
bool shd_facets_light(shd_rendering *r, shd_scenery *scenery);
