/* What a picture is to a footprint: its mean over it, found on the levels of its pyramid.
 *
 * The footprint is covered by a grid of points, and levels are interpolated linearly at each of
 * them, so that a texel is a tent two texels wide. Points are as far apart as the texels of a level
 * that are half as wide as the footprint is in its narrow direction, or 1/32 of its length if that
 * is more; the two levels whose sizes are next to that are mixed. So a long footprint is walked
 * along rather than blurred across. Footprints smaller than a texel see the picture itself, and
 * nothing jumps where levels and points come and go.
 *
 * All of it is f64, without functions of the C library that differ: every machine has the same
 * bits. Any thread. Source: after McCormack et al., "Feline: Fast Elliptical Lines for Anisotropic
 * Texture Mapping" (1999), with a box for the ellipse. */
#pragma once

#include "base/pyramid.h"
#include "shade/wave.h"

/* The mean of each channel, within the least and the most that the picture has. `f` is in units of
 * the picture, (0, 0) its lower left corner and (1, 1) its upper right one; its numbers are below
 * 2^40. */
void shd_picture_mean(const shd_pyramid *picture, shd_wrap wrap, const shd_footprint *f,
                      double out[4]);

/* The mean of the whole picture. */
void shd_picture_whole(const shd_pyramid *picture, double out[4]);
