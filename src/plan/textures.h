/* Patterns and pictures of materials, as terms of the radiance.
 *
 * A coefficient low + rise w multiplies a sum of light: low D + rise (w D). So each patterned
 * coefficient, a slot, is one more term of its material, whose sums are w times those of the term
 * that it is of, or w alone for what is constant. Terms are averaged over a pixel's samples and
 * kept as all sums are, and colors multiply them afterwards: another tint casts and lights nothing.
 * A plan's own colors of the material are the larger of both, for what bounds and reductions ask.
 * Constant; any thread. */
#pragma once

#include "plan/plan.h"

typedef enum shd_slot_of { SHD_SLOT_EMISSIVE, SHD_SLOT_AMBIENT, SHD_SLOT_TERM } shd_slot_of;

/* Slot e of a material has the sums of the term 1 + lobe_count + e. */
typedef struct shd_plan_slot {
    shd_slot_of of;
    size_t term;      /* 0: diffuse, 1 + k: lobe k; SHD_SLOT_TERM */
    size_t pattern;   /* in shd_plan_textures.patterns */
    size_t field[3];  /* of each component, counted over all patterns */
    double rise[3];   /* high - low; of ambient times what is ambient */
    const char *name; /* of a picture */
} shd_plan_slot;

typedef struct shd_plan_textures {
    const shd_plan_slot *slots;
    size_t slot_count;
    const shd_pattern *patterns; /* each once */
    size_t pattern_count, field_count;
    const shd_plan_material *low; /* the material in its low colors */
    const shd_texture *opacity;   /* NULL: it is one color */
    bool grey;                    /* channels are equal in all of their colors */
    bool negative;                /* some color has a component below 0 */
    bool hued;                    /* some pattern gives each component its own field */
} shd_plan_textures;

/* Makes the textures of a material whose other members are set. `ambient`: what is ambient. False:
 * memory. */
bool shd_plan_textures_make(const double ambient[3], shd_arena *arena, shd_plan_material *material);

static inline size_t shd_material_slots(const shd_plan_material *m) {
    return m->textures ? m->textures->slot_count : 0;
}
