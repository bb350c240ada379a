/* Integrals over a region's inside. Only for shade/. */
#pragma once

#include "shade/area.h"
#include "shade/area_seen.h"

/* Adds the integral of the weights dw to the row, by cells that are halved until they are good.
 * They meet in the direction `peak` if the region has it, which is where weights should be
 * steepest. Returns an estimate from above of the error. */
double shd_cells_sum(const shd_seen *seen, shd_vec3 peak, const shd_area_model *model, double *row);

/* The same by fixed points on the shape's plane, for a region so small that f is almost linear in
 * it. Differences are exact there that boundary integrals lose. */
void shd_cells_small(const shd_seen *seen, const shd_area_model *model, double *row);

/* Adds the sum over a rectangle or a circle of which nothing is cut off, by as few points as are
 * within 1e-9 of the largest that it can be: 4 of tiny ones, 36 at most. `off` tells how much the
 * weights vary: what the shape would be off as a point at most. The weights have no kink in it.
 * False: something is cut off, or they vary too much, and the row is as it was. */
bool shd_cells_whole(const shd_seen *seen, double off, const shd_area_model *model, double *row);

/* Appends a direction, which has one weight. */
static inline void shd_add_way(shd_ways *ways, shd_vec3 toward, double weight) {
    const size_t i = ways->points++;
    ways->toward[0][i] = toward.x;
    ways->toward[1][i] = toward.y;
    ways->toward[2][i] = toward.z;
    ways->weight[0][i] = weight;
}

/* Adds the sums over appended directions to the row, and begins anew. */
void shd_sum_row(const shd_area_model *model, shd_ways *ways, double *row);
