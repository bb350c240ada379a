/* Sums over lights of how bright a place of an object is, and how far off that may be. Inside of
 * bound/. */
#pragma once

#include "bound/light/weights.h"
#include "plan/peaks.h"

typedef struct shd_lit_errors {
    const shd_plan *plan;
    const shd_plan_material *material;
    shd_place place;
    const double *noise; /* of the material's microgeometry, for estimates; NULL: there is none */
    bool estimated;      /* the errors are those that quadrature and simulation aim at: no bound */
    /* Only what tiers sum environments otherwise for counts: what the exact tier's and others'
     * sums differ by at the same points, but for the share of themselves (shd_quick_share). */
    bool only_sums;
    double most[3], error[3]; /* of each channel, added up */
} shd_lit_errors;

/* Sets f->most to what the object shows without lights, from any side. */
void shd_begin_errors(shd_lit_errors *f, const shd_object *object);

/* Adds a light that is a point, on all terms. */
void shd_add_terms(shd_lit_errors *f, const shd_plan_light *light, const shd_glance *g);

/* Adds what f32 does to it, over f64. */
void shd_add_narrow_terms(shd_lit_errors *f, const shd_plan_light *light, const shd_glance *g);

/* Adds a light with a shape, as seen from points that are where they should be. */
void shd_add_shape(shd_lit_errors *f, const shd_plan_light *light, const shd_stance *at);

/* Adds an environment, whose light comes from everywhere: of the glance only what tells of the view
 * counts. */
void shd_add_environment(shd_lit_errors *f, const shd_plan_light *light, const shd_glance *g);

/* Adds what the share of a light with a shape is off by that shadows leave, where directions to its
 * points, lengths and normals are off by `off` together. */
void shd_add_share(shd_lit_errors *f, const shd_plan_light *light, const shd_stance *at,
                   double off);

/* The same as shd_add_shape where points and directions are off. */
void shd_add_drifted_shape(shd_lit_errors *f, const shd_plan_light *light, const shd_glance *g);

/* Adds four standard errors of what was simulated. */
void shd_add_noise(shd_lit_errors *f, const shd_piece *piece, const shd_plan_light *light);
/* The share that shadows leave of a light with a shape is bounded where the mean of (N.L)+ times
 * the light's cosine is this or more. */
static const double SHD_LEAST_SHARED = 1e-4;
