/* How far f64 puts points beside where exact arithmetic has them. Inside of bound/. */
#pragma once

#include "bound/light/pieces.h"

/* How far rounding to f64 moves the points of an object that are seen, and turns their normals:
 * lengths of the world, and a chord of unit vectors. Its proof is in misplaced.c. */
typedef struct shd_misplaced {
    bool plane; /* an infinite one, through this point, with this unit normal */
    shd_vec3 point, normal;
    double span; /* the lengths on the way to its points, but for how far out on a plane they are */
    bool smooth; /* normals are of corners: they do not tell how flatly rays meet the surface */
    bool flat;   /* a disc or a box with a map of normals: the axes of its pieces tell it */
    double moved;   /* off the surface, of points that are on no flat piece */
    double grazing; /* the least N.V of such that counts */
    double bend;    /* by how much the surface bends for each length; 0: it is flat */
    double turned;  /* 0: flat */
} shd_misplaced;

shd_misplaced shd_misplaced_of(const shd_scene *scene, const shd_place *place);

/* By how much the direction of a light, no nearer than `nearest`, is turned by what rounding to f64
 * moves the piece's points: a chord of unit vectors. *beyond: what is added to (N.L)+ where an
 * infinite plane is farther out than that says. */
double shd_misplaced_at(const shd_scene *scene, const shd_misplaced *misplaced,
                        const shd_piece *piece, const shd_plan_light *light, double nearest,
                        double *beyond);

/* near / distance + far is by how much the direction of a light is turned by what rounding to f32
 * moves an object's points and the light, over what f64 does; half of what it does to the distance.
 */
typedef struct shd_moved {
    double near, far;
} shd_moved;

shd_moved shd_moved_by_f32(const shd_plan *plan, const shd_place *place,
                           const shd_plan_light *light);

/* By how much a tangent (shd_surface_tangent) is turned around the normal where points are `moved`
 * along the surface and normals turned by `normal`: radians. `mapped`: a map has turned these. */
double shd_turned_around(const shd_place *place, bool mapped, double moved, double normal);
