/* Light sums of extended scenes (shd_plan.extended): every model, every light, with shadows, in
 * f64, one light at one point at a time. Only for shade/. */
#pragma once

#include "shade/brdf.h"
#include "shade/packed.h"

/* The weights of a light at a point, for each channel: row[c] those of the diffuse term, row[3 + 3
 * k + c] those of lobe k. They hold neither the light's color nor the material's, but what of the
 * material is no factor (Fresnel's reflectance). `kernels` (or NULL: nothing is in vectors) sums
 * models over lights with a shape. False: the light adds nothing. */
bool shd_weigh_extended(const shd_plan *plan, const shd_lighting *kernels,
                        const shd_plan_light *light, const shd_surface *at,
                        double row[SHD_BRDF_ROWS]);

/* Adds to sums[SHD_BRDF_ROWS] what those weights send on of the light's color, times the share of
 * each channel that arrives. In spectral scenes, the colors are those of the materials, too. */
void shd_color_extended(const shd_plan *plan, const shd_lighting *kernels,
                        const shd_plan_light *light, const shd_surface *at,
                        const double row[SHD_BRDF_ROWS], const double share[3], double *sums);

/* Whether kernels can sum lights on the material: what the model needs of them is kept, and shadows
 * (if there are any) leave a share of each channel, not of each bin. */
bool shd_has_kernel(const shd_lighting *lighting, const shd_plan_material *material);

/* Adds one light at one point to sums[SHD_BRDF_ROWS]. */
void shd_add_extended(const shd_lighting *lighting, const shd_plan_material *material,
                      uint32_t index, const shd_points64 *points, size_t point, double *sums);

/* As shd_light_sums64. */
void shd_extended_sums(const shd_lighting *lighting, const shd_plan_material *material,
                       const uint32_t *which, size_t n, const shd_points64 *points,
                       double *const diffuse[3], double *const *specular);
