/* Pieces cover what may be seen of an object, by each sample of the whole picture. Each is a sphere
 * around points of its surface, with cones around their normals and around their mirrored views.
 * Intervals tell what a light can do at a piece. Inside of bound/. */
#pragma once

#include "plan/parts.h"

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

/* The cosine of the angle less `by`, which is at least 0 degrees. */
static inline double shd_cosine_less(shd_angle a, shd_angle by) {
    return a.cosine >= by.cosine ? 1 : a.cosine * by.cosine + a.sine * by.sine;
}

/* The cosine of the angle and `by`, which is at most 180 degrees. */
static inline double shd_cosine_more(shd_angle a, shd_angle by) {
    return a.cosine <= -by.cosine ? -1 : a.cosine * by.cosine - a.sine * by.sine;
}

/* How far directions to a point may be from that from a sphere's center, if they begin at any point
 * of the sphere. The point is 1 / `inverse` away from the center. */
static inline shd_angle shd_seen_from(double radius, double inverse) {
    const double sine = radius * inverse;
    if (!(sine < 1)) return SHD_ANY_ANGLE;
    return (shd_angle){sqrt(1 - sine * sine), sine};
}

typedef struct shd_piece {
    shd_vec3 center;  /* world frame */
    double radius;    /* infinite: the piece goes to a plane's horizon, and `center` is any point */
    double beyond;    /* no point is nearer to the camera's position */
    shd_vec3 axis;    /* unit; normals, turned as they are shaded, are around it */
    shd_angle spread; /* no normal is farther from `axis`; any may be, if there is a map of them */
    shd_vec3 mirror;  /* unit; the mirrored views W = 2(N.V)N - V are around it */
    shd_angle glitter; /* no W is farther from `mirror` */
} shd_piece;

/* A torus that is seen from within has the most, because each piece may be turned either way. */
enum { SHD_MOST_PIECES = 144 };

/* Finds the object's pieces and returns their number: 0 if the object cannot be seen. With
 * `fineness` 0 there is one for the whole object. Else each face or quarter of a curved side is
 * divided into fineness x fineness, at most 3 x 3. A piece costs some 0.2 us, and a mesh 30 ns a
 * triangle, which `cancelled` (or NULL) ends. */
size_t shd_plan_pieces(const shd_scene *scene, size_t object, const shd_plan_object *bounds,
                       int fineness, const atomic_bool *cancelled, shd_piece *out);

/* What a light can do at a piece. */
typedef struct shd_lit {
    double nearest;                 /* distance; 0 for directional lights */
    double fall_high;               /* f */
    double axis_low, axis_high;     /* cos t, of spots */
    double factor_low, factor_high; /* f s */
    double facing_low, facing_high; /* (N.L)+ */
    double shine_low, shine_high;   /* (R.V)+; the low one is 0 if N.L may be 0 */
} shd_lit;

/* Finds what the light can do at the piece, of which no point is nearer to it than `least`. False:
 * the light is behind all points, or its cone misses them, and it adds exactly 0. */
bool shd_piece_lit(const shd_scene *scene, const shd_piece *piece, const shd_plan_light *light,
                   double least, shd_lit *out);

/* The most that the light adds to any channel of a material at the piece. */
double shd_piece_most(const shd_scene *scene, const shd_piece *piece,
                      const shd_plan_material *material, const shd_plan_light *light, double least);

/* An upper and a lower bound of (shine+)^shininess, to 2e-10. */
double shd_shine_most(double shine, double shininess);
double shd_shine_least(double shine, double shininess);

/* The piece that a patch is. */
shd_piece shd_piece_of(const shd_scene *scene, const shd_patch *patch);
