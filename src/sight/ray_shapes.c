/* Rays meet analytic shapes in their unit form. */
#include <float.h>

#include "plan/tier.h"
#include "sight/ray_parts.h"

/* The part of a line within a convex shape, with the outward normals at its ends. */
typedef struct span {
    double t[2];
    shd_vec3 n[2];
    /* Whether the line has a point of it, because a ray starts there: what rounding says against
     * that is not believed. */
    bool some;
} span;

static void cut_span(span *s, int end, double t, shd_vec3 n) {
    if (end ? t < s->t[1] : t > s->t[0]) {
        s->t[end] = t;
        s->n[end] = n;
    }
}

/* Cuts by the slab between -1/2 and 1/2 of an axis. */
static void cut_slab(span *s, double o, double d, shd_vec3 axis) {
    if (d == 0) {
        if (fabs(o) > 0.5 && !s->some) s->t[1] = -INFINITY;
        return;
    }
    const double side = d > 0 ? 0.5 : -0.5;
    const shd_vec3 ahead = shd_scale(axis, d > 0 ? 1 : -1);
    cut_span(s, 0, (-side - o) / d, shd_scale(ahead, -1));
    cut_span(s, 1, (side - o) / d, ahead);
}

/* Cuts by a t^2 + 2 b t + c <= 0. Roots come without cancellation. `before`: of the two parts that
 * a < 0 leaves, the shape is in the first one. The normals are left to place_side. */
static void cut_quadric(span *s, double a, double b, double c, bool before) {
    const shd_vec3 later = {0, 0, 0};
    const double square = b * b - a * c;
    if (square < 0 && a > 0 && !s->some) {
        s->t[1] = -INFINITY;
        return;
    }
    if (a == 0 && b == 0) {
        if (c > 0 && !s->some) s->t[1] = -INFINITY;
        return;
    }
    const double root = sqrt(square > 0 ? square : 0), q = b > 0 ? -b - root : -b + root;
    double one = q != 0 ? c / q : 0, two = q / a;
    if (a == 0) {
        cut_span(s, b > 0, one, later);
        return;
    }
    const double low = one < two ? one : two, high = one < two ? two : one;
    if (a > 0) {
        cut_span(s, 0, low, later);
        cut_span(s, 1, high, later);
    } else {
        cut_span(s, before, before ? low : high, later);
    }
}

static void find_span(const shd_item *it, shd_vec3 o, shd_vec3 d, bool some, span *s) {
    *s = (span){{-INFINITY, INFINITY}, {{0, 0, 0}, {0, 0, 0}}, some};
    const shd_vec3 x = {1, 0, 0}, y = {0, 1, 0}, z = {0, 0, 1};
    const double across = d.x * d.x + d.z * d.z, toward = o.x * d.x + o.z * d.z,
                 away = o.x * o.x + o.z * o.z, k = 0.5 - o.y;
    if (it->shape == SHD_BOX) {
        cut_slab(s, o.x, d.x, x);
        cut_slab(s, o.y, d.y, y);
        cut_slab(s, o.z, d.z, z);
    } else if (it->shape == SHD_SPHERE) {
        /* The origin is where the ray is closest to the center. */
        const double inside = 1 - shd_dot(o, o), half = sqrt(fmax(0, inside) / shd_dot(d, d));
        s->t[0] = -half;
        s->t[1] = inside >= 0 || some ? half : -INFINITY;
    } else if (it->shape == SHD_CYLINDER) {
        cut_slab(s, o.y, d.y, y);
        cut_quadric(s, across, toward, away - 1, false);
    } else {
        cut_slab(s, o.y, d.y, y);
        cut_quadric(s, across - d.y * d.y, toward + k * d.y, away - k * k, d.y > 0);
    }
}

/* The point on the shape and the outward unit normal there, where `face` is that of a flat face or
 * 0. */
