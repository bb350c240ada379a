/* The light of an object is a sum of terms: so much of each as the point has. Inside of bound/. */
#pragma once

#include "bound/light/excess.h"

/* Lights whose colors are multiples of each other share a hue. */
typedef struct shd_hues {
    size_t count;
    double (*color)[3]; /* [count]: the sum of the components' sizes is 1, or 0 for black */
    /* [count]: hues are lumps of such hues, of which `color` is the most, and this the least; NULL:
     * they are not. */
    double (*least)[3];
    uint32_t *of_light; /* [plan->light_count] */
    double *strength;   /* [plan->light_count]: hue times strength is the color's absolute value */
    bool negative;      /* some light has a component below 0 */
} shd_hues;

/* Mixtures of more terms than this are not looked at. */
enum { SHD_MOST_MIXED = 40 };

/* The constant term comes first. A light has the term `first[hue]` for its diffuse light, and those
 * behind it for the highlight of each lobe. */
typedef struct shd_terms {
    size_t count;
    shd_term *list; /* [1 + hues (1 + max_lobes)] */
    /* As `list`: the least color of each term, of lumps. NULL: there are none, and a term has one
     * color. */
    double (*least)[4];
    uint32_t *first; /* [hues]; 0: the object has no light of the hue */
    bool negative;   /* the material has a component below 0 */
    shd_parts parts; /* of all terms */
    size_t mixed;    /* how many terms are not black; 0: more than SHD_MOST_MIXED */
    uint32_t mixed_list[SHD_MOST_MIXED];
    uint8_t order[3][SHD_MOST_MIXED]; /* for each channel: `mixed_list` by its part, most first */
} shd_terms;

/* Finds the hues, and makes room for the terms of any object. With `lump`, there are few of them in
 * any case. False: memory. */
bool shd_terms_new(const shd_plan *plan, bool lump, shd_arena *arena, shd_hues *hues,
                   shd_terms *out);

/* Sets the terms of a group's objects. */
void shd_terms_set(const shd_plan *plan, const shd_hues *hues, const shd_plan_group *group,
                   shd_terms *to);

/* Finds the parts that sums of terms may have if there is [low, high] of each: `all` of the sums,
 * and `gain` of what these have above the sum of the lows, which is the argument `low`. False:
 * there are too many terms, or none. */
bool shd_terms_mix(const shd_terms *terms, const shd_much *much, const double low[3],
                   shd_parts *all, shd_parts *gain);

/* Widens parts by a color's. Black has none. */
void shd_parts_note(shd_parts *parts, const double color[3]);

static const shd_parts SHD_NO_PARTS = {
    .least = {INFINITY, INFINITY, INFINITY},
    .most = {0, 0, 0},
};

static inline bool shd_is_negative(const double color[3]) {
    return color[0] < 0 || color[1] < 0 || color[2] < 0;
}
