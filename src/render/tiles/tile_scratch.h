/* One thread's working memory for tiles. */
#pragma once

#include "plan/bend.h"
#include "plan/nodes.h"
#include "render/tiles/centers.h"
#include "render/tiles/far.h"
#include "render/tiles/fragments.h"
#include "shade/lighting.h"
#include "sight/bend.h"
#include "sight/sight.h"

/* Pixels whose rays are cast together. */
typedef struct shd_bundle {
    uint16_t first, count;  /* in s->pixels */
    uint16_t samples;       /* of each pixel that are taken: all, one at its center, or nodes */
    uint16_t rule;          /* that these are of, plus 1, of s->rules; or 0 */
    bool inside;            /* all rays hit `object` first */
    uint16_t corner;        /* with a rule: the cell of the block's upper left pixel, */
    uint64_t pixels;        /* which of its pixels they are, as bits row by row, */
    uint32_t object;        /* and what all nodes hit; they may be in several blocks otherwise */
    const shd_block *block; /* of the survey, if they are all in one; or NULL */
} shd_bundle;

enum {
    SHD_BLOCKS = SHD_TILE_PIXELS / (SHD_BLOCK_SIDE * SHD_BLOCK_SIDE), /* of a tile */
    /* What takes rules of a block, two of each quarter, and the most of a tile: that and the rest.
     */
    SHD_RULED = 2 * SHD_QUARTERS,
    SHD_BUNDLES = SHD_BLOCKS * (SHD_RULED + 1),
    SHD_NO_FRAGMENT = UINT16_MAX
};

typedef struct shd_tile_scratch {
    size_t tile;       /* its index */
    shd_survey survey; /* of the tile's whole cell of the grid */

    uint16_t *pixels;                /* the cells that are looked at */
    shd_bundle bundles[SHD_BUNDLES]; /* which of them are cast together */
    size_t bundle_count;
    shd_pattern_spread spread; /* of samples, if bundles may take one instead (plan->mean_room) */
    /* Of a plan that is sketched: the survey's blocks that are drawn, as bits, and their colors by
     * cell. */
    uint32_t sketched;
    float *sketch[3];          /* [SHD_TILE_PIXELS] */
    shd_rule rules[SHD_RULES]; /* [rule_count]: that bundles may take instead */
    size_t rule_count;

    /* A chunk's rays. */
    int32_t *x, *y;
    uint8_t *sample;
    uint16_t *shot_cell;
    shd_centers centers; /* that its bundles share, if any */

    /* What the rays hit. */
    shd_hits hits, sorted;                /* in the order of the rays; grouped by material */
    shd_hits kept;                        /* what is known of the same rays */
    const shd_hits *now;                  /* `hits` or `kept` */
    const struct shd_kept_cast *recalled; /* what is known of the next rays */
    uint16_t *cell;                       /* the cell of each hit */
    uint32_t *order, *starts;             /* for sorting */

    /* The sums of light there, as in shd_fragments. */
    shd_run *runs;
    size_t run_count, run_capacity;
    float **sums, **outs;
    uint8_t *edges; /* of a run's hits: those that are lit again (shd_light_sums32) */
    shd_hits again; /* some of them, in f64 */
    /* Of the exact tier: [term][channel] of a run; if there are patterns, then [channel] of what
     * they add to. */
    double **exact;
    double **weights; /* [plan->max_patterns]: what a run's patterns are at its points */
    /* [3] each: the opacity, reflection and transmission of each hit, if its material's is a
     * texture; NULL: none is, or rays are not followed */
    double **shares[3];
    double **beam;   /* [plan->max_fields] of 1: what patterns are where a further ray ends */
    double **sharp;  /* [2 max_lobes + 3]: shd_points64.sharp of each hit, if lobes differ */
    double **facets; /* [3]: shd_points64.facets, if some have a texture */
    struct shd_smooth *smooth; /* cells of environments' light (smooth.h); NULL: there are none */
    uint32_t *which;           /* lights that may reach a run */
    shd_afar_scratch afar;     /* of a plan that has bunches */
    const shd_far *far;        /* what lights the run beside `which`, or NULL */
    /* Of hits through which a transparent background may be seen: how much of a sample each one
     * covers. NULL: there are none. */
    float *alpha;
    /* How far off the rays of each cell's samples are at most; infinite: one is lost. NULL: no rays
     * are followed, or nobody wants to know. */
    float *stray;
    double off;      /* the most that a sample's rays are off by (trace/bounce.h) */
    uint64_t lost;   /* samples that do not count in it */
    double cut;      /* the most that a sample's rays left out (trace/bounce.h) */
    double *room;    /* for paths (shd_bounce); NULL: none are followed */
    uint64_t rays;   /* that were followed beyond the eye's, but for those to lights */
    double shadowed; /* seconds of those to lights, of the tile, within the stage shade */

    /* Their means. */
    uint16_t fragment_of[SHD_TILE_PIXELS]; /* a cell's fragment of a run */
    uint16_t *place;                       /* each hit's fragment */
    shd_fragments fragments;
    float *coverage; /* fragments.coverage, unless every fragment is a whole pixel: */
    bool whole;
} shd_tile_scratch;

/* The pixels of a chunk: they are cast and lit at once, with all of their samples. */
size_t shd_pixels_at_once(size_t samples);

/* NULL if it is only counted, or the arena is full. */
shd_tile_scratch *shd_tile_scratch_lay_out(const shd_plan *plan, shd_scratch *memory);
