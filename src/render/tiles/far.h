/* Lights of a run of hits that are far enough to be lit as one (shade/far.h). */
#pragma once

#include "base/scratch.h"
#include "shade/far.h"

/* What is found of a patch, and then of the parts that it is of. */
typedef struct shd_afar {
    shd_far far;       /* the lights that are lit as one; lights 0: there are none */
    double room;       /* what may be left out of each channel of the patch's color */
    double spent;      /* what of it is, by these lights and by those of the whole */
    double certain[3]; /* diffuse light that both of them send to all points at least */
    double most;       /* and in any channel at most */
    /* What is left and may reach the patch: places in bunches->lights, and other lights. */
    uint32_t *open, *alone;
    size_t open_count, alone_count;
} shd_afar;

/* One thread's working memory for patches, and for parts of them. */
typedef struct shd_afar_scratch {
    shd_afar whole, part;
    uint32_t *places; /* [light_count] */
    uint32_t *taken;  /* [light_count]: bunches, or places */
    shd_far_look *looks;
    uint64_t *bits; /* one a light */
} shd_afar_scratch;

/* For a plan that has bunches. */
void shd_afar_lay_out(const shd_plan *plan, shd_scratch *memory, shd_afar_scratch *out);

/* Takes those lights whose diffuse light is told by out->far, and whose highlights are too faint to
 * count, as long as what that leaves out of the material's color at the patch is within most of
 * its room, in any channel. `points`: of the patch. `whole` is what was found of what the patch is
 * part of, or NULL. `out` is one of the scratch's. What is taken depends on the patch, and on what
 * `whole` depends on, alone. */
void shd_afar_find(const shd_plan *plan, const shd_plan_material *material, const shd_patch *patch,
                   size_t points, const shd_afar *whole, shd_afar_scratch *scratch, shd_afar *out);

/* Copies those of lights[0..count) (ascending indices in plan->lights) that are left to `out`, and
 * returns how many there are. */
size_t shd_afar_list(const shd_plan *plan, const shd_afar *afar, const uint32_t *lights,
                     size_t count, shd_afar_scratch *scratch, uint32_t *out);
