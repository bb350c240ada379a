/* One thread's working memory for tiles: shared by tile.c and refine.c. */
#ifndef SHD_RENDER_TILE_SCRATCH_H
#define SHD_RENDER_TILE_SCRATCH_H

#include "render/tile.h"

typedef struct shd_refining shd_refining; /* refine.c */

struct shd_tile_scratch {
    size_t tile;       /* its index */
    shd_survey survey; /* of the tile's whole cell of the grid, with a block around it where */
    shd_tile surveyed; /* sampling is adaptive */
    /* A chunk's rays, */
    int32_t *x, *y;
    uint8_t *pattern, *centres; /* sample indices: pixel by pixel, and SHD_CENTER for all */
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
    size_t sum_arrays;
    uint32_t *which;
    uint32_t *order, *starts; /* for sorting */
    uint32_t *first;          /* for averaging: where pixels begin */
    uint16_t *pixels;         /* cells that get the whole pattern */
    shd_fragments fragments;
    shd_refining *refining; /* NULL where the plan samples everything */
};

/* Casts s->x, s->y and `sample`, or recalls what they hit: s->now. Ends the stage. */
void shd_tile_cast(const shd_scenery *scenery, shd_tile_scratch *s, size_t shots,
                   const uint8_t *sample, shd_stopwatch *watch);

/* Lights s->now: fills s->cell, s->runs and s->sums. Returns the hits in the runs' order. */
const shd_hits *shd_tile_light(const shd_scenery *scenery, shd_tile_scratch *s);

/* The block of the survey that a pixel lies in. */
static inline const shd_block *shd_tile_block(const shd_tile_scratch *s, int x, int y) {
    return &s->survey.blocks[(y - s->surveyed.y) / SHD_BLOCK_SIDE * s->survey.across +
                             (x - s->surveyed.x) / SHD_BLOCK_SIDE];
}

/* A row's pixels from x on that lie in its block: up to `end`. */
static inline int shd_tile_block_end(const shd_tile_scratch *s, int x, int end) {
    const int next = x + SHD_BLOCK_SIDE - (x - s->surveyed.x) % SHD_BLOCK_SIDE;
    return next < end ? next : end;
}

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

/* Adaptive sampling. Adds fragments for the pixels whose pattern's mean their neighborhood tells
 * within the plan's tolerance, and lists the others that may see something in s->pixels. */
shd_refining *shd_refining_new(const shd_plan *plan, shd_arena *arena);
uint64_t shd_refining_size(const shd_plan *plan); /* as shd_tile_scratch_size */
size_t shd_refine(const shd_scenery *scenery, shd_tile tile, shd_tile_scratch *s,
                  shd_stopwatch *watch);

#endif
