/* How far highlights may be widened by what surfaces bend within a pixel (shade/bend.h). Kernels
 * and bounds share these. */
#pragma once

#include <math.h>

#include "plan/plan.h"

/* No more than this is added to a roughness squared (Tokuyoshi and Kaplanyan: 0.18); lobes around
 * W, which turns twice as far as normals do, have four times that, as their own roughness is to one
 * around N.H. */
static const double SHD_WIDENED_MOST = 0.18;

static inline bool shd_turns_twice(shd_model model) {
    return model == SHD_MODEL_PHONG || model == SHD_MODEL_PHONG_NORMALIZED;
}

/* The most that the sum of both variances is. */
static inline double shd_spread_most(shd_model model) {
    return (shd_turns_twice(model) ? 4 : 1) * SHD_WIDENED_MOST;
}

/* Nearer to the silhouette a pixel does not reach farther along the surface. */
static const double SHD_BENT_STEEPEST = 0.05;

/* Exponents are not lowered below 1, where the edge at R.V = 0 begins to be steep. */
static const double SHD_BLUNTEST = 1;

/* Maps of normals make facets no rougher than this (shade/bump.h). */
static const double SHD_ROUGHEST = 1;

/* The exponent, or roughness, of a lobe of such a variance. */
static inline double shd_sharpness_at(shd_model model, double variance) {
    return model == SHD_MODEL_COOK_TORRANCE ? sqrt(2 * variance) : 1 / variance - 2;
}

static inline double shd_variance_of(shd_model model, double shininess) {
    return model == SHD_MODEL_COOK_TORRANCE ? shininess * shininess / 2 : 1 / (shininess + 2);
}

/* The other end of what surfaces that bend make of a lobe. */
static inline double shd_widest_of_bent(shd_model model, double shininess) {
    const double most = shd_variance_of(model, shininess) + shd_spread_most(model) / 2,
                 widest = shd_sharpness_at(model, most);
    if (model == SHD_MODEL_COOK_TORRANCE) return widest;
    return widest > SHD_BLUNTEST ? widest : shininess < SHD_BLUNTEST ? shininess : SHD_BLUNTEST;
}

/* The least exponent, or the most roughness, that a pattern gives a material's lobe. */
static inline double shd_dullest(const shd_plan_material *m, size_t lobe) {
    if (!m->gloss) return m->lobes[lobe].shininess;
    return m->model == SHD_MODEL_COOK_TORRANCE ? m->gloss[lobe].most : m->gloss[lobe].least;
}

/* The other end of what a material's lobe may become anywhere: by a pattern, then by a map of
 * normals, and then by how its objects bend. */
static inline double shd_widest(const shd_plan_material *m, size_t lobe) {
    double widest = shd_dullest(m, lobe);
    if (m->normal)
        widest = m->model == SHD_MODEL_COOK_TORRANCE
                     ? (widest > SHD_ROUGHEST ? widest : SHD_ROUGHEST)
                     : (widest < SHD_BLUNTEST ? widest : SHD_BLUNTEST);
    return m->antialiased ? shd_widest_of_bent(m->model, widest) : widest;
}
