/* How large the weights of a model are, and how far off if directions are. Inside of bound/. */
#pragma once

#include "bound/light/pieces.h"

/* What rounding in f64 does to unit vectors that some dozen operations have made, and to the
 * functions of a model. */
static const double SHD_WEIGHT_DIRECTION = 16 * 0x1p-53, SHD_WEIGHT_FUNCTION = 1e-13;

/* The same in f32: directions as a chord, with what N.L is off by; the part of L + V beside N, and
 * that along it; functions. Figures are 1.2 times and more what tests/unit/shade_models32.c has
 * seen. */
static const double SHD_WEIGHT_DIRECTION32 = 3 * 0x1p-24, SHD_WEIGHT_SUM32 = 3 * 0x1p-24,
                    SHD_WEIGHT_FUNCTION32 = 10 * 0x1p-24;

/* A light at a piece, and how the piece is seen. */
typedef struct shd_glance {
    shd_lit lit;
    double direction; /* the error of L, V and N together, as a chord */
    double place;     /* the part of it by which points are beside */
    double view;      /* no N.V that counts is less */
    double half;      /* nor is any V.H */
    double around;    /* by how much the tangent is turned around the normal, in radians */
    bool drifts;      /* directions are off by more than rounding of some operations */
    bool narrow;      /* it is about what f32 does, and not f64 */
    double relative;  /* narrow: the error of the distance and what depends on it */
} shd_glance;

/* Of a light of 1 before attenuation. */
typedef struct shd_weight {
    double most, error;
} shd_weight;

/* Of term 0, the diffuse one, or 1 + lobe. `lights`: how many the scene has. */
shd_weight shd_weight_of(const shd_plan_material *m, size_t term, const shd_glance *g,
                         size_t lights);

/* By how much the weight of a lobe that differs from point to point errs at most by what its
 * exponent or roughness does; 0: it does not. */
double shd_sharpness_error(const shd_plan_material *m, size_t lobe, const shd_glance *g);

/* By how much the integral of a facets' lobe over all directions before the surface, times light of
 * 1 at most, errs where directions do by g->direction: 1 / pi of it, wherever light comes from. */
double shd_facets_turned(const shd_plan_material *m, size_t lobe, const shd_glance *g);
