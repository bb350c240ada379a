/* Rays from anywhere: what else light meets on its way. One at a time, in f64.
 *
 * Exactness. A ray that starts on a surface is told which one, and does not meet the same piece of
 * it again: the same triangle; a plane or a disc at all; a convex shape, unless it goes inside, and
 * then only where it leaves; a torus only at the roots that are left of its quartic once the known
 * root 0 is divided out. So no distance has to be skipped, and nothing is missed that is near.
 * Other surfaces count from where rounding can no longer have put them before the ray's start (or
 * behind its end): with u = 2^-53, origins in a shape's frame are off by some 16 u times the sizes
 * that were added up, which moves t by that over |n.d| (tie.h has the terms). Two surfaces that lie
 * in each other are one to that rounding.
 *
 * Triangles are met by the sides on which their edges pass the ray (S. Woop, C. Benthin, I. Wald,
 * "Watertight Ray/Triangle Intersection", 2013), which both triangles of an edge see alike, and 0
 * counts for either: no ray slips through. A ray that starts on a triangle starts within it: on the
 * corner that the origin is but for rounding, or at the weights of its corners that the origin has,
 * so that it lies in the triangle's plane in the mesh's own frame, moved from the edges by 2^-40 of
 * the way to the middle and 2^-43 of the coordinates' size. It meets no triangle that has no corner
 * on the side of its own plane to which it goes; and one that has no corner on the other side, as
 * the next one of a fold has none, it meets however near that is. So from the edge of a fold it is
 * known what stands before it. */
#pragma once

#include "plan/occluders.h"
#include "sight/sight.h"

typedef struct shd_caster shd_caster;

/* The surface on which a ray starts. */
typedef struct shd_start {
    int32_t object;    /* SHD_NOTHING: none, and the rest is not read */
    uint32_t triangle; /* of a mesh or a faceted object */
    shd_vec3 normal;   /* the surface's own, of any side; not read for triangles */
} shd_start;

typedef struct shd_ray {
    shd_vec3 origin, direction; /* unit; world frame */
    double far;                 /* nothing at this distance or farther is met; may be infinite */
    shd_start start;
} shd_ray;

/* What a ray meets. */
typedef struct shd_meeting {
    double t;        /* the distance */
    double rounding; /* how far off it may be */
    size_t object;
    uint32_t triangle;
    double u, v;    /* weights of the triangle's second and third corner */
    shd_vec3 local; /* the place in the item's frame, and what of it is met there */
    shd_vec3 bend;
} shd_meeting;

/* The surface there, in the world's frame. */
typedef struct shd_met_at {
    shd_vec3 position;
    shd_vec3 own;    /* unit: the outward normal of a shape, or of the triangle by its corners */
    shd_vec3 normal; /* unit: interpolated, if the mesh has normals; not turned */
} shd_met_at;

/* Borrows the sight. NULL: the arena is full. */
shd_caster *shd_caster_new(const shd_sight *sight, shd_arena *arena);

/* The nearest of all objects, or of `list` (NULL: all). With `solid` ([object], or NULL), the
 * search ends at any object that it has true for. False: nothing is met. Any thread. Once the
 * sight's flag is raised, the answer means nothing. */
bool shd_cast_ray(const shd_caster *caster, const shd_ray *ray, const uint32_t *list, size_t count,
                  const bool *solid, shd_meeting *out);

/* Whether rays that leave the object on its outer side never meet it again: it is convex, and not
 * so thin that rounding could turn their side. */
bool shd_is_convex(const shd_caster *caster, size_t object);

/* Whether `normal`, the surface's own of any side at a point of a convex object, points outward. */
bool shd_is_outside(const shd_caster *caster, size_t object, shd_vec3 position, shd_vec3 normal);

/* Lists the objects but for `own` that may hide some of a light from points in a ball. Returns how
 * many there are; more than `most`: the list is not complete. */
size_t shd_list_between(const shd_caster *caster, shd_ball at, const shd_plan_light *light,
                        size_t own, uint32_t *list, size_t most);

/* Where it was met. */
shd_met_at shd_met_place(const shd_caster *caster, const shd_meeting *meeting);

/* The outward normal of a shape at a point of it, of which `normal` is one of any side; of a mesh,
 * its triangle's own, or `normal` if that has no area. */
shd_vec3 shd_outward_normal(const shd_caster *caster, size_t object, uint32_t triangle,
                            shd_vec3 position, shd_vec3 normal);

/* The normal of a triangle of a mesh or a faceted object by its corners: unit, world frame; 0 if
 * the object is neither or the triangle has no area. */
shd_vec3 shd_own_normal(const shd_caster *caster, size_t object, uint32_t triangle);
