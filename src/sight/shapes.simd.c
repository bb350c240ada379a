/* Analytic shapes in their unit form, a batch of rays at a time. Compiled once an instruction set.
 * Loops have no branches: a formula without an answer gives infinity or not-a-number, which no
 * comparison takes for a hit. */
#include <float.h>

#include "sight/batch.h"

/* ---- Finding: t and face. ---- */

/* The discriminant is made from the distance of the line to the center, as in ball.simd.c. */
static void find_sphere(shd_work *restrict w) {
    SHD_EACH_LANE(i) {
        const shd_vec3 o = shd_lane(w->origin, i), d = shd_lane(w->direction, i);
        const double near = w->near[i], inverse = 1 / shd_dot(d, d),
                     middle = -shd_dot(o, d) * inverse;
        const shd_vec3 foot = shd_madd(o, d, middle);
        const double inside = 1 - shd_dot(foot, foot), half = sqrt(inside * inverse);
        double t = middle - half > near ? middle - half : middle + half;
        t = t > near ? t : INFINITY;
        w->t[i] = inside >= 0 ? t : INFINITY;
    }
}

static void find_plane(bool disc, shd_work *restrict w) {
    const double reach = disc ? 1 : INFINITY;
    SHD_EACH_LANE(i) {
        const double t = -w->origin[1][i] / w->direction[1][i];
        const shd_vec3 p = shd_lane_at(w, i, t);
        double held = p.x * p.x + p.z * p.z <= reach ? t : INFINITY;
        /* Beyond f64 there is no point to shade. */
        held = fabs(p.x) <= DBL_MAX ? held : INFINITY;
        held = fabs(p.z) <= DBL_MAX ? held : INFINITY;
        w->t[i] = held > w->near[i] ? held : INFINITY;
    }
}

/* Where rays enter and leave the slab of one axis, and through the faces of which axis: 0, 1, 2 for
 * x, y, z. Of equals the first axis stays. */
static void find_slab(const double *restrict origin, const double *restrict direction, double axis,
                      double *restrict enter, double *restrict leave, double *restrict enter_axis,
                      double *restrict leave_axis) {
    SHD_EACH_LANE(i) {
        double o = origin[i], d = direction[i];
        double side = d > 0 ? 0.5 : -0.5;
        double inverse = 1 / d;
        double t0 = (-side - o) * inverse, t1 = (side - o) * inverse;
        /* A parallel ray is never in the slab, or always. */
        double never = fabs(o) > 0.5 ? INFINITY : -INFINITY;
        t0 = d == 0 ? never : t0;
        t1 = d == 0 ? INFINITY : t1;
        enter_axis[i] = t0 > enter[i] ? axis : enter_axis[i];
        leave_axis[i] = t1 < leave[i] ? axis : leave_axis[i];
        enter[i] = t0 > enter[i] ? t0 : enter[i];
        leave[i] = t1 < leave[i] ? t1 : leave[i];
    }
}

/* face: the axis, plus 3 where the ray comes from inside. */
static void find_box(shd_work *restrict w) {
    double enter[SHD_RAYS], leave[SHD_RAYS], enter_axis[SHD_RAYS], leave_axis[SHD_RAYS];
    SHD_EACH_LANE(i) {
        enter[i] = -INFINITY;
        leave[i] = INFINITY;
        enter_axis[i] = leave_axis[i] = 0;
    }
    for (int c = 0; c < 3; c++)
        find_slab(w->origin[c], w->direction[c], c, enter, leave, enter_axis, leave_axis);
    SHD_EACH_LANE(i) {
        double near = w->near[i];
        double t = enter[i] > near ? enter[i] : leave[i];
        w->face[i] = enter[i] > near ? enter_axis[i] : leave_axis[i] + 3;
        t = t > near ? t : INFINITY;
        w->t[i] = enter[i] <= leave[i] ? t : INFINITY;
    }
}

