/* Lights that lie together, so that what is far from all of them sees them as one: a forest, whose
 * trees are of lights that fall off alike. Bunches tell where their lights are by moments, up to
 * the fifth degree. Made for plans that may leave something out, see shade/far.h. */
#pragma once

#include "plan/plan.h"

enum {
    SHD_BUNCHES_LEAST = 64, /* lights of a plan that has bunches; fewer are lit as fast */
    SHD_BUNCH_MOMENTS = 56,
    SHD_FALLS = 8 /* kinds of attenuation that have trees */
};

/* Monomials of degree g in (x, y, z) are x^(g - r) y^(r - z) z^z at r (r + 1) / 2 + z, whatever g
 * is: a factor x changes no place, y adds 1 to r, and z adds 1 to both. Lower degrees come first.
 */
static inline size_t shd_monomial(int r, int z) {
    return (size_t)(r * (r + 1) / 2 + z);
}

/* How many monomials there are of lower degrees than g, with that of degree 0. */
static inline size_t shd_monomials_below(int g) {
    return (size_t)(g * (g + 1) * (g + 2) / 6);
}

typedef struct shd_bunch {
    shd_vec3 center; /* of a sphere around the lights; world frame */
    double radius;
    double strength[3];  /* the sum of the lights' colors times their gains, over that of `fall` */
    uint32_t first, end; /* in shd_bunches.lights */
    uint32_t parts;      /* the first of two in the list; 0: it is a leaf */
    uint32_t fall;       /* in shd_bunches.falls */
    /* By channel, sums of the same weights times monomials of center - light, each divided by the
     * factorials of its exponents. Of plans whose lights are all grey only the first one. They lie
     * apart from what tells whether a bunch is taken at all. */
    double (*moments)[SHD_BUNCH_MOMENTS];
} shd_bunch;

/* What is looked at of a light, or of a bunch. */
typedef struct shd_bunch_row {
    shd_vec3 position;
    double gain, color[3], radius; /* 0: it is one light */
    double a, b, c, least;         /* of its attenuation: 1, 0, 0 and 0 if it has none */
} shd_bunch_row;

typedef struct shd_bunches {
    size_t count, roots; /* roots come first, and parts after what they are parts of */
    shd_bunch *list;
    size_t light_count;
    uint32_t *lights; /* indices in plan->lights, and those of `alone` after them: of all lights */
    /* Of each of these, in their order; and [count], of the list's: the same of a light in the
     * center that has their strength, and their radius. */
    shd_bunch_row *rows, *wholes;
    /* How lights of a tree fall off: a light without a place, whose gain is the largest of them. */
    shd_plan_light falls[SHD_FALLS];
    size_t leaves;
    /* Lights that are in no tree: directional ones, spots, those of other attenuations, and those
     * with a color below 0. */
    uint32_t *alone;
    size_t alone_count;
} shd_bunches;

/* Monomials of s up to the fifth degree, each divided by the factorials of its exponents. */
void shd_moments(shd_vec3 s, double out[SHD_BUNCH_MOMENTS]);

/* How many there are that are not divided further, and lights in no bunch. */
static inline size_t shd_bunches_groups(const shd_bunches *bunches) {
    return bunches->leaves + bunches->alone_count;
}

/* False: memory, or cancelled. */
bool shd_bunches_new(const shd_plan *plan, shd_arena *arena, const shd_bunches **out);
