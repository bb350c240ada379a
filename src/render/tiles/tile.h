/* One tile of the picture: what is seen through it and what light falls there, before the
 * materials' colors. */
#pragma once

#include "render/rendering.h"
#include "render/tiles/keep.h"
#include "render/tiles/tile_scratch.h"

struct shd_film;
struct shd_traced;

/* What all threads of a picture share. It is constant while they run. */
typedef struct shd_scenery {
    const shd_plan *plan;
    const shd_sight *sight; /* NULL: recall.light has the picture's light */
    const shd_lighting *lighting;
    float **facets; /* [object]: the radiance of its points (facets.h); NULL: it has no facets */
    double **lit;   /* [object]: or what patterns multiply there (facets.h); NULL: it has none */
    /* [object]: what hits are grouped by: the object's group, or plan->group_count for all that
     * have facets. Of many objects, plan->objects is too large for caches. */
    uint32_t *classes;
    const shd_paint_kernel *paint;
    const struct shd_traced *traced; /* rays beyond the eye's (traced.h); NULL: there are none */
    bool data; /* layers of normals, positions, depths or objects are wanted */
    shd_recall recall;
} shd_scenery;

/* Looks at the pixels of tile `index`. Those of scratch->sketched are drawn, and have no fragments,
 * which live in the scratch until the next call. Data
 * layers go to the film at once. Ends the stages visibility, shade, shadow and
 * trace. `tile` lies within
 * one tile of the grid. */
const shd_fragments *shd_tile_look(const shd_scenery *scenery, size_t index, shd_tile tile,
                                   shd_tile_scratch *scratch, const struct shd_film *film,
                                   shd_stopwatch *watch);
