/* The same integral as around.h's, by as few values of the lobe as a share of it asks for.
 *
 * Blocks of the map (moments.h) are looked at twice. First from large to small ones, as far as the
 * lobe's width: that tells which part of the lobe's peak each block has at most and at least, and
 * so what the sum is at least. Then each counts by the fewest nodes with which what it may be off
 * is nothing beside that sum, or beside its own share: blocks that hold little light, or where the
 * lobe is faint, count by few, and those that are next to nothing are left out. Blocks that the
 * horizon or a kink of the lobe goes through, and others for which no nodes are enough, are halved
 * both ways, and at last are cells between texels and parts of them.
 *
 * Looks are at many places at once, in f32 (around_look.h), and nodes are summed in f32 where that
 * holds them (ways32.h). Every value is of this point alone, and the same bits on every machine.
 *
 * The sum is off by at most a share of itself, in each channel of the map, and a floor: where a
 * plan asks, SHD_QUICK_SHARE and SHD_QUICK_FLOOR of the most that the map adds (plan/tier.h). That
 * is measured: what blocks are taken to be off follows from the derivatives of a normal
 * distribution as wide as the lobe. Any thread. It cannot fail. */
#pragma once

#include "shade/around.h"

/* Adds to out[row][k] as shd_around_sum does. `share`: of itself, that the sum may be off; `floor`:
 * what of the sum counts as nothing. */
void shd_around_sum_quickly(const shd_surroundings *map, const shd_moments *moments,
                            const shd_around_lobe *lobe, const shd_around_function *f, double share,
                            double floor, double (*out)[SHD_WAY_SUMS]);
