/* The sample pattern. */
#pragma once

/* Where ray i of n (1 to 64) goes through the pixel, in [0,1)^2 from its top left. The rays are n
 * rooks: x = (i + 1/2)/n and y = (k + 1/2)/n with rows k from a table. The table's rows err least
 * on straight edges of any direction and place (tests/bench/patterns.c). Their mean is the centre.
 * Four are a rotated grid; 64 have one in each cell of a regular grid. */
void shd_sample_offset(int i, int n, double *x, double *y);
