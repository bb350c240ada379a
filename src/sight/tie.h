/* What rounding may have moved a hit by. Inside of sight/.
 *
 * Two objects are met at the same distance where what rounding may have moved both of their t by is
 * at least what these differ by. The ray itself is the same for both, to the bit, so its own
 * rounding does not count. With u = 2^-53, a sum of products is off by a few u times the sum of
 * their sizes:
 *
 * A shape's ray has the origin o = A (E - O) and the direction d = A D in the shape's own frame, E
 * being the eye, O the object's place, D the ray and A the inverse of the object's map. Row k of A
 * makes component k of both, so that o_k, d_k t, and the surface itself, which rounding of A turns,
 * are off by c u |A_k| (|E - O| + t), where only those components count at which the row is not 0:
 * a level ground is not seen with less care because it is wide. A step of the origin along the ray
 * by s adds c u |d_k s|. What is left is the size of the surface's own coordinates. Along the
 * surface's unit normal n in its frame all this is e = c u (sum of |n_k| (|A_k| (|E - O| + t + s) +
 * size_k)), and t is moved by e / |n.d|: the more, the flatter the ray meets the surface.
 *
 * A triangle's corners are seen from the eye at v_i, off by c u |v_i| and, as the eye is carried
 * into the mesh's frame and back, c u |M| |A| |E - O|. Of the longest edge l and twice the area a,
 * cross products of corners are off by c u l^2, a share l^2 / a of the whole, so that a depth
 * within the triangle is off by l as often. All of this over |N.D|.
 *
 * c is 16 (SHD_HIT_ROUNDING is c u): the largest of the sums has some 14 roundings (a product of
 * three turns, its inverse, a difference, a product of three terms). Any thread; each function is a
 * hit's alone. */
#ifndef SHD_SIGHT_TIE_H
#define SHD_SIGHT_TIE_H

#include "sight/item.h"

/* A hit: the ray's unit direction and start (from the camera's position; 0 in perspective), and
 * where it meets the object. */
typedef struct shd_met {
    shd_vec3 ray, start;
    double t;
} shd_met;

/* Of no mesh. `point` and the unit `normal` in the unit form; `shift`: by how much the origin was
 * moved along the ray. Not less than 0; infinity or not-a-number where rays lie in the surface. */
double shd_shape_rounding(const shd_item *it, const shd_lens *lens, const shd_met *met,
                          double shift, shd_vec3 point, shd_vec3 normal);

/* Of a mesh, at one of its triangles. */
double shd_triangle_rounding(const shd_item *it, const shd_lens *lens, const shd_met *met,
                             uint32_t triangle);

#endif
