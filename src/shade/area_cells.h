/* Integrals over a region's inside. Only for shade/. */
#pragma once

#include "shade/area.h"
#include "shade/area_seen.h"

/* Adds the integral of f(L) dw to row[0..count), by cells that are halved until they are within
 * 1e-6 of the largest row, about. The cells meet in the direction `peak` if the region has it,
 * which is where f should be steepest. Returns an estimate from above of the error. */
double shd_cells_sum(const shd_seen *seen, shd_vec3 peak, shd_area_function *f, const void *context,
                     size_t count, double *row);

/* The same by fixed points on the shape's plane, for a region so small that f is almost linear in
 * it. Differences are exact there that boundary integrals lose. */
void shd_cells_small(const shd_seen *seen, shd_area_function *f, const void *context, size_t count,
                     double *row);
