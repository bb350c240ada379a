/* What an environment adds by a lobe that is not symmetric around a direction: of Blinn's, the
 * normalized and Cook and Torrance's model, and Oren and Nayar's diffuse light; and by a lobe of
 * Phong's for whose exponent there is no table.
 *
 * The weight of a row is 1/pi integral of v(L) f(L) dw over the half sphere N.L > 0, with f what
 * shade/brdf.h gives and v the map's radiance. The map is walked from large blocks to small ones
 * (moments.h). A block counts by f at its 16 nodes where f is smooth over it: where the block is a
 * part of the lobe's width there, larger where the lobe is faint; before the horizon; and beside
 * the kinks of f. Else smaller blocks count, and at last cells between texels, by Gauss' rule, in
 * which the horizon is cut exactly.
 *
 * What is left out or off is below SHD_AROUND_TOLERANCE (plan/tier.h) of the most that the map
 * adds: tests hold it against sums over all texels. Any thread. It cannot fail. */
#pragma once

#include "shade/area.h"
#include "shade/moments.h"
#include "shade/ways32.h"

/* Directions are unit, in the map's frame. */
typedef struct shd_around_lobe {
    shd_model model;
    double sharpness; /* the exponent, or the roughness; of Oren-Nayar nothing */
    shd_vec3 normal, view, mirror;
} shd_around_lobe;

/* Whether f is not 0 before it is cut by the horizon. */
static inline bool shd_ends_as_off_a_cliff(shd_model model) {
    return model == SHD_MODEL_BLINN_PHONG || model == SHD_MODEL_PHONG;
}

/* What f is of many directions; each of them may be below the horizon by rounding. */
typedef struct shd_around_function {
    shd_area_sum_function *sum;
    const void *context;
    size_t rows;
    shd_isa isa; /* of quick walks */
    /* The same in f32 (ways32.h), for quick walks; NULL: f32 does not hold it. */
    const shd_way_point *point;
} shd_around_function;

/* Adds to out[row][k] the integral of channel k of the map times the row, over pi. `moments` are
 * the map's, or NULL: every cell is looked at, which takes longer. */
void shd_around_sum(const shd_surroundings *map, const shd_moments *moments,
                    const shd_around_lobe *lobe, const shd_around_function *f,
                    double (*out)[SHD_WAY_SUMS]);
