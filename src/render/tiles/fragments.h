/* What light falls on what is seen through a tile. Radiance is linear in the sums of light
 * (shade/lighting.h), so a pixel needs no more than the means of its samples' sums: a fragment is
 * the share of a pixel that one material covers, and colors multiply once a fragment however many
 * samples it has. */
#pragma once

#include "plan/plan.h"
#include "plan/textures.h"
#include "render/tiles/paint.h"

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

/* The index of an array of a plane's sums. Term 0 is diffuse, 1 + k is lobe k, and then come the
 * slots of patterns (plan/textures.h). Planes that are
 * terms of the equation share the sums of plane 0. SHD_RADIANCE runs have term 0 only. */
static inline size_t shd_sum_of(const shd_plan *plan, size_t plane, size_t term, int channel) {
    return (plane * plan->max_terms + term) * 3 + (size_t)channel;
}

/* The terms that a run has sums of. */
static inline size_t shd_terms_of(const shd_plan *plan, int32_t group) {
    if (group == SHD_RADIANCE) return 1;
    const shd_plan_material *material = &plan->materials[plan->groups[group].material];
    return 1 + material->lobe_count + shd_material_slots(material);
}

/* Three, or one if the lights are grey and the run's sums are of light. */
static inline int shd_channels_of(const shd_plan *plan, int32_t group) {
    return group != SHD_RADIANCE && plan->grey_lights ? 1 : 3;
}

/* Tiles of the grid that a picture's region touches: in a row, and all. */
static inline size_t shd_tiles_across(const shd_raster *raster) {
    return (size_t)((raster->x + raster->w - 1) / SHD_TILE - raster->x / SHD_TILE + 1);
}

static inline size_t shd_tile_count(const shd_raster *raster) {
    const int down = (raster->y + raster->h - 1) / SHD_TILE - raster->y / SHD_TILE + 1;
    return shd_tiles_across(raster) * (size_t)down;
}