enum { BOTTOM, TOP, SIDE }; /* faces of cylinder and cone */

/* The nearest face of a lane so far. */
typedef struct nearest {
    double t, face;
} nearest;

/* Takes a face that the ray meets at `candidate`, if it is valid and nearer. */
SHD_INLINE void take_face(bool valid, double candidate, double which, double near, nearest *to) {
    double taken = valid ? candidate : INFINITY;
    taken = taken > near ? taken : INFINITY;
    to->face = taken < to->t ? which : to->face;
    to->t = taken < to->t ? taken : to->t;
}

/* Takes the cap, a disc of radius 1, whose plane lane i meets at `candidate`. */
SHD_INLINE void take_cap(const shd_work *restrict w, int i, double candidate, double which,
                         nearest *to) {
    const shd_vec3 p = shd_lane_at(w, i, candidate);
    take_face(p.x * p.x + p.z * p.z <= 1, candidate, which, w->near[i], to);
}

/* Takes the side, between y = -1/2 and 1/2, which lane i meets at the roots of a t^2 + 2 b t + c.
 * These come without cancellation. If there are none, a zero was divided by, or a root taken of a
 * negative number. */
SHD_INLINE void take_side(const shd_work *restrict w, int i, double a, double b, double c,
                          nearest *to) {
    const double root = sqrt(b * b - a * c), q = b > 0 ? -b - root : -b + root;
    const double first = c / q, second = q / a;
    take_face(fabs(shd_lane_at(w, i, first).y) <= 0.5, first, SIDE, w->near[i], to);
    take_face(fabs(shd_lane_at(w, i, second).y) <= 0.5, second, SIDE, w->near[i], to);
}

static void find_cylinder(shd_work *restrict w) {
    SHD_EACH_LANE(i) {
        const shd_vec3 o = shd_lane(w->origin, i), d = shd_lane(w->direction, i);
        const double inverse = 1 / d.y;
        nearest to = {INFINITY, SIDE};
        take_cap(w, i, (-0.5 - o.y) * inverse, BOTTOM, &to);
        take_cap(w, i, (0.5 - o.y) * inverse, TOP, &to);
        take_side(w, i, d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z, o.x * o.x + o.z * o.z - 1,
                  &to);
        w->t[i] = to.t;
        w->face[i] = to.face;
    }
}

/* x^2 + z^2 = (1/2 - y)^2 for y in [-1/2, 1/2] */
static void find_cone(shd_work *restrict w) {
    SHD_EACH_LANE(i) {
        const shd_vec3 o = shd_lane(w->origin, i), d = shd_lane(w->direction, i);
        const double k = 0.5 - o.y;
        nearest to = {INFINITY, SIDE};
        take_cap(w, i, (-0.5 - o.y) / d.y, BOTTOM, &to);
        take_side(w, i, d.x * d.x + d.z * d.z - d.y * d.y, o.x * d.x + o.z * d.z + k * d.y,
                  o.x * o.x + o.z * o.z - k * k, &to);
        w->t[i] = to.t;
        w->face[i] = to.face;
    }
}

/* ---- Placing: points, snapped onto the shape, and outward normals. ---- */

static void place_sphere(const shd_work *restrict w, shd_surfaces *restrict out) {
    SHD_EACH_LANE(i) {
        const shd_vec3 p = shd_lane_at(w, i, w->t[i]);
        const shd_vec3 unit = shd_scale(p, shd_inverse_root(shd_dot(p, p)));
        shd_set_lane(out->point, i, unit);
        shd_set_lane(out->normal, i, unit);
    }
}

static void place_plane(const shd_work *restrict w, shd_surfaces *restrict out) {
    SHD_EACH_LANE(i) {
        const shd_vec3 p = shd_lane_at(w, i, w->t[i]);
        shd_set_lane(out->point, i, (shd_vec3){p.x, 0, p.z});
        shd_set_lane(out->normal, i, (shd_vec3){0, 1, 0});
    }
}

