/* How far rounding may have moved a hit. Inside of sight/.
 *
 * Two objects are met at the same distance if their t differ by no more than rounding may have
 * moved both. The ray is the same for both, to the bit, so that its own rounding does not count.
 * With u = 2^-53, a sum of products is off by a few u times the sum of their sizes.
 *
 * A shape's ray has the origin o = A (E - O) and the direction d = A D in the shape's own frame,
 * where E is the eye, O the object's place, D the ray and A the inverse of the object's map. Row k
 * of A makes component k of both. So o_k and d_k t are off by c u |A_k| (|E - O| + t), and so is
 * the surface itself, which rounding of A turns. Only components count at which the row is not 0,
 * so that a level ground is not seen with less care because it is wide. A step of the origin along
 * the ray by s adds c u |d_k s|, and the surface's own coordinates add their size. Along the
 * surface's unit normal n in its frame all this is e = c u (sum of |n_k| (|A_k| (|E - O| + t + s) +
 * size_k)). It moves t by e / |n.d|, which is more, the flatter the ray meets the surface.
 *
 * A triangle's corners are seen from the eye at v_i. They are off by c u |v_i|, and by c u |M| |A|
 * |E - O| because the eye is carried into the mesh's frame and back. If l is the longest edge and a
 * twice the area, cross products of corners are off by c u l^2. That is a share l^2 / a of the
 * whole, so that a depth within the triangle is off by the same share of l. All of this is over
 * |N.D|.
 *
 * c is 16 (SHD_HIT_ROUNDING is c u), because the largest of the sums has some 14 roundings: a
 * product of three turns, its inverse, a difference, a product of three terms. Any thread may call
 * these. */
#pragma once

#include "sight/item.h"

/* A hit. */
typedef struct shd_met {
    shd_vec3 ray;   /* its unit direction */
    shd_vec3 start; /* where the ray starts, from the camera's position: 0 in perspective */
    double t;
} shd_met;

/* How far a hit on a shape was moved: at least 0, or infinity or not-a-number if the ray lies in
 * the surface. `point` and the unit `normal` are those of the unit form. The origin was moved by
 * `shift` along the ray. */
double shd_shape_rounding(const shd_item *it, const shd_lens *lens, const shd_met *met,
                          double shift, shd_vec3 point, shd_vec3 normal);

/* How far a hit on a triangle of a mesh was moved. */
double shd_triangle_rounding(const shd_item *it, const shd_lens *lens, const shd_met *met,
                             uint32_t triangle);
