/* Patterns and pictures of materials, as terms of the radiance.
 *
 * A coefficient low + rise w multiplies a sum of light: low D + rise (w D). So each patterned
 * coefficient, a slot, is one more term of its material, whose sums are w times those of the term
 * that it is of, or w alone for what is constant. Terms are averaged over a pixel's samples and
 * kept as all sums are, and colors multiply them afterwards: another tint casts and lights nothing.
 * A plan's own colors of the material are the larger of both, for what bounds and reductions ask.
 *
 * In spectral scenes a color is lifted to a reflectance, linearly: low is one, and so is what each
 * field adds, a component of rise or all three. There a slot is as many terms as it has fields, and
 * the sums of these are those of further materials, the parts. The plan's own reflectances are the
 * most that there may be in each bin. Constant; any thread. */
#pragma once

#include "plan/plan.h"

typedef enum shd_slot_of { SHD_SLOT_EMISSIVE, SHD_SLOT_AMBIENT, SHD_SLOT_TERM } shd_slot_of;

/* Slot e of a material has the sums of the term 1 + lobe_count + e. */
typedef struct shd_plan_slot {
    shd_slot_of of;
    size_t term;     /* 0: diffuse, 1 + k: lobe k; SHD_SLOT_TERM */
    size_t pattern;  /* in shd_plan_textures.patterns */
    size_t field[3]; /* of each component, counted over all patterns */
    double rise[3];  /* high - low; of ambient times what is ambient */
    /* Spectral scenes: the color that each field adds to what is constant; else 0. */
    double rises[3][3];
    const char *name; /* of a picture */
} shd_plan_slot;

/* The coefficients of rays: shd_coefficients. */
enum { SHD_RAY_OPACITY, SHD_RAY_REFLECTION, SHD_RAY_TRANSMISSION, SHD_RAY_COEFFICIENTS };

typedef struct shd_ray_texture {
    const shd_texture *texture; /* NULL: it is one color */
    double most[3];             /* of it; an opacity's is 1 */
} shd_ray_texture;

typedef struct shd_plan_textures {
    const shd_plan_slot *slots;
    size_t slot_count;
    const shd_pattern *patterns; /* each once */
    size_t pattern_count, field_count;
    const shd_plan_material *low; /* the material in its low colors */
    shd_ray_texture rays[SHD_RAY_COEFFICIENTS];
    bool rayed; /* some of these is one */
    /* What Cook-Torrance's facets mirror at a right angle, which is no factor of their light and so
     * has no sums: where its fields are 0 and 1. NULL: it is one color. */
    const shd_plan_slot *fresnel;
    double f0[2][3];
    bool grey;     /* channels are equal in all of the slots' colors */
    bool negative; /* some color has a component below 0 */
    bool hued;     /* some pattern of a slot gives each component its own field */
    /* Spectral scenes: in plan->materials, the material in its low colors, and then one for each
     * field of a slot; else 0. */
    size_t parts, part_count;
} shd_plan_textures;

/* What is ambient: in RGB, and in spectral scenes what each bin adds to it. */
typedef struct shd_ambience {
    double rgb[3];
    double (*bins)[3]; /* or NULL */
} shd_ambience;

/* Makes the textures of a material whose other members are set; parts will begin at `parts`.
 * False: memory. */
bool shd_plan_textures_make(const shd_plan *plan, const shd_ambience *ambient, size_t parts,
                            shd_arena *arena, shd_plan_material *material);

/* Makes part `part` of a material whose textures are made. False: memory. */
bool shd_plan_part(const shd_plan *plan, const shd_ambience *ambient, size_t part, shd_arena *arena,
                   const shd_plan_material *material, shd_plan_material *out);

/* Gives it its tint, if the plan is tinted. False: memory. */
bool shd_plan_part_tint(const shd_plan *plan, const shd_ambience *ambient, size_t part,
                        shd_arena *arena, const shd_plan_material *material,
                        shd_plan_material *out);

/* The color of a texture in a part: low, or what a field adds. */
static inline void shd_texture_part(const shd_texture *texture, size_t part, double out[3]) {
    const bool all = shd_pattern_fields(&texture->pattern) == 3;
    for (size_t c = 0; c < 3; c++) {
        const bool has = all ? part == 1 + c : part == 1;
        out[c] = part == 0 ? texture->low[c] : has ? texture->high[c] - texture->low[c] : 0;
    }
}

/* The texture of what facets reflect - of microgeometry its color, of Cook-Torrance's fresnel.f0 -
 * which is no factor of their light: that is another one at each point. NULL: there is none. */
static inline const shd_plan_slot *shd_facet_slot(const shd_plan_material *m) {
    const size_t count = m->model == SHD_MODEL_WESTIN && m->textures ? m->textures->slot_count : 0;
    if (m->model == SHD_MODEL_COOK_TORRANCE && m->textures) return m->textures->fresnel;
    for (size_t e = 0; e < count; e++)
        if (m->textures->slots[e].of == SHD_SLOT_TERM) return &m->textures->slots[e];
    return NULL;
}

static inline size_t shd_material_slots(const shd_plan_material *m) {
    return m->textures ? m->textures->slot_count : 0;
}
