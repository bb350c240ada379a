/* Discs and spheres of light in vectors of points, where no horizon cuts them: the integrals along
 * whole circles of area_contour.c, diffuse light in closed form and lobes by equal steps. Only for
 * brdf.simd.c. */
#pragma once

#include "shade/shape_simd.h"

/* The circle that bounds what points see, in the frame of shd_seen. */
typedef struct circle {
    shd_vd a[3], b[3], away[3], center[3], height, radius;
    shd_vd toward[3], size, slack;
    shd_md lit, left; /* it shines there; it is for the reference to say */
} circle;

/* As shd_perpendicular. */
SHD_INLINE void cross_lanes(const shd_vd n[3], shd_vd a[3], shd_vd b[3]) {
    const shd_vd one = shd_vd_set(1),
                 sign = shd_vd_select(shd_vd_gt(shd_vd_set(0), n[2]), -one, one),
                 k = -one / (sign + n[2]), m = n[0] * n[1] * k;
    a[0] = one + sign * n[0] * n[0] * k;
    a[1] = sign * m;
    a[2] = -sign * n[0];
    b[0] = m;
    b[1] = sign + n[1] * n[1] * k;
    b[2] = -n[1];
}

SHD_INLINE void see_sphere(const sighting *m, circle *out) {
    const shd_vd one = shd_vd_set(1), s = out->size,
                 cosine = shd_vd_sqrt(shd_vd_max((one - s) * (one + s), shd_vd_set(0)));
    out->lit = shd_vd_gt_in(m->held, cosine, shd_vd_set(0));
    /* On the sphere itself, rounding says what is inside: that of the reference. */
    const shd_vd off = s - one;
    out->left = shd_vd_gt_in(m->held, shd_vd_set(1e-12), shd_vd_max(off, -off));
    out->lit = shd_md_and(out->lit, shd_md_not(out->left));
    out->slack = m->slack / m->distance;
    out->height = cosine;
    out->radius = s;
    for (int c = 0; c < 3; c++) {
        out->away[c] = out->toward[c];
        out->center[c] = out->toward[c] * cosine;
    }
    cross_lanes(out->away, out->a, out->b);
}

SHD_INLINE void see_disc(const shd_light *light, const sighting *m, circle *out) {
    const shd_vec3 a = light->across, b = shd_scale(light->up, -1), n = light->direction;
    const double ways[3][3] = {{a.x, a.y, a.z}, {b.x, b.y, b.z}, {-n.x, -n.y, -n.z}};
    const shd_vd unit = shd_vd_set(1) / (m->distance + shd_vd_set(light->radius));
    out->lit = shd_vd_gt_in(m->held, m->ahead, m->slack);
    out->left = shd_vd_gt(unit, unit);
    out->slack = m->slack * unit;
    out->height = m->ahead * unit;
    out->radius = shd_vd_set(light->radius) * unit;
    for (int c = 0; c < 3; c++) {
        out->a[c] = shd_vd_set(ways[0][c]);
        out->b[c] = shd_vd_set(ways[1][c]);
        out->away[c] = shd_vd_set(ways[2][c]);
        out->center[c] = m->path[c] * unit;
    }
}

/* As shd_see_area. Small ones are left, which other formulas are for (area.c). */
SHD_INLINE void see_circle(const shd_light *light, const points *at, double scale, circle *out) {
    const sighting m = find_middle(light, at, scale);
    out->size = shd_vd_set(light->radius) / m.distance;
    for (int c = 0; c < 3; c++) out->toward[c] = m.path[c] / m.distance;
    if (light->type == SHD_LIGHT_SPHERE)
        see_sphere(&m, out);
    else
        see_disc(light, &m, out);
    const shd_md small = shd_vd_gt_in(out->lit, shd_vd_set(SMALL_SHAPE), out->size);
    out->left = shd_md_or(out->left, shd_md_or(shd_md_not(m.held), small));
}

/* Lanes of which a plane through the point has some of the circle before it, and all. */
SHD_INLINE void find_half(const circle *o, const shd_vd n[3], shd_vd slack, shd_md *some,
                          shd_md *whole) {
    const shd_vd k = dot_lanes(n, o->center), x = dot_lanes(n, o->a), y = dot_lanes(n, o->b),
                 reach = o->radius * shd_vd_sqrt(x * x + y * y);
    *some = shd_vd_gt(k + reach, slack);
    *whole = shd_md_and(*some, shd_md_not(shd_vd_gt(reach, k)));
}

