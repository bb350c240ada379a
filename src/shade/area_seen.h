/* A light's shape as a point sees it: a flat, convex region, bounded by segments and by arcs of one
 * circle. A sphere is the disc that its cone of directions has in common with it. Only for
 * shade/area*. */
#pragma once

#include "shade/lighting.h"

typedef struct shd_stretch {
    bool arc;
    double x[2], y[2]; /* where it begins and ends */
    double from, to;   /* angles of an arc, counterclockwise, at most 2 pi apart */
} shd_stretch;

enum { SHD_STRETCHES_MOST = 16 };

/* The region's points are center + x a + y b, as seen from the point, in a unit of length in which
 * all of them are about 1 away at most. a and b are unit, perpendicular, and a x b points away from
 * the point, so that the boundary runs counterclockwise in x and y and positively around what is in
 * it. */
typedef struct shd_seen {
    shd_vec3 center, a, b, away; /* away = a x b */
    double height;               /* of the point under the region's plane: center.away */
    double radius;               /* of arcs, around x = y = 0 */
    shd_stretch pieces[SHD_STRETCHES_MOST];
    int count;        /* 0: nothing is seen */
    double size;      /* half of the shape's largest extent, of its distance */
    double gain;      /* 1 / A */
    double unit;      /* in the world's lengths */
    double slack;     /* heights over a horizon up to this may be rounding */
    shd_vec3 toward;  /* unit: the shape's middle */
    double fall;      /* what the light is like as a point: cos / distance^2 */
    double point_off; /* what it may be off as a point, of the most that it adds */
} shd_seen;

/* False: the point is behind the shape, on it, or inside. */
bool shd_see_area(const shd_light *light, shd_vec3 point, shd_seen *out);

/* Whether a half-space of directions, those with normal.L > 0, has all of the region (1), some
 * (0), or none (-1), to within `slack`. */
int shd_side_of_seen(const shd_seen *seen, shd_vec3 normal, double slack);

/* Cuts off what is not in the half-space. */
void shd_clip_seen(shd_seen *seen, shd_vec3 normal);

/* The vector to a point of the region. */
static inline shd_vec3 shd_seen_at(const shd_seen *s, double x, double y) {
    return shd_madd(shd_madd(s->center, s->a, x), s->b, y);
}

static inline shd_vec3 shd_arc_at(const shd_seen *s, double angle) {
    return shd_seen_at(s, s->radius * cos(angle), s->radius * sin(angle));
}

/* Perpendicular unit vectors with a x b = n: T. Duff et al., "Building an Orthonormal Basis,
 * Revisited", JCGT 6(1), 2017. */
void shd_perpendicular(shd_vec3 n, shd_vec3 *a, shd_vec3 *b);

/* Whether a direction is inside the region. */
bool shd_is_in_seen(const shd_seen *seen, shd_vec3 direction);
