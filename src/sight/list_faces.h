/* The faces that a block's rays meet, by their numbers. Inside of sight/. */
#pragma once

#include "sight/batch.h"
#include "sight/faces.h"

/* Casts the rays of a block whose upper left one is at (x, y), in pixels, at a mesh. Sets what
 * `out` has of rays, and `list`, its triangles. False: these are too many. */
typedef bool shd_list_faces_function(const shd_sight *sight, const shd_item *it, double x, double y,
                                     uint32_t list[SHD_FACES_MOST], shd_block_faces *out);
shd_list_faces_function shd_list_faces_portable, shd_list_faces_avx2, shd_list_faces_avx512;
