/* What a pattern or a picture is to a footprint on a surface's chart: its mean over it. */
#pragma once

#include "shade/wave.h"

/* The mean of a pattern's field over a footprint of the chart (u, v), in [0, 1]. Checkers, grids
 * and gradients are filtered exactly (wave.h). An octave of noise fades where the footprint is
 * wider than its cells, and a long footprint is walked along in up to 16 steps. Not finite: 1/2.
 * Any thread. */
double shd_pattern_mean(const shd_pattern *pattern, const shd_footprint *uv);

/* The variance of a pattern's field over a footprint where `mean` is its mean, of which there is no
 * more than mean (1 - mean). Checkers and grids, which are 0 or 1, have that; gradients have their
 * own, exactly. Noise has what is expected of a footprint of that size anywhere, to some 10
 * percent. Not finite: the most. Any thread. */
double shd_pattern_variance(const shd_pattern *pattern, const shd_footprint *uv, double mean);

/* The means of all of its fields (shd_pattern_fields), a picture's as picture.h has them. */
void shd_pattern_means(const shd_pattern *pattern, const shd_footprint *uv, double out[3]);

/* All four channels of a picture. */
void shd_texture_mean(const shd_pattern *picture, const shd_footprint *uv, double out[4]);
