/* Draft's own way: blocks of pixels through which one ball, ellipsoid or plane is seen, in f32
 * from the eye's rays to colors, without hits or sums in between.
 *
 * All is told from the middle of the block, which f64 finds (plan/bend.h): where a ray meets the
 * surface, and lights, are differences from there, so that f32 rounds what is as small as the block
 * and not what is as large as the scene. What that errs by is told by bound/light/error.h, and
 * proven in sketch.c. tests/property/sketch.c holds it against f64. */
#pragma once

#include "plan/rim.h"
#include "shade/lighting.h"

enum { SHD_SKETCH_PIXELS = SHD_SKETCH_SIDE * SHD_SKETCH_SIDE };

typedef struct shd_sketch_group shd_sketch_group;

/* Makes lighting->sketches, which a plan that is sketched has. False: the arena is full. */
bool shd_sketch_prepare(shd_lighting *lighting, shd_arena *arena);

/* Writes the colors of a block past a ball's rim, and of the background `beyond`, in the same way.
 * False: it is not known of all pixels what they see, or as below. */
bool shd_sketch_rim(const shd_lighting *lighting, const shd_rim *rim, const shd_block_rays *rays,
                    const float beyond[3], size_t stride, float *const rgb[3]);

/* Writes the colors of blocks (shd_sight_bend) of a plan that is sketched (shd_plan.sketched) to
 * three planes, whose rows are `stride` apart, and tells of each of rays->blocks^2, from left to
 * right and down, whether it is drawn. False: nothing is. It is not told how far off others are, as
 * near lights and where highlights end at the horizon, and what is written of them is of no use.
 * Any thread. */
bool shd_sketch_blocks(const shd_lighting *lighting, const shd_bend *bend,
                       const shd_block_rays *rays, size_t stride, float *const rgb[3], bool *drawn);

struct shd_block_faces;

/* The same of a block's flat faces (plan/faces.h). Colors of rays that meet nothing are of no use.
 */
bool shd_sketch_faces(const shd_lighting *lighting, const struct shd_block_faces *faces,
                      size_t stride, float *const rgb[3]);
