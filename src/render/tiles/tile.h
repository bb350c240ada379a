/* One tile of the picture: what is seen through it and what light falls there, before the
 * materials' colors. Inside of render/.
 *
 * Radiance is linear in the sums of light (shade/lighting.h), so a pixel needs no more than the
 * means of its samples' sums: a fragment is the share of a pixel that one material covers, and
 * colors multiply once a fragment however many samples it has. */
#ifndef SHD_RENDER_TILES_TILE_H
#define SHD_RENDER_TILES_TILE_H

#include "render/tiles/facets.h"
#include "render/tiles/paint.h"
#include "shade/lighting.h"
#include "sight/sight.h"

struct shd_film;

enum {
    SHD_CHUNK = 4096, /* samples that are cast and lit at once: whole pixels */
    SHD_RADIANCE = -1 /* in place of a run's group: `sums` is radiance, plane by plane */
};

/* Fragments that follow each other and are lit alike. */
typedef struct shd_run {
    int32_t group; /* index in the plan, or SHD_RADIANCE */
    uint32_t first, count;
} shd_run;

typedef struct shd_fragments {
    size_t count, capacity;
    uint16_t *cell;  /* [count]: y * SHD_TILE + x from the tile's corner on the grid */
    float *coverage; /* [count]: share of the pixel's samples in (0,1]; NULL if all are 1 */
    float **sums;    /* [plane][term][channel]: [count] each, see shd_sum_of; NULL if not used */
    shd_run *runs;
    size_t run_count;
} shd_fragments;

/* The index of an array of a plane's sums. Term 0 is diffuse, 1 + k is lobe k. Planes that are
 * terms of the equation share the sums of plane 0. SHD_RADIANCE runs have term 0 only. */
static inline size_t shd_sum_of(const shd_plan *plan, size_t plane, size_t term, int channel) {
    return (plane * (1 + plan->max_lobes) + term) * 3 + (size_t)channel;
}

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

/* Tiles of the grid that a picture's region touches. */
size_t shd_tile_count(const shd_raster *raster);

/* One thread's working memory. */
typedef struct shd_tile_scratch shd_tile_scratch;

/* NULL if it is only counted, or the arena is full. */
shd_tile_scratch *shd_tile_scratch_lay_out(const shd_plan *plan, shd_scratch *memory);

/* Looks at the pixels of tile `index`. The fragments live in the scratch until the next call. Data
 * layers go to the film at once. Ends the stages visibility and shade. `tile` lies within one
 * tile of the grid. */
const shd_fragments *shd_tile_look(const shd_scenery *scenery, size_t index, shd_tile tile,
                                   shd_tile_scratch *scratch, const struct shd_film *film,
                                   shd_stopwatch *watch);

#endif
