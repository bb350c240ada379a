/* Blocks of pixels through which one smooth surface is seen, and how it bends there. */
#pragma once

#include "plan/bend.h"
#include "sight/sight.h"

/* True: all rays through the survey's block, whichever of its 8 x 8 pixels are in the picture, hit
 * one ball or ellipsoid from outside or one plane, which `out` then tells of, and `rays` (or NULL)
 * of the rays. False: another thing is seen, or it is not known. It takes some 100 ns. The
 * derivatives' proof is in bend.c. */
bool shd_sight_bend(const shd_sight *sight, const shd_survey *survey, size_t block, shd_bend *out,
                    shd_block_rays *rays);

/* Whether the block's rays all miss the ellipsoid that alone may be seen through it: surveys know
 * the ball around it. */
bool shd_sight_misses(const shd_sight *sight, const shd_survey *survey, size_t block);

/* A quarter of a block, from left to right and down, from 0 on, or all of it. */
enum { SHD_QUARTERS = 4, SHD_WHOLE = 4 };

/* The same of complex places around the block's part. */
bool shd_sight_expand(const shd_sight *sight, const shd_survey *survey, size_t block, int part,
                      shd_analytic *out);

/* The object that alone may be seen through a block, and the block's middle in the picture. */
typedef struct shd_middle {
    size_t object;
    double x, y;
} shd_middle;

/* NULL: others may be seen, or it is neither a ball nor a plane. */
const struct shd_item *shd_sight_only(const shd_sight *sight, const shd_survey *survey,
                                      size_t block, shd_middle *out);

/* Whether nothing is seen through a part of a block through which one object may be. */
bool shd_sight_is_empty(const shd_sight *sight, const shd_survey *survey, size_t block, int part);

/* Of the pattern of so many samples a pixel. */
shd_pattern_spread shd_spread_of(int samples);
