/* What a picture is to a footprint: its mean over it, found on the levels of its pyramid.
 *
 * The footprint is covered by a grid of points, no farther apart than the texels of a level, and
 * the level is interpolated linearly at each (so that a texel is a tent two texels wide). The level
 * is the one whose texels are half as wide as the footprint is in its narrow direction, or no
 * narrower than 1/32 of its length, mixed of the two whose sizes are next to that; with footprints
 * smaller than texels it is the picture itself. A long footprint is walked along rather than
 * blurred across. All of it is f64 without functions of the C library that differ, so that every
 * machine has the same bits. Any thread. */
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