static void place_on_slab(const double *restrict origin, const double *restrict direction,
                          double axis, const shd_work *restrict w, double *restrict point,
                          double *restrict normal) {
    SHD_EACH_LANE(i) {
        double at = origin[i] + direction[i] * w->t[i];
        at = at > -0.5 ? at : -0.5;
        at = at < 0.5 ? at : 0.5;
        double ahead = direction[i] > 0 ? 1 : -1;
        double sign = w->face[i] > 2 ? ahead : -ahead;
        bool entered = w->face[i] == axis, left = w->face[i] == axis + 3;
        double n = entered ? sign : 0;
        n = left ? sign : n;
        point[i] = n != 0 ? 0.5 * n : at;
        normal[i] = n;
    }
}

static void place_box(const shd_work *restrict w, shd_surfaces *restrict out) {
    for (int c = 0; c < 3; c++)
        place_on_slab(w->origin[c], w->direction[c], c, w, out->point[c], out->normal[c]);
}

static void place_cylinder(const shd_work *restrict w, shd_surfaces *restrict out) {
    SHD_EACH_LANE(i) {
        const shd_vec3 p = shd_lane_at(w, i, w->t[i]);
        const double inverse = shd_inverse_root(p.x * p.x + p.z * p.z);
        const double x = p.x * inverse, z = p.z * inverse, cap = w->face[i] == TOP ? 1 : -1;
        const bool side = w->face[i] == SIDE;
        const shd_vec3 at = {side ? x : p.x, side ? p.y : 0.5 * cap, side ? z : p.z};
        shd_set_lane(out->point, i, at);
        shd_set_lane(out->normal, i, (shd_vec3){side ? x : 0, side ? 0 : cap, side ? z : 0});
    }
}

static void place_cone(const shd_work *restrict w, shd_surfaces *restrict out) {
    const double slope = 0.70710678118654752;
    SHD_EACH_LANE(i) {
        const shd_vec3 p = shd_lane_at(w, i, w->t[i]);
        const double square = p.x * p.x + p.z * p.z, inverse = shd_inverse_root(square);
        const double x = p.x * inverse, z = p.z * inverse, wanted = 0.5 - p.y;
        const bool side = w->face[i] == SIDE;
        const bool apex = !(square > DBL_MIN); /* it has no normal, and gets (0, 1, 0) */
        const shd_vec3 n = {apex ? 0 : slope * x, apex ? 1 : slope, apex ? 0 : slope * z},
                       at = {side ? x * wanted : p.x, side ? p.y : -0.5, side ? z * wanted : p.z};
        shd_set_lane(out->point, i, at);
        shd_set_lane(out->normal, i, (shd_vec3){side ? n.x : 0, side ? n.y : -1, side ? n.z : 0});
    }
}

void SHD_VARIANT(shd_find_surfaces)(shd_shape shape, double tube, shd_work *work) {
    if (shape == SHD_SPHERE) find_sphere(work);
    if (shape == SHD_PLANE || shape == SHD_DISC) find_plane(shape == SHD_DISC, work);
    if (shape == SHD_BOX) find_box(work);
    if (shape == SHD_CYLINDER) find_cylinder(work);
    if (shape == SHD_CONE) find_cone(work);
    if (shape == SHD_TORUS) SHD_VARIANT(shd_find_torus)(tube, work);
}

void SHD_VARIANT(shd_place_surfaces)(shd_shape shape, double tube, const shd_work *work,
                                     shd_surfaces *out) {
    if (shape == SHD_SPHERE) place_sphere(work, out);
    if (shape == SHD_PLANE || shape == SHD_DISC) place_plane(work, out);
    if (shape == SHD_BOX) place_box(work, out);
    if (shape == SHD_CYLINDER) place_cylinder(work, out);
    if (shape == SHD_CONE) place_cone(work, out);
    if (shape == SHD_TORUS) SHD_VARIANT(shd_place_torus)(tube, work, out);
}
