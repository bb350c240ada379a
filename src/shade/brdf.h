/* The models of reflection: what of light from one direction goes to the viewer, in f64.
 *
 * Light of Il from the unit direction L adds pi f_r (N.L)+ Il. That is a sum over the terms of a
 * material of color times weight, and the weights are what is computed here: they hold no color but
 * Fresnel's reflectance. With a lobe's exponent n or roughness m, and H = (L + V) / |L + V|:
 *
 * - Phong: (N.L)+ and (R.V)+^n. Blinn-Phong: (N.H)+^n (J. Blinn, Models of Light Reflection for
 *   Computer Synthesized Pictures, 1977).
 * - Phong, normalized: pi (R.V)+^n N.L / E(N.L, n), where E is the integral of (R.V)+^n (N.V)+ over
 *   the hemisphere of V (I. Mallett and C. Yuksel, Constant-Time Energy-Normalization for the Phong
 *   Specular BRDF, The Visual Computer 2020). A lobe of 1 sends on all light, from any angle.
 * - Oren-Nayar: (N.L)+ (A + B s), s = max(0, L.V - N.L N.V) / max(N.L, N.V), A = 1 - sigma^2 / (2
 *   (sigma^2 + 0.33)), B = 0.45 sigma^2 / (sigma^2 + 0.09): the qualitative model of M. Oren and S.
 *   Nayar, Generalization of Lambert's Reflectance Model, 1994. At grazing light
 *   it sends on A + B / 2, which is up to 1.0155 (sigma of 11 degrees).
 * - Cook-Torrance: F D G / (4 N.V), D = exp(-tan^2 / m^2) / (m^2 cos^4) of the angle between N and
 *   H (Beckmann), G = min(1, 2 N.H N.V / V.H, 2 N.H N.L / V.H), F by Fresnel at V.H (R. Cook and K.
 *   Torrance, A Reflectance Model for Computer Graphics, 1982). The paper has pi where 4 stands in
 * f_r = F D G / (4 pi N.L N.V), which would send on up to four times the light that arrives; with
 * 4, D / pi counts facets of unit area (B. Walter et al., Microfacet Models for Refraction, 2007,
 * eq. 20).
 *
 * Where N.L <= 0 all is 0. Where N.V <= 0, which interpolated normals may have, facets are not
 * seen, and Oren-Nayar takes N.V for 0. */
#pragma once

#include "shade/lighting.h"

enum { SHD_BRDF_ROWS = 3 + 3 * (1 + SHD_LOBES_MOST) };

/* The weights of light from the unit vector `toward`: row[c] of the diffuse term, row[3 + 3 k + c]
 * of lobe k, for each channel c. False: all are 0, and nothing is written. Any thread. */
bool shd_brdf_weigh(const shd_surface *at, shd_vec3 toward, double row[SHD_BRDF_ROWS]);

/* Fits E for the kernels. */
struct shd_packed_energy;
void shd_fit_phong_energy(double shininess, struct shd_packed_energy *out);

/* E(N.L, n), the integral of (R.V)+^n (N.V)+ over the hemisphere: N.L in [0, 1], n >= 0. Relative
 * error 1e-12. */
double shd_phong_energy(double facing, double shininess);
