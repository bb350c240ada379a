/* Blocks of pixels through which flat faces of one object are seen. */
#pragma once

#include "plan/faces.h"
#include "sight/sight.h"

/* Casts a sample's rays through the survey's block, all of its 8 x 8 pixels, and tells of the
 * triangles that they meet. Which these are is the same as for shots. False: something else than
 * one mesh may be seen, or too many faces, or what rounding does to one is not small. */
bool shd_sight_faces(const shd_sight *sight, const shd_survey *survey, size_t block, int sample,
                     shd_block_faces *out);
