/* The share of light from a direction that a material sends on: the integral of f_r (N.V) over the
 * hemisphere of V, by adaptive quadrature of each term where it is: Phong's lobes around R, those
 * of half vectors over H, cut where Cook and Torrance's G bends and at the horizon. */
#pragma once

#include "render/tell/reflectance.h"

/* For light at the angle `polar` from the normal, in [0, pi/2), by the material and the object of
 * `of`. `tolerance` is absolute, of each term; 1e-11 is met by all models but Westin's, whose table
 * is not smooth. *error is what a channel may be off by, as quadrature estimates it. False:
 * cancelled. */
bool shd_albedo_find(const shd_reflectance *of, double polar, double tolerance, double share[3],
                     double *error);

/* How wide the material's narrowest lobe is, in radians, in the angle from R or of H from N: there
 * it has fallen to about 1/e. At most 1. */
double shd_lobe_width(const shd_plan_material *material);
