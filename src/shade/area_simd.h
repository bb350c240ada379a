/* Rectangles of light in vectors of points: Lambert's formula, and the moments of lobes with
 * integer exponents, along the boundary of what of a rectangle is before the surface and the lobe.
 * The equations are those of area_contour.c. Only for brdf.simd.c. */
#pragma once

#include "shade/area_contour.h"
#include "shade/shape_simd.h"

/* Four edges, and one for each horizon that cuts them. */
enum { EDGES_MOST = 6 };

/* The boundary of what points see of a rectangle, in the frame of shd_seen. Edges that are not in
 * `is` are cut off. */
typedef struct outline {
    double a[3], b[3];
    shd_vd center[3], height;
    shd_vd x[EDGES_MOST][2], y[EDGES_MOST][2]; /* from, to */
    shd_md is[EDGES_MOST];
    int count;
} outline;

/* An edge as a great circle's arc. */
typedef struct arc {
    shd_vd from[3], to[3];  /* its ends, as seen from the point */
    shd_vd around[3], size; /* from x to, and how long that is */
    shd_md is;
} arc;

/* Heights over a plane through the point are k[0] + k[1] x + k[2] y. */
SHD_INLINE void lay_plane(const outline *o, const shd_vd n[3], shd_vd k[3]) {
    k[0] = dot_lanes(n, o->center);
    k[1] = k[2] = shd_vd_set(0);
    for (int c = 0; c < 3; c++) {
        k[1] += n[c] * shd_vd_set(o->a[c]);
        k[2] += n[c] * shd_vd_set(o->b[c]);
    }
}

SHD_INLINE shd_vd height_at(const shd_vd k[3], shd_vd x, shd_vd y) {
    return k[0] + (k[1] * x + k[2] * y);
}

/* What is before a plane: `some` of the outline, or all of it, which is `whole`, too. */
SHD_INLINE void find_side(const outline *o, const shd_vd k[3], shd_vd slack, shd_md *some,
                          shd_md *whole) {
    shd_vd low = shd_vd_set(1e300), high = -low;
    for (int i = 0; i < o->count; i++) {
        const shd_vd h = height_at(k, o->x[i][0], o->y[i][0]);
        low = shd_vd_select(o->is[i], shd_vd_min(h, low), low);
        high = shd_vd_select(o->is[i], shd_vd_max(h, high), high);
    }
    *some = shd_vd_gt(high, slack);
    *whole = shd_md_and(*some, shd_md_not(shd_vd_gt(shd_vd_set(0), low)));
}

/* Cuts off what is not over the plane, in the lanes of `asked`. A convex boundary goes under it
 * once and comes up once; one more edge closes it. */
SHD_INLINE void cut_off(outline *o, const shd_vd k[3], shd_md asked) {
    const shd_vd zero = shd_vd_set(0), one = shd_vd_set(1);
    shd_vd *x, *y, down[2] = {zero, zero}, up[2] = {zero, zero};
    shd_md downs = shd_vd_gt(zero, zero), ups = downs;
    for (int i = 0; i < o->count; i++) {
        shd_vd h[2];
        x = o->x[i];
        y = o->y[i];
        for (int e = 0; e < 2; e++) h[e] = shd_vd_select(asked, height_at(k, x[e], y[e]), one);
        const shd_md begins = shd_vd_gt(h[0], zero), ends = shd_vd_gt(h[1], zero),
                     leaves = shd_md_and(o->is[i], shd_md_and(begins, shd_md_not(ends))),
                     enters = shd_md_and(o->is[i], shd_md_and(ends, shd_md_not(begins))),
                     crosses = shd_md_or(leaves, enters);
        o->is[i] = shd_md_and(o->is[i], shd_md_or(begins, ends));
        const shd_vd t = h[0] / shd_vd_select(crosses, h[0] - h[1], one),
                     at[2] = {x[0] + t * (x[1] - x[0]), y[0] + t * (y[1] - y[0])};
        for (int c = 0; c < 2; c++) {
            down[c] = shd_vd_select(leaves, at[c], down[c]);
            up[c] = shd_vd_select(enters, at[c], up[c]);
        }
        x[1] = shd_vd_select(leaves, at[0], x[1]);
        y[1] = shd_vd_select(leaves, at[1], y[1]);
        x[0] = shd_vd_select(enters, at[0], x[0]);
        y[0] = shd_vd_select(enters, at[1], y[0]);
        downs = shd_md_or(downs, leaves);
        ups = shd_md_or(ups, enters);
    }
    x = o->x[o->count];
    y = o->y[o->count];
    x[0] = down[0];
    x[1] = up[0];
    y[0] = down[1];
    y[1] = up[1];
    o->is[o->count++] = shd_md_and(downs, ups);
}

