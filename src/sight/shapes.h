/* Analytic shapes in their unit form, and rays in its frame. Inside of sight/.
 *
 * In their unit form the sphere, disc, cylinder (height 1, centred) and cone (base at y = -1/2,
 * apex at y = 1/2) have radius 1, the box has sides of 1, the torus a ring of radius 1 and a tube
 * of `tube` (the ratio of its radii). The map to the world is shd_object_frame's; where rays meet
 * them is told by sight/batch.h. */
#ifndef SHD_SIGHT_SHAPES_H
#define SHD_SIGHT_SHAPES_H

#include "scene/scene.h"

/* Of an object nothing is seen that is closer to the eye than this, of its size: whether an eye on
 * its surface has it before or behind itself, rays would tell each by its own rounding. */
#define SHD_BLIND 1e-12

#endif