/* Keeps the lanes that are lit by the whole circle. Those that a horizon cuts, and those where it
 * is as good as a point, are left. `lobes`: lobes are asked for, and *bright are lanes that have
 * some. */
SHD_INLINE void keep_whole(circle *o, const points *at, bool lobes, double point_off,
                           shd_md *bright) {
    shd_md some, whole, up, all;
    find_half(o, at->n, o->slack, &some, &whole);
    const shd_vd off = o->size * o->size * shd_vd_set(shd_area_off(1, 1));
    const shd_md distant = shd_md_not(shd_vd_gt(off, shd_vd_set(point_off)));
    shd_md cut = shd_md_or(shd_md_not(whole), distant);
    *bright = shd_vd_gt(off, off);
    if (lobes) {
        find_half(o, at->w, shd_vd_set(0), &up, &all);
        cut = shd_md_or(cut, shd_md_and(up, shd_md_not(all)));
        *bright = up;
    }
    o->left = shd_md_or(o->left, shd_md_and(shd_md_and(o->lit, some), cut));
    o->lit = shd_md_and(shd_md_and(o->lit, some), shd_md_not(o->left));
    *bright = shd_md_and(*bright, o->lit);
}

SHD_INLINE shd_vd triple(const shd_vd n[3], const shd_vd a[3], const shd_vd b[3]) {
    return n[0] * (a[1] * b[2] - a[2] * b[1]) + n[1] * (a[2] * b[0] - a[0] * b[2]) +
           n[2] * (a[0] * b[1] - a[1] * b[0]);
}

/* The integral of N.L dw. */
SHD_INLINE shd_vd sum_round_diffuse(const circle *o, const shd_vd n[3]) {
    const shd_vd r = o->radius, ca = dot_lanes(o->center, o->a), cb = dot_lanes(o->center, o->b),
                 aside = shd_vd_sqrt(ca * ca + cb * cb), h2 = o->height * o->height,
                 near = (aside - r) * (aside - r) + h2, far = (aside + r) * (aside + r) + h2,
                 root = shd_vd_sqrt(near * far), k = (near + far) * shd_vd_set(0.5);
    const shd_vd m1 = triple(n, o->center, o->b), m2 = -triple(n, o->center, o->a),
                 turned = (m1 * ca + m2 * cb) * shd_vd_set(2) / (k + root);
    const shd_vd sum = r * r * (dot_lanes(n, o->away) - turned) / root;
    return shd_vd_max(sum * shd_vd_set(SHD_PI), shd_vd_set(0));
}

/* Of 128 equal steps around a circle. */
static inline double cosine_of_step(int i) {
    static const double quarter[33] = {1.0,
                                       0.9987954562051724,
                                       0.9951847266721969,
                                       0.989176509964781,
                                       0.9807852804032304,
                                       0.970031253194544,
                                       0.9569403357322088,
                                       0.9415440651830208,
                                       0.9238795325112867,
                                       0.9039892931234433,
                                       0.881921264348355,
                                       0.8577286100002721,
                                       0.8314696123025452,
                                       0.8032075314806449,
                                       0.773010453362737,
                                       0.7409511253549591,
                                       0.7071067811865476,
                                       0.6715589548470184,
                                       0.6343932841636455,
                                       0.5956993044924334,
                                       0.5555702330196022,
                                       0.5141027441932218,
                                       0.47139673682599764,
                                       0.4275550934302821,
                                       0.3826834323650898,
                                       0.33688985339222005,
                                       0.2902846772544624,
                                       0.2429801799032639,
                                       0.19509032201612828,
                                       0.14673047445536175,
                                       0.0980171403295606,
                                       0.049067674327418015,
                                       0.0};
    i &= 127;
    if (i > 64) i = 128 - i;
    return i > 32 ? -quarter[64 - i] : quarter[i];
}

/* What is the same for all lobes around an axis W: where the circle is nearest to it, about. */
typedef struct turning {
    const circle *o;
    const shd_vd *w;
    shd_vd cosine, sine;
} turning;

SHD_INLINE turning turn_to(const circle *o, const shd_vd w[3]) {
    const shd_vd ahead = dot_lanes(w, o->away), zero = shd_vd_set(0), one = shd_vd_set(1);
    shd_vd at[3];
    for (int c = 0; c < 3; c++) at[c] = w[c] * o->height - o->center[c] * ahead;
    const shd_vd x = dot_lanes(at, o->a), y = dot_lanes(at, o->b), squared = x * x + y * y;
    const shd_md is = shd_vd_gt(squared, shd_vd_set(0x1p-200));
    const shd_vd length = shd_vd_sqrt(shd_vd_select(is, squared, one));
    return (turning){o, w, shd_vd_select(is, x / length, one), shd_vd_select(is, y / length, zero)};
}