SHD_INLINE arc arc_of(const outline *o, int i) {
    const shd_vd *x = o->x[i], *y = o->y[i], one = shd_vd_set(1);
    shd_vd step[3];
    arc e;
    for (int c = 0; c < 3; c++) {
        const shd_vd a = shd_vd_set(o->a[c]), b = shd_vd_set(o->b[c]);
        e.from[c] = o->center[c] + (a * x[0] + b * y[0]);
        e.to[c] = o->center[c] + (a * x[1] + b * y[1]);
        step[c] = a * (x[1] - x[0]) + b * (y[1] - y[0]);
    }
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, f = (c + 2) % 3;
        e.around[c] = e.from[d] * step[f] - e.from[f] * step[d];
    }
    const shd_vd squared = dot_lanes(e.around, e.around);
    e.is = shd_vd_gt_in(o->is[i], squared, shd_vd_set(0));
    e.size = shd_vd_sqrt(shd_vd_select(e.is, squared, one));
    return e;
}

/* Twice the integral of N.L dw. */
SHD_INLINE shd_vd sum_diffuse(const outline *o, const shd_vd n[3]) {
    shd_vd sum = shd_vd_set(0);
    for (int i = 0; i < o->count; i++) {
        const arc e = arc_of(o, i);
        const shd_vd length = shd_atan2_64(e.size, dot_lanes(e.from, e.to));
        sum += shd_vd_mul_in(e.is, length, dot_lanes(n, e.around) / e.size);
    }
    return sum;
}

/* An edge for lobes around an axis W. With z = W.u along it: z and -dz/dt at both ends, and the
 * square of the largest z of its great circle. */
typedef struct swing {
    shd_vd z[2], y[2], squared;
    shd_vd length, offset; /* angle; W.around */
    shd_md is;
} swing;

/* Of the triangle between an edge and the rectangle's middle, with a sign: Van Oosterom and
 * Strackee 1983. */
SHD_INLINE shd_vd solid_angle_of(const outline *o, int i, const arc *e, const shd_vd lengths[2]) {
    const shd_vd *x = o->x[i], *y = o->y[i], middle = dot_lanes(o->center, o->center),
                 twice = x[0] * y[1] - x[1] * y[0], far = shd_vd_sqrt(middle),
                 under = far * lengths[0] * lengths[1] +
                         dot_lanes(o->center, e->from) * lengths[1] +
                         dot_lanes(e->from, e->to) * far + dot_lanes(e->to, o->center) * lengths[0];
    const shd_vd angle = shd_atan2_64(o->height * twice, under);
    return shd_vd_mul_in(o->is[i], angle, shd_vd_set(2));
}

SHD_INLINE swing swing_of(const arc *e, const shd_vd w[3], const shd_vd lengths[2]) {
    const shd_vd one = shd_vd_set(1), inverse = one / e->size, first = one / lengths[0],
                 both = first / lengths[1], cosine = dot_lanes(e->from, e->to) * both,
                 sine = e->size * both;
    shd_vd along[3];
    for (int c = 0; c < 3; c++) {
        const int d = (c + 1) % 3, f = (c + 2) % 3;
        along[c] = e->around[d] * e->from[f] - e->around[f] * e->from[d];
    }
    const shd_vd a = dot_lanes(w, e->from) * first, b = dot_lanes(w, along) * (inverse * first);
    return (swing){.z = {a, a * cosine + b * sine},
                   .y = {-b, a * sine - b * cosine},
                   .squared = a * a + b * b,
                   .offset = dot_lanes(w, e->around) * inverse,
                   .is = e->is};
}

/* The sum of the moments of z of order n - 1, n - 3 ... to 0, or to 1. */
SHD_INLINE shd_vd sum_moments(const swing *s, int n) {
    const bool odd = n % 2;
    const shd_vd z2[2] = {s->z[0] * s->z[0], s->z[1] * s->z[1]};
    shd_vd power[2] = {odd ? s->z[0] : z2[0], odd ? s->z[1] : z2[1]};
    shd_vd moment = odd ? s->length : s->y[1] - s->y[0], sum = moment;
    for (int k = odd ? 2 : 3; k < n; k += 2) {
        const shd_vd share = s->squared * shd_vd_set((k - 1) / (double)k);
        moment =
            (power[1] * s->y[1] - power[0] * s->y[0]) * shd_vd_set(1 / (double)k) + share * moment;
        sum += moment;
        for (int i = 0; i < 2; i++) power[i] *= z2[i];
    }
    return shd_vd_mul_in(s->is, sum, s->offset);
}

