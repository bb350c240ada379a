/* One thread's working memory for tiles: shared by tile.c, shots.c and keep.c. */
#ifndef SHD_RENDER_TILES_TILE_SCRATCH_H
#define SHD_RENDER_TILES_TILE_SCRATCH_H

#include "render/tiles/tile.h"

/* Pixels whose rays are cast one after the other: those of a block of the survey, or (NULL) any. */
typedef struct shd_bundle {
    uint16_t first, count; /* in s->pixels */
    const shd_block *block;
} shd_bundle;

/* Of a chunk of the most samples, that is of the fewest pixels, or blocks. */
enum { SHD_BUNDLES = SHD_TILE_PIXELS / (SHD_BLOCK_SIDE * SHD_BLOCK_SIDE) };

enum { SHD_NO_FRAGMENT = UINT16_MAX };

struct shd_tile_scratch {
    size_t tile;       /* its index */
    shd_survey survey; /* of the tile's whole cell of the grid */
    /* A chunk's rays, */
    int32_t *x, *y;
    uint8_t *sample;
    uint16_t *shot_cell;
    /* what they hit, the same grouped by material, and each one's pixel, */
    shd_hits hits, sorted;
    shd_hits kept;                        /* what is known of the same rays */
    const shd_hits *now;                  /* `hits` or `kept` */
    const struct shd_kept_cast *recalled; /* what is known of the next ones */
    uint16_t *cell;
    /* and the sums of light there, as in shd_fragments. */
    shd_run *runs;
    size_t run_count, run_capacity;
    float **sums, **outs;
    double **exact; /* the exact tier's, [term][channel] of a run */
    uint32_t *which;
    uint32_t *order, *starts; /* for sorting */
    /* For averaging: a cell's fragment of a run, and each hit's. */
    uint16_t fragment_of[SHD_TILE_PIXELS], *place;
    uint16_t *pixels;                /* cells that are looked at, */
    shd_bundle bundles[SHD_BUNDLES]; /* these together */
    size_t bundle_count;
    shd_fragments fragments;
    float *coverage; /* fragments.coverage, where not every */
    bool whole;      /* fragment is a whole pixel */
};

/* Whether all hits are of the same object; true where there are none. */
static inline bool shd_is_one_object(const shd_hits *hits) {
    int32_t differ = 0;
    for (size_t i = 0; i < hits->count; i++) differ |= hits->object[i] ^ hits->object[0];
    return !differ;
}

static inline size_t shd_terms_of(const shd_plan *plan, int32_t group) {
    return group == SHD_RADIANCE ? 1 : 1 + plan->materials[plan->groups[group].material].lobe_count;
}

/* Three; one where the lights are grey and the run's sums are of light. */
static inline int shd_channels_of(const shd_plan *plan, int32_t group) {
    return group != SHD_RADIANCE && plan->grey_lights ? 1 : 3;
}

#endif
