/* From sums of light to radiance: what colors multiply. */
#pragma once

#include "plan/textures.h"
#include "render/tiles/paint.h"
#include "shade/lighting.h"

/* What of a material a plane shows. */
typedef struct shd_part {
    bool emissive, ambient;
    double constant[3]; /* of these two */
    shd_terms terms;
} shd_part;

shd_part shd_part_of(const shd_plan *plan, const shd_plan_material *material, size_t plane);

/* Whether a part has a slot's term. */
bool shd_has_slot(const shd_part *part, const shd_plan_slot *slot);

/* The terms of a plane's radiance: what is constant, and the colors that multiply sums of light.
 * `terms` has room for plan->max_terms, and its sums are left to the caller. term_of[k] is the
 * index of the sums of terms[k]: 0 for diffuse, 1 + lobe, and then slots of patterns. Returns their
 * number. */
size_t shd_plane_terms(const shd_plan *plan, const shd_plan_material *material, size_t plane,
                       float constant[3], shd_paint_term *terms, size_t *term_of);

/* Light on points in the exact tier: sums[3 * term + channel], and in spectral scenes the same of
 * each part of a material with patterns, one behind the other (plan/textures.h). */
void shd_sum_exactly(const shd_lighting *lighting, const shd_plan *plan,
                     const shd_plan_material *material, const uint32_t *which, size_t lights,
                     const shd_points64 *points, double *const *sums);

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
