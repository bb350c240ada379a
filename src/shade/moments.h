/* A map of surroundings in blocks, over which any smooth function is summed by a few of its values.
 *
 * With the function's polynomial through n by n nodes of a block, the integral of radiance times it
 * over the block is a sum over nodes of its values there times weights, which are integrals of
 * radiance times the nodes' own polynomials. So texels may differ as they like: what the sum is off
 * by is what the polynomial is, times the light of the block. Each block has weights for an n of 2,
 * 4, 6 and 8, whose nodes are Chebyshev's.
 *
 * The map's cells are those between the middles of texels, where radiance is linear both ways: cell
 * (i, j) is from column i to the next one, which goes around, and from row j - 1 to row j, of
 * height
 * + 1 rows of cells, whose first and last have half of the height. Blocks of level k have 4 << k
 * cells each way, less at the last ones, and those of a level make up all of the map.
 *
 * It is one block of bytes without pointers, constant once it is made. Any thread. */
#pragma once

#include <stdint.h>

#include "base/cancel.h"
#include "scene/surroundings.h"

/* Orders of nodes, and how many all of them are, along a side and of a block. */
enum {
    SHD_MOMENT_ORDERS = 4,
    SHD_MOMENT_LEVELS = 4,
    SHD_MOMENT_SIDE = 2 + 4 + 6 + 8,
    SHD_MOMENT_NODES = 4 + 16 + 36 + 64
};

/* Order k is of so many nodes a side, which follow those of the orders below it. */
static inline int shd_moment_order(int k) {
    return 2 + 2 * k;
}
static inline int shd_moment_side_at(int k) {
    return k * (k + 1);
}
static inline int shd_moment_nodes_at(int k) {
    return 2 * k * (k + 1) * (2 * k + 1) / 3;
}

/* An angle: a longitude, or what a latitude is from +y. */
typedef struct shd_turned {
    double cosine, sine;
} shd_turned;

typedef struct shd_moment_block {
    float middle[3]; /* unit */
    float reach;     /* no direction of the block is farther from the middle, in radians */
    float light[3];  /* the integral of each channel */
    float weights[3][SHD_MOMENT_NODES]; /* by channel and order: rows of longitudes */
} shd_moment_block;

typedef struct shd_moment_level {
    int32_t size, columns, rows; /* of a block in cells; blocks */
    uint64_t turns_at, downs_at; /* shd_turned [columns][SHD_MOMENT_SIDE], [rows][..]: nodes */
    uint64_t turns32_at; /* float [columns][2][SHD_MOMENT_SIDE]: cosines and sines of turns */
    uint64_t blocks_at;  /* shd_moment_block [rows][columns] */
} shd_moment_level;

typedef struct shd_moments {
    int32_t width, height, level_count;
    int32_t grey; /* 1: the three channels are the same everywhere, else 0 */
    shd_moment_level levels[SHD_MOMENT_LEVELS]; /* the finest first */
    /* shd_turned [width], [height + 1]: the middles of columns and rows of cells. */
    uint64_t cell_turns_at, cell_downs_at;
    uint64_t bytes;
} shd_moments;

size_t shd_moments_size(const shd_surroundings *map);

/* Fills a block of that size. False: it was cancelled. */
bool shd_moments_make(const shd_surroundings *map, const atomic_bool *cancelled, shd_moments *out);

static inline const shd_moment_block *shd_moment_blocks_of(const shd_moments *m, int level) {
    return (const shd_moment_block *)(const void *)((const char *)m + m->levels[level].blocks_at);
}
static inline const shd_turned *shd_moment_turns_of(const shd_moments *m, int level) {
    return (const shd_turned *)(const void *)((const char *)m + m->levels[level].turns_at);
}
static inline const shd_turned *shd_moment_downs_of(const shd_moments *m, int level) {
    return (const shd_turned *)(const void *)((const char *)m + m->levels[level].downs_at);
}

static inline const float *shd_moment_turns32_of(const shd_moments *m, int level) {
    return (const float *)(const void *)((const char *)m + m->levels[level].turns32_at);
}

static inline const shd_turned *shd_cell_turns_of(const shd_moments *m) {
    return (const shd_turned *)(const void *)((const char *)m + m->cell_turns_at);
}
static inline const shd_turned *shd_cell_downs_of(const shd_moments *m) {
    return (const shd_turned *)(const void *)((const char *)m + m->cell_downs_at);
}

/* Where columns and rows of cells begin, in radians; `i` and `j` may be one after the last. */
static inline double shd_cell_turn(int width, int i) {
    return 2 * SHD_PI * (i + 0.5) / width;
}
static inline double shd_cell_down(int height, int j) {
    return SHD_PI / height * fmin(fmax(j - 0.5, 0), height);
}

/* The direction at a longitude and a latitude. */
static inline shd_vec3 shd_turned_to(shd_turned turn, shd_turned down) {
    return (shd_vec3){-down.sine * turn.sine, down.cosine, down.sine * turn.cosine};
}