/* sums[k] = the integral of (L.W)^n dw. */
SHD_INLINE void sum_lobes(const outline *o, const shd_vd w[3], const shd_plan_lobe *lobes,
                          size_t count, shd_vd *sums) {
    bool odd = false, even = false;
    for (size_t k = 0; k < count; k++) {
        sums[k] = shd_vd_set(0);
        *((int)lobes[k].shininess % 2 ? &odd : &even) = true;
    }
    for (int i = 0; i < o->count; i++) {
        const arc e = arc_of(o, i);
        const shd_vd lengths[2] = {shd_vd_sqrt(dot_lanes(e.from, e.from)),
                                   shd_vd_sqrt(dot_lanes(e.to, e.to))};
        const shd_vd angle = even ? solid_angle_of(o, i, &e, lengths) : shd_vd_set(0);
        swing s = swing_of(&e, w, lengths);
        if (odd) s.length = shd_atan2_64(e.size, dot_lanes(e.from, e.to));
        for (size_t k = 0; k < count; k++) {
            const int n = (int)lobes[k].shininess;
            if (n % 2 == 0) sums[k] += angle;
            if (n > 0) sums[k] += sum_moments(&s, n);
        }
    }
    for (size_t k = 0; k < count; k++) sums[k] *= shd_vd_set(1 / (lobes[k].shininess + 1));
}

/* How a rectangle stands to points. */
typedef struct rectangle {
    outline edge;
    shd_vd toward[3], size, slack;
    shd_md lit, left; /* it shines there; it is for the reference to say */
} rectangle;

/* As shd_see_area. Small ones are left, which other formulas are for (area.c). */
SHD_INLINE void see_rectangle(const shd_light *light, const points *at, double scale,
                              rectangle *out) {
    static const double sx[] = {-1, 1, 1, -1, -1}, sy[] = {-1, -1, 1, 1, -1};
    const double extent = shd_length((shd_vec3){light->size[0], light->size[1], 0}) / 2;
    const sighting m = find_middle(light, at, scale);
    const shd_vd one = shd_vd_set(1), unit = one / (m.distance + shd_vd_set(extent));
    outline *o = &out->edge;
    out->size = shd_vd_set(extent) / m.distance;
    out->slack = m.slack * unit;
    out->lit = shd_vd_gt_in(m.held, m.ahead, m.slack);
    out->left = shd_md_or(shd_md_not(m.held),
                          shd_md_and(out->lit, shd_vd_gt(shd_vd_set(SMALL_SHAPE), out->size)));
    const shd_vec3 b = shd_scale(light->up, -1);
    *o = (outline){.a = {light->across.x, light->across.y, light->across.z},
                   .b = {b.x, b.y, b.z},
                   .height = m.ahead * unit,
                   .count = 4};
    for (int c = 0; c < 3; c++) {
        out->toward[c] = m.path[c] / m.distance;
        o->center[c] = m.path[c] * unit;
    }
    for (int i = 0; i < 4; i++) {
        for (int e = 0; e < 2; e++) {
            o->x[i][e] = shd_vd_set(sx[i + e] * light->size[0] / 2) * unit;
            o->y[i][e] = shd_vd_set(sy[i + e] * light->size[1] / 2) * unit;
        }
        o->is[i] = shd_md_not(shd_vd_gt(one, one));
    }
}

/* Lanes in which the rectangle shines over the surface's horizon: it is cut off there. Where it is
 * as good as a point, it is left. */
SHD_INLINE void rise_over(rectangle *r, const shd_vd n[3], double point_off) {
    shd_vd k[3];
    shd_md some, whole;
    lay_plane(&r->edge, n, k);
    find_side(&r->edge, k, r->slack, &some, &whole);
    const shd_vd off = r->size * r->size * shd_vd_set(shd_area_off(1, 1));
    const shd_md distant = shd_md_and(whole, shd_md_not(shd_vd_gt(off, shd_vd_set(point_off))));
    r->left = shd_md_or(r->left, shd_md_and(r->lit, distant));
    r->lit = shd_md_and(shd_md_and(r->lit, some), shd_md_not(r->left));
    const shd_md part = shd_md_and(r->lit, shd_md_not(whole));
    if (shd_md_any(part)) cut_off(&r->edge, k, part);
}

/* The same of lobes: where they shine, but for their powers. *most is at least the largest L.W. */
SHD_INLINE shd_md rise_over_lobes(rectangle *r, const shd_vd w[3], shd_vd *most) {
    const shd_vd zero = shd_vd_set(0);
    shd_vd k[3];
    shd_md some, whole;
    lay_plane(&r->edge, w, k);
    find_side(&r->edge, k, zero, &some, &whole);
    const shd_md lit = shd_md_and(r->lit, some), part = shd_md_and(lit, shd_md_not(whole));
    if (shd_md_any(part)) cut_off(&r->edge, k, part);
    *most = most_of(w, r->toward, r->size);
    return lit;
}
