/* Integrals over a region of directions along its boundary: see shade/area.h. Only for shade/. */
#pragma once

#include "shade/area_seen.h"

/* The integral of N.L dw over a region that is before N: Lambert's formula. Closed form. */
double shd_contour_diffuse(const shd_seen *seen, shd_vec3 normal);

/* The integral of (L.W)^n dw over a region that is before W. *error gets an estimate from above of
 * the quadrature's error, 0 for the closed form. */
double shd_contour_lobe(const shd_seen *seen, shd_vec3 mirror, double exponent, double *error);

/* Integer exponents up to this have the closed form if the region is a polygon. */
enum { SHD_MOMENTS_MOST = 96 };

bool shd_has_moments(double exponent);
