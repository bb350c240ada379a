/* Lights of a run of hits that are far enough to be lit as one (shade/far.h). */
#pragma once

#include "base/scratch.h"
#include "shade/far.h"

/* What is looked at: a run, a quad of blocks, a block. */
enum { SHD_AFAR_LEVELS = 3 };

/* What is found of a patch, and then of the parts that it is of. */
typedef struct shd_afar {
    shd_far far;       /* the lights that are lit as one, also by the whole; 0: there are none */
    double weight[3];  /* channels, which what they are off by is multiplied with */
    double room;       /* what may be left out of each channel of the patch's color, weighed */
    double spent;      /* what of it is, by these lights and by those of the whole */
    shd_far_sums sums; /* of the diffuse light that both of them send */
    /* What is left and may reach the patch: places in bunches->lights, those of lights whose
     * highlights need not be seen, and other lights. */
    uint32_t *open, *dull, *alone;
    size_t open_count, dull_count, alone_count;
} shd_afar;

/* A bunch that is lit as one, or left out. */
typedef struct shd_afar_bunch {
    uint32_t index; /* in bunches->list */
    bool told;
    double rest; /* as in shd_far_look */
    shd_far_sums sums;
} shd_afar_bunch;

/* One thread's working memory for patches, and for parts of them. */
typedef struct shd_afar_scratch {
    shd_afar levels[SHD_AFAR_LEVELS];
    uint32_t *places;     /* [light_count] */
    shd_afar_bunch *cut;  /* [bunches->count]: those that are taken */
    uint32_t *now, *next; /* [bunches->count]: to be looked at */
    uint32_t *taken;      /* [light_count]: bunches, or places */
    shd_far_look *looks;
    uint8_t *steps; /* [light_count] */
    double *gleam;  /* [light_count]: of lights that stay open */
    uint32_t *dull; /* [light_count]: lights that a run is lit by without highlights */
    size_t dull_count;
    uint32_t *parted; /* [2 light_count]: a run's lights (shd_light_lamps32) */
    float **rows;     /* [3]: what they add to a run */
    uint64_t *bits;   /* one a light */
} shd_afar_scratch;

/* For a plan that has bunches, and runs of `points` at most. */
void shd_afar_lay_out(const shd_plan *plan, size_t points, shd_scratch *memory,
                      shd_afar_scratch *out);

/* Takes those lights whose diffuse light is told by out->far, or too faint to count, and whose
 * highlights are too faint, as long as what that leaves out of the material's color at the patch is
 * within most of its room, in any channel. `points`: of the patch. `whole` is what was found of
 * what the patch is part of, or NULL. `out` is one of the scratch's. What is taken depends on the
 * patch, and on what `whole` depends on, alone. `last`: no parts of it are looked at. */
void shd_afar_find(const shd_plan *plan, const shd_plan_material *material, const shd_patch *patch,
                   size_t points, int level, bool last, const shd_afar *whole,
                   shd_afar_scratch *scratch, shd_afar *out);

/* What may still be left out of each channel, as it is. */
double shd_afar_left(const shd_afar *afar);

/* Copies those of lights[0..count) (ascending indices in plan->lights) that are left to `out`, the
 * dull or the other ones, and returns how many there are. */
size_t shd_afar_list(const shd_plan *plan, const shd_afar *afar, bool dull, const uint32_t *lights,
                     size_t count, shd_afar_scratch *scratch, uint32_t *out);
