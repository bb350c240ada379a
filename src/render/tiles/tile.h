/* One tile of the picture: what is seen through it and what light falls there, before the
 * materials' colors. Inside of render/. */
#pragma once

#include "render/tiles/facets.h"
#include "render/tiles/fragments.h"
#include "render/tiles/paint.h"
#include "render/tiles/tile_scratch.h"
#include "shade/lighting.h"
#include "sight/sight.h"

struct shd_film;

/* What all threads of a picture share. It is constant while they run. */
typedef struct shd_scenery {
    const shd_plan *plan;
    const shd_sight *sight;
    const shd_lighting *lighting;
    const shd_facet_light *facets;
    const shd_paint_kernel *paint;
    bool data;                      /* layers of normals, positions, depths or objects are wanted */
    const struct shd_record *known; /* hits of this geometry, or NULL */
    struct shd_record *kept;        /* keeps hits, or NULL */
} shd_scenery;

/* Looks at the pixels of tile `index`. The fragments live in the scratch until the next call. Data
 * layers go to the film at once. Ends the stages visibility and shade. `tile` lies within one
 * tile of the grid. */
const shd_fragments *shd_tile_look(const shd_scenery *scenery, size_t index, shd_tile tile,
                                   shd_tile_scratch *scratch, const struct shd_film *film,
                                   shd_stopwatch *watch);
