/* What may be seen of an object, in pieces: spheres around points of its surface, with cones around
 * their normals and their mirrored views; and what a light can do there, as intervals. Inside of
 * plan/.
 *
 * The pieces depend on the camera and on the whole picture, never on the region that is rendered.
 * Every sample of the object that is seen lies in one of them. */
#ifndef SHD_PLAN_PIECES_H
#define SHD_PLAN_PIECES_H

#include "plan/parts.h"

/* In [0, pi], by its cosine and sine. */
typedef struct shd_angle {
    double cosine, sine;
} shd_angle;

typedef struct shd_piece {
    shd_vec3 center;   /* world frame */
    double radius;     /* infinite: to a plane's horizon, and the center is any of its points */
    double beyond;     /* no point is nearer to the camera's position */
    shd_vec3 axis;     /* unit: normals, turned as they are shaded, */
    shd_angle spread;  /* are within this angle of it */
    shd_vec3 mirror;   /* unit: W = 2(N.V)N - V likewise */
    shd_angle glitter; /* of W */
} shd_piece;

/* A torus seen from within, each piece turned either way. */
enum { SHD_MOST_PIECES = 144 };

/* The object's pieces; none where it cannot be seen. `fineness` 0: one for the whole object; else
 * a face or a quarter of a curved side is divided into fineness x fineness, at most 3 x 3. Returns
 * their number. Costs some 0.2 us each, and a mesh 30 ns a triangle. */
size_t shd_plan_pieces(const shd_scene *scene, size_t object, const shd_plan_object *bounds,
                       int fineness, shd_piece *out);

/* What a light can do at a piece. */
typedef struct shd_lit {
    double nearest;                 /* distance; 0 for directional lights */
    double fall_high;               /* f */
    double axis_low, axis_high;     /* cos t, of spots */
    double factor_low, factor_high; /* f s */
    double facing_low, facing_high; /* (N.L)+ */
    double shine_low, shine_high;   /* (R.V)+, that of 0 where N.L may be 0 */
} shd_lit;

/* False: the light is behind or out of its cone at all points, and adds exactly 0. `least` is a
 * distance that no point of the object is nearer at. */
bool shd_piece_lit(const shd_scene *scene, const shd_piece *piece, const shd_plan_light *light,
                   double least, shd_lit *out);

/* The most that it adds to any channel of a material there. */
double shd_piece_most(const shd_scene *scene, const shd_piece *piece,
                      const shd_plan_material *material, const shd_plan_light *light, double least);

/* The piece that a patch is. */
shd_piece shd_piece_of(const shd_scene *scene, const shd_patch *patch);

#endif
