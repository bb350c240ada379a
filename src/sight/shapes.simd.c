/* Analytic shapes in their unit form, a batch of rays at a time. Compiled once an instruction set.
 * Loops have no branches: a formula without an answer gives infinity or not-a-number, which no
 * comparison takes for a hit. */
#include <float.h>

#include "sight/rays.h"

/* ---- Finding: t and face. ---- */

/* The discriminant is made from the distance of the line to the center, as in ball.simd.c. */
static void find_sphere(shd_work *restrict w) {
    SHD_EACH_LANE(i) {
        double ox = w->ox[i], oy = w->oy[i], oz = w->oz[i];
        double dx = w->dx[i], dy = w->dy[i], dz = w->dz[i], near = w->near[i];
        double inverse = 1 / (dx * dx + dy * dy + dz * dz);
        double middle = -(ox * dx + oy * dy + oz * dz) * inverse;
        double x = ox + dx * middle, y = oy + dy * middle, z = oz + dz * middle;
        double inside = 1 - (x * x + y * y + z * z);
        double half = sqrt(inside * inverse);
        double t = middle - half > near ? middle - half : middle + half;
        t = t > near ? t : INFINITY;
        w->t[i] = inside >= 0 ? t : INFINITY;
    }
}

static void find_plane(bool disc, shd_work *restrict w) {
    const double reach = disc ? 1 : INFINITY;
    SHD_EACH_LANE(i) {
        double t = -w->oy[i] / w->dy[i];
        double x = w->ox[i] + w->dx[i] * t, z = w->oz[i] + w->dz[i] * t;
        double held = x * x + z * z <= reach ? t : INFINITY;
        /* Beyond f64 there is no point to shade. */
        held = fabs(x) <= DBL_MAX ? held : INFINITY;
        held = fabs(z) <= DBL_MAX ? held : INFINITY;
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
    find_slab(w->ox, w->dx, 0, enter, leave, enter_axis, leave_axis);
    find_slab(w->oy, w->dy, 1, enter, leave, enter_axis, leave_axis);
    find_slab(w->oz, w->dz, 2, enter, leave, enter_axis, leave_axis);
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
SHD_ALWAYS void take_face(bool valid, double candidate, double which, double near, nearest *to) {
    double taken = valid ? candidate : INFINITY;
    taken = taken > near ? taken : INFINITY;
    to->face = taken < to->t ? which : to->face;
    to->t = taken < to->t ? taken : to->t;
}

/* Takes the cap, a disc of radius 1, whose plane lane i meets at `candidate`. */
SHD_ALWAYS void take_cap(const shd_work *restrict w, int i, double candidate, double which,
                         nearest *to) {
    double x = w->ox[i] + w->dx[i] * candidate, z = w->oz[i] + w->dz[i] * candidate;
    take_face(x * x + z * z <= 1, candidate, which, w->near[i], to);
}

/* Takes the side, between y = -1/2 and 1/2, which lane i meets at the roots of a t^2 + 2 b t + c.
 * These come without cancellation. If there are none, a zero was divided by, or a root taken of a
 * negative number. */
SHD_ALWAYS void take_side(const shd_work *restrict w, int i, double a, double b, double c,
                          nearest *to) {
    double root = sqrt(b * b - a * c);
    double q = b > 0 ? -b - root : -b + root;
    double first = c / q, second = q / a;
    take_face(fabs(w->oy[i] + w->dy[i] * first) <= 0.5, first, SIDE, w->near[i], to);
    take_face(fabs(w->oy[i] + w->dy[i] * second) <= 0.5, second, SIDE, w->near[i], to);
}

static void find_cylinder(shd_work *restrict w) {
    SHD_EACH_LANE(i) {
        double ox = w->ox[i], oy = w->oy[i], oz = w->oz[i], dx = w->dx[i], dz = w->dz[i];
        double inverse = 1 / w->dy[i];
        nearest to = {INFINITY, SIDE};
        take_cap(w, i, (-0.5 - oy) * inverse, BOTTOM, &to);
        take_cap(w, i, (0.5 - oy) * inverse, TOP, &to);
        take_side(w, i, dx * dx + dz * dz, ox * dx + oz * dz, ox * ox + oz * oz - 1, &to);
        w->t[i] = to.t;
        w->face[i] = to.face;
    }
}

/* x^2 + z^2 = (1/2 - y)^2 for y in [-1/2, 1/2] */
static void find_cone(shd_work *restrict w) {
    SHD_EACH_LANE(i) {
        double ox = w->ox[i], oy = w->oy[i], oz = w->oz[i];
        double dx = w->dx[i], dy = w->dy[i], dz = w->dz[i], k = 0.5 - oy;
        nearest to = {INFINITY, SIDE};
        take_cap(w, i, (-0.5 - oy) / dy, BOTTOM, &to);
        take_side(w, i, dx * dx + dz * dz - dy * dy, ox * dx + oz * dz + k * dy,
                  ox * ox + oz * oz - k * k, &to);
        w->t[i] = to.t;
        w->face[i] = to.face;
    }
}

/* ---- Placing: points, snapped onto the shape, and outward normals. ---- */

static void place_sphere(const shd_work *restrict w, shd_surfaces *restrict out) {
    SHD_EACH_LANE(i) {
        double x = w->ox[i] + w->dx[i] * w->t[i], y = w->oy[i] + w->dy[i] * w->t[i],
               z = w->oz[i] + w->dz[i] * w->t[i];
        double scale = shd_inverse_root(x * x + y * y + z * z);
        out->point[0][i] = out->normal[0][i] = x * scale;
        out->point[1][i] = out->normal[1][i] = y * scale;
        out->point[2][i] = out->normal[2][i] = z * scale;
    }
}

static void place_plane(const shd_work *restrict w, shd_surfaces *restrict out) {
    SHD_EACH_LANE(i) {
        out->point[0][i] = w->ox[i] + w->dx[i] * w->t[i];
        out->point[1][i] = 0;
        out->point[2][i] = w->oz[i] + w->dz[i] * w->t[i];
        out->normal[0][i] = 0;
        out->normal[1][i] = 1;
        out->normal[2][i] = 0;
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
    place_on_slab(w->ox, w->dx, 0, w, out->point[0], out->normal[0]);
    place_on_slab(w->oy, w->dy, 1, w, out->point[1], out->normal[1]);
    place_on_slab(w->oz, w->dz, 2, w, out->point[2], out->normal[2]);
}

static void place_cylinder(const shd_work *restrict w, shd_surfaces *restrict out) {
    SHD_EACH_LANE(i) {
        double x = w->ox[i] + w->dx[i] * w->t[i], y = w->oy[i] + w->dy[i] * w->t[i],
               z = w->oz[i] + w->dz[i] * w->t[i];
        double inverse = shd_inverse_root(x * x + z * z), side = w->face[i];
        double cap = side == TOP ? 1 : -1;
        out->point[0][i] = side == SIDE ? x * inverse : x;
        out->point[1][i] = side == SIDE ? y : 0.5 * cap;
        out->point[2][i] = side == SIDE ? z * inverse : z;
        out->normal[0][i] = side == SIDE ? x * inverse : 0;
        out->normal[1][i] = side == SIDE ? 0 : cap;
        out->normal[2][i] = side == SIDE ? z * inverse : 0;
    }
}

static void place_cone(const shd_work *restrict w, shd_surfaces *restrict out) {
    const double slope = 0.70710678118654752;
    SHD_EACH_LANE(i) {
        double x = w->ox[i] + w->dx[i] * w->t[i], y = w->oy[i] + w->dy[i] * w->t[i],
               z = w->oz[i] + w->dz[i] * w->t[i];
        double square = x * x + z * z, inverse = shd_inverse_root(square), side = w->face[i];
        double ax = x * inverse, az = z * inverse, wanted = 0.5 - y;
        bool apex = !(square > DBL_MIN); /* it has no normal, and gets (0, 1, 0) */
        double up = apex ? 1 : slope, out_x = apex ? 0 : slope * ax, out_z = apex ? 0 : slope * az;
        out->point[0][i] = side == SIDE ? ax * wanted : x;
        out->point[1][i] = side == SIDE ? y : -0.5;
        out->point[2][i] = side == SIDE ? az * wanted : z;
        out->normal[0][i] = side == SIDE ? out_x : 0;
        out->normal[1][i] = side == SIDE ? up : -1;
        out->normal[2][i] = side == SIDE ? out_z : 0;
    }
}

void SHD_VARIANT(shd_find_surfaces)(shd_shape shape, double tube, shd_work *work) {
    switch (shape) {
    case SHD_SPHERE:
        find_sphere(work);
        break;
    case SHD_PLANE:
    case SHD_DISC:
        find_plane(shape == SHD_DISC, work);
        break;
    case SHD_BOX:
        find_box(work);
        break;
    case SHD_CYLINDER:
        find_cylinder(work);
        break;
    case SHD_CONE:
        find_cone(work);
        break;
    case SHD_TORUS:
        SHD_VARIANT(shd_find_torus)(tube, work);
        break;
    case SHD_MESH:
    case SHD_SHAPE_COUNT:
        break;
    }
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
