/* What a pattern is to a footprint on a surface's chart: its mean over it. */
#pragma once

#include "shade/wave.h"

/* The mean of the field over a footprint of the chart (u, v), in [0, 1]. Checkers, grids and
 * gradients are filtered exactly (wave.h). An octave of noise fades where the footprint is wider
 * than its cells, and a long footprint is walked along in up to 16 steps. Not finite: 1/2. Any
 * thread. */
double shd_pattern_mean(const shd_pattern *pattern, const shd_footprint *uv);
