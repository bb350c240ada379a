/* From sums of light to radiance: what colors multiply. */
#pragma once

#include "plan/plan.h"
#include "render/tiles/paint.h"
#include "shade/lighting.h"

/* What of a material a plane shows. */
typedef struct shd_part {
    bool emissive, ambient;
    double constant[3]; /* of these two */
    shd_terms terms;
} shd_part;

shd_part shd_part_of(const shd_plan *plan, const shd_plan_material *material, size_t plane);

/* The terms of a plane's radiance: what is constant, and the colors that multiply sums of light.
 * `terms` has room for plan->max_terms, and its sums are left to the caller. term_of[k] is the
 * index of the sums of terms[k]: 0 for diffuse, 1 + lobe, and then slots of patterns. Returns their
 * number. */
size_t shd_plane_terms(const shd_plan *plan, const shd_plan_material *material, size_t plane,
                       float constant[3], shd_paint_term *terms, size_t *term_of);

/* The radiance of the exact tier in a plane: the same terms in f64, rounded once. sums[3 * term +
 * channel], out[channel] and weights[pattern] are [count]; `weights` is not read if the material
 * has no patterns. */
void shd_mix_exact(const shd_plan *plan, const shd_plan_material *material, size_t plane,
                   double *const *sums, const double *const *weights, size_t count,
                   float *const out[3]);

/* Adds what patterns do, if `radiance` [channel][count] is that of the material in its low colors.
 */
void shd_add_slots(const shd_plan *plan, const shd_plan_material *material, size_t plane,
                   double *const *sums, const double *const *weights, size_t count,
                   double *const radiance[3]);
