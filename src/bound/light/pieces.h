/* What may be seen of an object is covered with pieces: spheres around points of its surface, with
 * cones around their normals and around their mirrored views. What a light can do at a piece is
 * told in intervals. Inside of bound/.
 *
 * The pieces depend on the camera and on the whole picture, never on the region that is rendered.
 * Every sample of the object that is seen lies in one of them. */
#ifndef SHD_BOUND_LIGHT_PIECES_H
#define SHD_BOUND_LIGHT_PIECES_H

#include "plan/parts.h"

/* An angle in [0, pi], by its cosine and sine. */
typedef struct shd_angle {
    double cosine, sine;
} shd_angle;

static const shd_angle SHD_ANY_ANGLE = {-1, 0};

static inline shd_angle shd_angle_of(double cosine) {
    cosine = shd_smaller(shd_larger(cosine, -1), 1);
    return (shd_angle){cosine, sqrt(1 - cosine * cosine)};
}

/* At most 180 degrees. */
static inline shd_angle shd_angle_sum(shd_angle a, shd_angle b) {
    const double sine = a.sine * b.cosine + a.cosine * b.sine;
    if (sine < 0 || a.cosine + b.cosine <= 0) return SHD_ANY_ANGLE;
    return (shd_angle){a.cosine * b.cosine - a.sine * b.sine, sine};
}

/* The cosine of the angle less `by`, at least 0 degrees, and of the angle more `by`, at most 180.
 */
static inline double shd_cosine_less(shd_angle a, shd_angle by) {
    return a.cosine >= by.cosine ? 1 : a.cosine * by.cosine + a.sine * by.sine;
}

static inline double shd_cosine_more(shd_angle a, shd_angle by) {
    return a.cosine <= -by.cosine ? -1 : a.cosine * by.cosine - a.sine * by.sine;
}

/* From the points of a sphere, a point 1 / `inverse` away from its center is seen in directions
 * within this angle of that from the center. */
static inline shd_angle shd_seen_from(double radius, double inverse) {
    const double sine = radius * inverse;
    if (!(sine < 1)) return SHD_ANY_ANGLE;
    return (shd_angle){sqrt(1 - sine * sine), sine};
}

typedef struct shd_piece {
    shd_vec3 center;   /* world frame */
    double radius;     /* infinite: to a plane's horizon, and the center is any of its points */
    double beyond;     /* no point is nearer to the camera's position */
    shd_vec3 axis;     /* unit: normals, turned as they are shaded, */
    shd_angle spread;  /* are within this angle of it */
    shd_vec3 mirror;   /* unit: W = 2(N.V)N - V likewise */
    shd_angle glitter; /* of W */
} shd_piece;

/* A torus that is seen from within has the most: each of its pieces may be turned either way. */
enum { SHD_MOST_PIECES = 144 };

/* Finds the object's pieces, none if it cannot be seen, and returns their number. `fineness` 0: one
 * for the whole object; else a face or a quarter of a curved side is divided into fineness x
 * fineness, at most 3 x 3. A piece costs some 0.2 us, and a mesh 30 ns a triangle: `cancelled` (or
 * NULL) ends that. */
size_t shd_plan_pieces(const shd_scene *scene, size_t object, const shd_plan_object *bounds,
                       int fineness, const atomic_bool *cancelled, shd_piece *out);

/* What a light can do at a piece. */
typedef struct shd_lit {
    double nearest;                 /* distance; 0 for directional lights */
    double fall_high;               /* f */
    double axis_low, axis_high;     /* cos t, of spots */
    double factor_low, factor_high; /* f s */
    double facing_low, facing_high; /* (N.L)+ */
    double shine_low, shine_high;   /* (R.V)+, that of 0 where N.L may be 0 */
} shd_lit;

/* Finds what the light can do at the piece. No point of the object is nearer to the light than
 * `least`. False: the light is behind all points, or they are out of its cone, and it adds exactly
 * 0. */
bool shd_piece_lit(const shd_scene *scene, const shd_piece *piece, const shd_plan_light *light,
                   double least, shd_lit *out);

/* The most that it adds to any channel of a material there. */
double shd_piece_most(const shd_scene *scene, const shd_piece *piece,
                      const shd_plan_material *material, const shd_plan_light *light, double least);

/* (shine+)^shininess as a bound, at most or at least, to 2e-10. */
double shd_shine_most(double shine, double shininess);
double shd_shine_least(double shine, double shininess);

/* The piece that a patch is. */
shd_piece shd_piece_of(const shd_scene *scene, const shd_patch *patch);

#endif
