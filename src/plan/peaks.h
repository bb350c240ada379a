/* The most that the weights of models can be. */
#pragma once

#include "plan/plan.h"

/* A term's weights (shade/brdf.h) of light of 1. */
typedef struct shd_peak {
    double most;  /* from any one direction; infinite: there is no limit at grazing views */
    double whole; /* 1 / pi of the integral over all directions before the surface */
} shd_peak;

/* Term 0 is the diffuse one, 1 + k lobe k. Proofs are in peaks.c. */
shd_peak shd_peak_of(const shd_plan_material *m, size_t term);

/* The most that light with a shape, no point of which is nearer than `nearest`, makes of it. */
double shd_shape_most(const shd_light *shape, const shd_peak *peak, double nearest);

/* How points see a light with a shape, and are seen. */
typedef struct shd_stance {
    double nearest; /* no point of the light is nearer */
    double view;    /* no N.V is less, but for those that do not count; 0: it may be any */
    double half;    /* nor is any V.H, by any direction L to the light */
} shd_stance;

/* The same of a term whose light is summed over directions, from there. */
double shd_shape_most_at(const shd_light *shape, const shd_plan_material *m, size_t term,
                         const shd_stance *at);

/* The most that facets of Cook and Torrance's model mirror in any channel or bin of light that they
 * meet at a V.H of `half` or more. */
double shd_mirrored_most(const shd_plan_material *m, double half);

/* (1 + x)^2 e^(-x / m^2) / m^2 at most, over all x = tan^2 of an angle: Beckmann's distribution
 * times pi. */
double shd_facets_most(double roughness);
