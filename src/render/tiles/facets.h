/* Faceted objects (flat, gouraud) are lit at their faces' or vertices' points before any tile.
 * Inside of render/. */
#ifndef SHD_RENDER_TILES_FACETS_H
#define SHD_RENDER_TILES_FACETS_H

#include "render/rendering.h"
#include "render/tiles/radiance.h"
#include "shade/lighting.h"
#include "sight/sight.h"

/* Radiance at the points of objects. */
typedef struct shd_facet_light {
    float **radiance; /* [object]: [point][plane][channel]; NULL: it is lit at every sample */
    bool any;         /* some object is faceted */
} shd_facet_light;

/* Lights them on the pool; adds to r->times.shade. False: the arena is full. The radiance of what
 * is cancelled is undefined. */
bool shd_facets_light(shd_rendering *r, const shd_sight *sight, const shd_lighting *lighting,
                      const shd_paint_kernel *paint, shd_facet_light *out);

#endif
