#include "attack/solids.h"

typedef struct found {
    point o, d;
    crossing *out;
    int count;
} found;

static point along(const found *f, real t) {
    return add(f->o, times(f->d, t));
}

static void put(found *f, real t, int part, bool flat, point normal) {
    if (!(t > 0) || f->count == MOST_CROSSINGS) return;
    f->out[f->count++] = (crossing){t, part, flat, along(f, t), normal};
}

/* Roots of a t^2 + 2 b t + c; their number. `disc` is b^2 - a c, as it is known best. */
static int quadratic(real a, real b, real c, real disc, real roots[2]) {
    if (disc < 0) return 0;
    const real q = -(b + (b < 0 ? -ROOT(disc) : ROOT(disc)));
    int count = 0;
    if (a != 0) roots[count++] = q / a;
    if (q != 0) roots[count++] = c / q;
    return count;
}

static void cross_sphere(const solid *s, found *f) {
    const real dd = dot(f->d, f->d), middle = -dot(f->o, f->d) / dd;
    const real away = length(along(f, middle)), r = s->radius;
    if (away > r) return;
    const real half = ROOT((r - away) * (r + away) / dd);
    for (int k = -1; k <= 1; k += 2)
        put(f, middle + k * half, 0, false, along(f, middle + k * half));
}

/* The level y, within the radius where that is not negative. */
static void cross_level(found *f, real y, real radius, int part, real up) {
    if (f->d.y == 0) return;
    const real t = (y - f->o.y) / f->d.y;
    point p = along(f, t);
    p.y = 0;
    if (radius >= 0 && !(length(p) <= radius)) return;
    put(f, t, part, true, (point){0, up, 0});
}

static void cross_box(const solid *s, found *f) {
    const real half[3] = {s->size.x / 2, s->size.y / 2, s->size.z / 2};
    const real o[3] = {f->o.x, f->o.y, f->o.z}, d[3] = {f->d.x, f->d.y, f->d.z};
    for (int axis = 0; axis < 3; axis++)
        for (int side = -1; side <= 1; side += 2) {
            if (d[axis] == 0) continue;
            const real t = (side * half[axis] - o[axis]) / d[axis];
            const int a = (axis + 1) % 3, b = (axis + 2) % 3;
            if (!(SIZE(o[a] + t * d[a]) <= half[a] && SIZE(o[b] + t * d[b]) <= half[b])) continue;
            real n[3] = {0, 0, 0};
            n[axis] = side;
            put(f, t, 2 * axis + (side > 0), true, (point){n[0], n[1], n[2]});
        }
}

/* x^2 + z^2 = (k0 + k1 y)^2 for y within half the height. */
static void cross_side(const solid *s, found *f, real k0, real k1) {
    const point o = f->o, d = f->d;
    const real oy = k0 + k1 * o.y, dy = k1 * d.y;
    const real a = d.x * d.x + d.z * d.z - dy * dy, b = o.x * d.x + o.z * d.z - oy * dy,
               c = o.x * o.x + o.z * o.z - oy * oy;
    /* b^2 - a c without its largest terms, which cancel. */
    const real turn = o.x * d.z - o.z * d.x, u = o.x * dy - d.x * oy, v = o.z * dy - d.z * oy;
    real roots[2];
    const int count = quadratic(a, b, c, u * u + v * v - turn * turn, roots);
    for (int i = 0; i < count; i++) {
        const point p = along(f, roots[i]);
        if (!(SIZE(p.y) <= s->height / 2)) continue;
        put(f, roots[i], 0, false, (point){p.x, -k1 * (k0 + k1 * p.y), p.z});
    }
}

static real value_of(const real *c, int degree, real t) {
    real v = c[degree];
    for (int k = degree - 1; k >= 0; k--) v = v * t + c[k];
    return v;
}

/* Real roots of c[0] + c[1] t + ... within [low, high], ascending: between those of the slope,
 * where the value changes its sign. */
static int roots_of(const real *c, int degree, real low, real high, real *out) {
    real slope[4], turns[6];
    int count = 0, stops = 0;
    if (degree == 0) return 0;
    for (int k = 0; k < degree; k++) slope[k] = (k + 1) * c[k + 1];
    turns[stops++] = low;
    stops += roots_of(slope, degree - 1, low, high, turns + 1);
    turns[stops++] = high;
    for (int i = 0; i + 1 < stops; i++) {
        real a = turns[i], b = turns[i + 1];
        const bool rises = value_of(c, degree, a) < 0;
        if (rises == (value_of(c, degree, b) < 0)) continue;
        for (int k = 0; k < HALVINGS; k++) {
            const real middle = (a + b) / 2;
            if ((value_of(c, degree, middle) < 0) == rises)
                a = middle;
            else
                b = middle;
        }
        out[count++] = (a + b) / 2;
    }
    return count;
}

/* (|p|^2 + R^2 - r^2)^2 = 4 R^2 (x^2 + z^2), around the point nearest to the centre. */
static void cross_torus(const solid *s, found *f) {
    const real R = s->radius, r = s->tube, far = (R + r) * (1 + (real)0x1p-20);
    const real size = length(f->d);
    const point d = times(f->d, 1 / size);
    const real middle = -dot(f->o, d);
    const point foot = add(f->o, times(d, middle));
    const real away = dot(foot, foot);
    if (!(away < far * far)) return;
    const real half = ROOT(far * far - away), k = away + R * R - r * r;
    const real c[5] = {k * k - 4 * R * R * (foot.x * foot.x + foot.z * foot.z),
                       -8 * R * R * (foot.x * d.x + foot.z * d.z),
                       2 * k - 4 * R * R * (d.x * d.x + d.z * d.z), 0, 1};
    real roots[4];
    const int count = roots_of(c, 4, -half, half, roots);
    for (int i = 0; i < count; i++) {
        const point p = add(foot, times(d, roots[i]));
        const real across = ROOT(p.x * p.x + p.z * p.z);
        point normal = p;
        if (across > 0) normal = sub(p, times((point){p.x, 0, p.z}, R / across));
        put(f, (middle + roots[i]) / size, 0, false, normal);
    }
}

int cross_solid(const solid *s, point o, point d, crossing out[MOST_CROSSINGS]) {
    found f = {o, d, out, 0};
    switch (s->form) {
    case SPHERE:
        cross_sphere(s, &f);
        break;
    case PLANE:
        cross_level(&f, 0, -1, 0, 1);
        break;
    case DISC:
        cross_level(&f, 0, s->radius, 0, 1);
        break;
    case BOX:
        cross_box(s, &f);
        break;
    case CYLINDER:
        cross_side(s, &f, s->radius, 0);
        cross_level(&f, -s->height / 2, s->radius, 1, -1);
        cross_level(&f, s->height / 2, s->radius, 2, 1);
        break;
    case CONE: /* its radius is k (h/2 - y) */
        cross_side(s, &f, s->radius / 2, -s->radius / s->height);
        cross_level(&f, -s->height / 2, s->radius, 1, -1);
        break;
    case TORUS:
        cross_torus(s, &f);
        break;
    case MESH:
    case FORMS:
        break;
    }
    return f.count;
}
