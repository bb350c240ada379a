/* Blocks of pixels through which one smooth surface is seen, and how it bends there. */
#pragma once

#include "plan/bend.h"
#include "plan/rim.h"
#include "sight/sight.h"

/* True: all rays through the survey's block, whichever of its 8 x 8 pixels are in the picture, hit
 * one ball or ellipsoid from outside or one plane, before all else, which `out` then tells of, and
 * `rays` of the rays. False: another thing is seen, or it is not known. It takes some 100 ns. The
 * same of so many `blocks` each way at once, from that one to the right and down, which is only
 * known where nothing else may be seen in them. The derivatives' proof is in bend.c. */
bool shd_sight_bend(const shd_sight *sight, const shd_survey *survey, size_t block, int blocks,
                    shd_bend *out, shd_block_rays *rays);

/* The same where rays may miss a ball, which is the only thing that may be seen. False, too: it is
 * too small in the picture. */
bool shd_sight_rim(const shd_sight *sight, const shd_survey *survey, size_t block, shd_rim *out,
                   shd_block_rays *rays);

/* Whether nothing can be seen through the block but balls too small for sketches (plan/bend.h). */
bool shd_sight_has_small_balls(const shd_sight *sight, const shd_survey *survey, size_t block);

/* Whether the block's rays all miss the ellipsoid that alone may be seen through it: surveys know
 * the ball around it. */
bool shd_sight_misses(const shd_sight *sight, const shd_survey *survey, size_t block);

/* A quarter of a block, from left to right and down, from 0 on, or all of it. */
enum { SHD_QUARTERS = 4, SHD_WHOLE = 4 };

/* The same of complex places around the block's part. Others may be behind what the rays hit. */
bool shd_sight_expand(const shd_sight *sight, const shd_survey *survey, size_t block, int part,
                      shd_analytic *out);

/* What may be seen through a part of a block, and the depth, along the camera's axis, before which
 * no ray through it meets that. */
typedef struct shd_seen {
    uint32_t object;
    double nearest;
} shd_seen;

enum { SHD_SEEN_MOST = 4, SHD_SEEN_MANY };

/* Lists these. Returns how many there are, or SHD_SEEN_MANY. */
size_t shd_sight_seen(const shd_sight *sight, const shd_survey *survey, size_t block, int part,
                      shd_seen out[SHD_SEEN_MOST]);

/* The pixels of a block, as bits row by row, through which something may be seen: all others' rays
 * meet nothing. */
uint64_t shd_sight_pixels(const shd_sight *sight, const shd_survey *survey, size_t block);

/* An object that is seen through a block or a part of one, and its middle in the picture. */
typedef struct shd_middle {
    size_t object;
    double x, y;
} shd_middle;

/* Of the pattern of so many samples a pixel. */
shd_pattern_spread shd_spread_of(int samples);
