/* Faceted objects (flat, gouraud) are lit at the points of their faces or vertices before any tile
 * is. Inside of render/. */
#pragma once

#include "render/rendering.h"
#include "render/tiles/radiance.h"
#include "shade/lighting.h"
#include "sight/sight.h"

/* Radiance at the points of objects. */
typedef struct shd_facet_light {
    float **radiance; /* [object]: [point][plane][channel]; NULL: lit at every sample */
    bool any;         /* some object is faceted */
} shd_facet_light;

/* Lights them on the pool and adds to r->times.shade. False: the arena is full. If the request is
 * cancelled the radiance is undefined. */
bool shd_facets_light(shd_rendering *r, const shd_sight *sight, const shd_lighting *lighting,
                      const shd_paint_kernel *paint, shd_facet_light *out);