static void place_side(const shd_item *it, shd_vec3 p, shd_vec3 face, shd_meeting *out) {
    out->bend = face;
    out->local = p;
    if (face.x != 0) out->local.x = 0.5 * face.x;
    if (face.y != 0)
        out->local.y = it->shape == SHD_PLANE || it->shape == SHD_DISC ? 0 : 0.5 * face.y;
    if (face.z != 0) out->local.z = 0.5 * face.z;
    if (face.x != 0 || face.y != 0 || face.z != 0) return;
    if (it->shape == SHD_SPHERE) {
        shd_normalize(p, &p);
        out->local = out->bend = p;
        return;
    }
    const double ring = hypot(p.x, p.z), x = ring > 0 ? p.x / ring : 1,
                 z = ring > 0 ? p.z / ring : 0;
    if (it->shape == SHD_CYLINDER) {
        out->local = (shd_vec3){x, p.y, z};
        out->bend = (shd_vec3){x, 0, z};
    } else if (it->shape == SHD_CONE) {
        const double half = 0.70710678118654752, wide = 0.5 - p.y;
        out->local = (shd_vec3){x * wide, p.y, z * wide};
        out->bend = (shd_vec3){half * x, half, half * z};
    } else { /* torus */
        shd_vec3 n = {0, 1, 0};
        shd_normalize((shd_vec3){p.x - x, p.y, p.z - z}, &n);
        out->local = shd_madd((shd_vec3){x, 0, z}, n, it->tube);
        out->bend = n;
    }
}

/* How far rounding may have moved t. `shift`: how far the origin was moved. */
static double rounding_of(const shd_item *it, const shd_local_ray *r, double shift,
                          const shd_meeting *m) {
    const double n[3] = {fabs(m->bend.x), fabs(m->bend.y), fabs(m->bend.z)},
                 d[3] = {fabs(r->direction.x), fabs(r->direction.y), fabs(r->direction.z)},
                 o[3] = {r->carried.x, r->carried.y, r->carried.z};
    const bool flat = it->shape == SHD_PLANE || it->shape == SHD_DISC;
    const double size = flat ? 0 : it->shape == SHD_CONE ? 1 / hypot(m->local.x, m->local.z) : 1;
    double sum = SHD_HIT_ROUNDING * size;
    for (int k = 0; k < 3; k++)
        if (n[k] > 0) sum += n[k] * (o[k] + SHD_HIT_ROUNDING * d[k] * (fabs(m->t) + fabs(shift)));
    return sum / fabs(shd_dot(m->bend, r->direction));
}

static bool take_meeting(const shd_item *it, const shd_local_ray *r, double shift, double t,
                         shd_vec3 face, shd_meeting *out) {
    if (!isfinite(t) || !(t >= 0 && t < r->far)) return false;
    out->t = t;
    out->triangle = 0;
    out->u = out->v = 0;
    place_side(it, shd_madd(r->origin, r->direction, t), face, out);
    out->rounding = rounding_of(it, r, shift, out);
    return r->starts ? t >= 0 && !(t > r->far - out->rounding)
                     : shd_is_between(r, t, out->rounding);
}

static bool meet_plane(const shd_item *it, const shd_local_ray *r, shd_meeting *out) {
    const double t = -r->origin.y / r->direction.y, reach = it->shape == SHD_DISC ? 1 : INFINITY;
    if (r->starts || !take_meeting(it, r, 0, t, (shd_vec3){0, 1, 0}, out)) return false;
    const shd_vec3 p = out->local;
    return p.x * p.x + p.z * p.z <= reach && fabs(p.x) <= DBL_MAX && fabs(p.z) <= DBL_MAX;
}

static bool meet_torus(const shd_item *it, const shd_local_ray *r, shd_meeting *out) {
    double roots[4];
    const int count = shd_torus_roots(it->tube, r, roots);
    for (int k = 0; k < count; k++)
        if (take_meeting(it, r, 0, roots[k], (shd_vec3){0, 0, 0}, out)) return true;
    return false;
}

bool shd_meet_shape(const shd_item *it, const shd_local_ray *r, shd_meeting *out) {
    if (it->shape == SHD_PLANE || it->shape == SHD_DISC) return meet_plane(it, r, out);
    if (it->shape == SHD_TORUS) return meet_torus(it, r, out);
    if (r->starts && r->outward) return false; /* it is convex */
    const double shift = -shd_dot(r->origin, r->direction) / shd_dot(r->direction, r->direction);
    span s;
    find_span(it, shd_madd(r->origin, r->direction, shift), r->direction, r->starts, &s);
    if (!r->starts && !(s.t[0] <= s.t[1])) return false;
    if (!r->starts && take_meeting(it, r, shift, s.t[0] + shift, s.n[0], out)) return true;
    double leave = s.t[1] + shift;
    if (r->starts && leave < 0) leave = 0; /* on the edge of the face that it leaves by */
    return take_meeting(it, r, shift, leave, s.n[1], out);
}
