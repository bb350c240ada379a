/* What is seen of flat faces through a block of pixels: which of them each ray meets, and points
 * and normals there as functions of the place in the picture. */
#pragma once

#include <stdint.h>

#include "plan/bend.h"

/* No block is told of that sees more faces than this. */
enum { SHD_FACES_MOST = 12, SHD_BLOCK_RAYS = SHD_BLOCK_SIDE * SHD_BLOCK_SIDE };

/* Rays are no farther than this from the middle's, in pixels, across and down. */
static const double SHD_FACE_REACH = 3.5;

/* A function of the ray x pixels to the right of the middle's and y below: at + x right + y down.
 */
typedef struct shd_ramp {
    shd_vec3 at, right, down;
} shd_ramp;

/* Where the ray meets the face's plane, it is at point / weight from the block's point, and the
 * normal goes along `normal`: each corner's counts as much as the triangle of the ray and the two
 * other corners is large, and these are linear in the picture. */
typedef struct shd_seen_face {
    shd_ramp point, normal; /* in the plan's frame, beside the block's point */
    double right, down;     /* what the weight grows by; it is 1 in the middle */
    /* More than rounding made of any corner's part of the weight, and, of parts that are off by
     * that, of `point` and `normal`. */
    double off_weight, off_point, off_normal;
} shd_seen_face;

typedef struct shd_block_faces {
    size_t object;            /* whose faces they are, before all else */
    int count;                /* 0: no ray meets anything */
    uint64_t hit;             /* the rays that do, as bits row by row */
    float of[SHD_BLOCK_RAYS]; /* the face of each; of those that do not, any of the list */
    shd_seen_face list[SHD_FACES_MOST];
    shd_vec3 point, way, way_right, way_down; /* world frame: on a face; where rays go, the middle's
                                               * as a unit vector */
} shd_block_faces;
