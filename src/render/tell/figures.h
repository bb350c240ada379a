/* The figures of a material: its albedo, whether it keeps energy, is reciprocal, is bounded. */
#pragma once

#include "render/tell/reflectance.h"

/* Fills all figures of an object's material. False: cancelled. It takes some 100 ms of a processor.
 */
bool shd_reflectance_find(const shd_plan *plan, size_t object, shd_reflectance *out);