/* At a step: the integrand without its fall, and 1 - z there. */
SHD_INLINE shd_vd step_round(const turning *t, int step, shd_vd *d) {
    const circle *o = t->o;
    const shd_vd c0 = shd_vd_set(cosine_of_step(step)), s0 = shd_vd_set(cosine_of_step(step + 96)),
                 x = o->radius * (t->cosine * c0 - t->sine * s0),
                 y = o->radius * (t->sine * c0 + t->cosine * s0);
    shd_vd p[3], along[3], off[3];
    for (int c = 0; c < 3; c++) {
        p[c] = o->center[c] + (o->a[c] * x + o->b[c] * y);
        along[c] = o->b[c] * x - o->a[c] * y;
    }
    const shd_vd squared = dot_lanes(p, p), inverse = shd_vd_set(1) / shd_vd_sqrt(squared);
    for (int c = 0; c < 3; c++) off[c] = p[c] * inverse - t->w[c];
    *d = dot_lanes(off, off) * shd_vd_set(0.5);
    return triple(t->w, p, along) * (inverse * inverse);
}

/* Adds a step to the sums of lobes: (1 - z^(n+1)) / (1 - z^2) each. */
SHD_INLINE void add_step(const turning *t, int step, double twice, const shd_plan_lobe *lobes,
                         size_t count, shd_vd *values) {
    const shd_vd tiny = shd_vd_set(1e-300);
    shd_vd d, part = step_round(t, step, &d) * shd_vd_set(twice);
    const shd_vd log = shd_log1m64(below_one(d)), under = d * (shd_vd_set(2) - d);
    const shd_md is = shd_vd_gt(d, tiny);
    const shd_vd over = part / shd_vd_select(is, under, shd_vd_set(1));
    for (size_t k = 0; k < count; k++) {
        const shd_vd power = shd_vd_set(lobes[k].shininess + 1),
                     fall = shd_fall64(shd_vd_max(log * power, shd_vd_set(-700)));
        values[k] += shd_vd_select(is, over * fall, part * power * shd_vd_set(0.5));
    }
}

/* sums[k] = the integral of (L.W)^n dw, in the lanes asked[k]. Steps are halved until that changes
 * little, as in area_contour.c. Returns the lanes in which they were too many. `even`: both ways
 * around are the same. */
SHD_INLINE shd_md sum_round_lobes(const circle *o, const shd_vd w[3], bool even,
                                  const shd_plan_lobe *lobes, size_t count, const shd_md *asked,
                                  shd_vd *sums) {
    enum { FIRST = 16, MOST = 128 };
    static const double TOLERANCE = 1e-8;
    const turning t = turn_to(o, w);
    const shd_vd one = shd_vd_set(1), zero = shd_vd_set(0);
    shd_vd values[SHD_WIDE_LOBES];
    shd_md open[SHD_WIDE_LOBES], any = shd_vd_gt(zero, zero);
    for (size_t k = 0; k < count; k++) {
        values[k] = sums[k] = zero;
        open[k] = asked[k];
    }
    for (int n = FIRST; n <= MOST; n *= 2) {
        const int stride = MOST / n, last = even ? n / 2 : n - 1;
        for (int i = n > FIRST; i <= last; i += n > FIRST ? 2 : 1)
            add_step(&t, i * stride, even && i && i < n / 2 ? 2 : 1, lobes, count, values);
        any = shd_vd_gt(zero, zero);
        for (size_t k = 0; k < count; k++) {
            const double power = lobes[k].shininess + 1;
            const shd_vd sum = values[k] * shd_vd_set(2 * SHD_PI / n), change = sum - sums[k],
                         size = smaller_of(o->size, one),
                         most = smaller_of(one, shd_vd_set(power) * size * size) *
                                shd_vd_set(TOLERANCE);
            sums[k] = shd_vd_select(open[k], sum, sums[k]);
            if (n > FIRST)
                open[k] = shd_md_and(open[k], shd_vd_gt(shd_vd_max(change, -change), most));
            any = shd_md_or(any, open[k]);
        }
        if (!shd_md_any(any)) break;
    }
    for (size_t k = 0; k < count; k++)
        sums[k] = shd_vd_max(sums[k] * shd_vd_set(1 / (lobes[k].shininess + 1)), zero);
    return any;
}
