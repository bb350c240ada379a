#include "attack/occlude.h"

static const real ULP = (real)0x1p-52; /* of f64 */

typedef struct way_there {
    point from, ray; /* unit */
    real far;        /* may be infinite */
    real room;       /* how far light's end may be off, beside what the way itself is */
    const site *start;
} way_there;

/* What a way meets: with all that is undecided, and without. */
typedef struct met {
    arrival left;
    unsigned sure, unsure;
} met;

static void cross_one(met *m, const stuff *by, bool sure) {
    for (int c = 0; c < 3; c++) {
        m->left.low[c] *= 1 - by->opacity[c];
        if (sure) m->left.high[c] *= 1 - by->opacity[c];
    }
    m->sure += sure;
    m->unsure += !sure;
}

/* A surface of the unit normal n, met at t, which may be off by `off` over |N.D|. */
static void meet_at(met *m, const way_there *w, const stuff *by, real t, point n, real off) {
    const real steep = SIZE(dot(n, w->ray)), most = 4 * off / steep, least = off / (64 * steep);
    const real before = w->far - t, far = most + w->room;
    if (!(t > least) || !(before > least)) return;
    cross_one(m, by, t > most && before > far);
}

/* ---- Shapes. ---- */

static bool is_flat(form f) {
    return f == PLANE || f == DISC;
}

static void meet_shape(met *m, const way_there *w, const thing *t, bool own, point from, real off) {
    const site *start = w->start;
    crossing found[MOST_CROSSINGS];
    if (own && is_flat(t->solid.form)) return;
    if (own && t->solid.form != TORUS && dot(start->outward, w->ray) > 0) return;
    const real facing = own ? SIZE(dot(start->outward, w->ray)) : 1;
    if (own && facing < (real)1e-5) {
        cross_one(m, &t->stuff, false);
        return;
    }
    const int count = cross_solid(&t->solid, apply(t->from_world, sub(from, t->origin)),
                                  apply(t->from_world, w->ray), found);
    for (int k = 0; k < count; k++) {
        if (own && found[k].t < 64 * off / facing) continue;
        meet_at(m, w, &t->stuff, found[k].t, unit(apply(t->cofactor, found[k].normal)), off);
    }
    /* A level that is met nowhere, or at the end of the world. */
    if (t->solid.form == PLANE) {
        const point up = unit(apply(t->cofactor, (point){0, 1, 0}));
        if (SIZE(dot(up, w->ray)) < 256 * ULP) cross_one(m, &t->stuff, false);
    }
}

/* ---- Triangles. ---- */

/* Weights of a triangle's corners at the foot of a point on its plane. */
static void weigh_point(const point *p, point n, point at, real out[3]) {
    const real area = dot(n, n);
    for (int k = 0; k < 3; k++) {
        const point a = p[(k + 1) % 3], b = p[(k + 2) % 3];
        out[k] = dot(n, cross(sub(b, a), sub(at, a))) / area;
    }
}

/* A triangle that has the start on its edge or corner. Near enough, what it has there is a part of
 * its plane between one line or two, of which all sizes are alike: a way that starts beside the
 * place, on the start's own triangle, tells by this alone whether it is met. */
typedef enum verdict { IS_PASSED, IS_MET, IS_OPEN } verdict;

static verdict meet_next(const way_there *w, const point *p, point n, const real weights[3],
                         point inward) {
    static const real CLOSE = (real)1e-7;
    const point plane = unit(n);
    const real up = dot(plane, inward), along = dot(plane, w->ray);
    if (SIZE(up) < CLOSE * length(inward)) return IS_PASSED; /* it goes on in the same plane */
    if (SIZE(along) < CLOSE) return IS_OPEN;
    const real t = -up / along;
    if (t < 0) return IS_PASSED;
    const point q = add(inward, times(w->ray, t));
    verdict out = IS_MET;
    for (int k = 0; k < 3; k++) {
        const point a = p[(k + 1) % 3], b = p[(k + 2) % 3], rise = unit(cross(n, sub(b, a)));
        if (weights[k] > CLOSE) continue;
        const real inside = dot(rise, q);
        const real room = CLOSE * (length(q) + length(inward));
        if (inside < -room) return IS_PASSED;
        if (inside < room) out = IS_OPEN;
    }
    return out;
}

static void meet_triangle(met *m, const way_there *w, const thing *t, const point *p, point from,
                          real off) {
    const point ab = sub(p[1], p[0]), ac = sub(p[2], p[0]), h = cross(w->ray, ac),
                o = sub(from, p[0]), q = cross(o, ab);
    const real volume = dot(ab, h);
    if (volume == 0) return;
    const real u = dot(o, h) / volume, v = dot(w->ray, q) / volume, at = dot(ac, q) / volume,
               slack = -(real)1e-16;
    if (!(u >= slack && v >= slack && u + v <= 1 - slack)) return;
    meet_at(m, w, &t->stuff, at, unit(cross(ab, ac)), off);
}

static void meet_triangles(met *m, const way_there *w, const thing *t, bool own, point from,
                           real off) {
    const site *start = w->start;
    point middle = {0, 0, 0};
    unsigned beside = 0, open = 0;
    if (own) {
        const point *p = t->placed + 3 * start->triangle;
        middle = sub(times(add(p[0], add(p[1], p[2])), (real)1 / 3), start->at);
    }
    for (size_t i = 0; i < t->triangles; i++) {
        const point *p = t->placed + 3 * i, n = cross(sub(p[1], p[0]), sub(p[2], p[0]));
        if (own && i == start->triangle) continue;
        if (!(length(n) > 0)) continue;
        if (own && SIZE(dot(unit(n), sub(start->at, p[0]))) < 64 * off) {
            real weights[3];
            weigh_point(p, n, start->at, weights);
            if (smaller(weights[0], smaller(weights[1], weights[2])) > -(real)1e-9) {
                const verdict v = meet_next(w, p, n, weights, middle);
                beside += v == IS_MET;
                open += v == IS_OPEN;
                continue;
            }
        }
        meet_triangle(m, w, t, p, from, off);
    }
    /* Into and out again, at one place: nothing says on which side of it light passes. */
    if (beside || open) cross_one(m, &t->stuff, beside == 1 && !open);
}

/* ---- Ways. ---- */

/* Moves the way aside, and back again: 0 is where it is. */
static point move_aside(const way_there *w, int k, real by) {
    const point any = SIZE(w->ray.x) < (real)0.5 ? (point){1, 0, 0} : (point){0, 1, 0},
                a = unit(cross(w->ray, any)), b = cross(w->ray, a);
    return k == 0 ? w->from : add(w->from, times(k < 3 ? a : b, k & 1 ? by : -by));
}

static void meet_thing(const document *d, const way_there *w, size_t index, met *out) {
    const thing *t = &d->things[index];
    const point path = sub(t->origin, w->from);
    const real reach = t->reach, apart = length(path),
               size = length(w->from) + length(t->origin) + reach + apart, off = 64 * ULP * size;
    const bool own = w->start->thing == index;
    if (t->solid.form != PLANE) {
        const real along = dot(path, w->ray);
        if (length(sub(path, times(w->ray, along))) > reach + 64 * off) return;
        if (along < -reach - 64 * off || along - reach - 64 * off > w->far) return;
    }
    met all = {.sure = 0};
    for (int k = 0; k < 5; k++) {
        met m = {{{1, 1, 1}, {1, 1, 1}}, 0, 0};
        const point from = move_aside(w, k, off);
        if (t->solid.form == MESH)
            meet_triangles(&m, w, t, own, from, off);
        else
            meet_shape(&m, w, t, own, from, off);
        for (int c = 0; c < 3; c++) {
            all.left.low[c] = k ? smaller(all.left.low[c], m.left.low[c]) : m.left.low[c];
            all.left.high[c] = k ? larger(all.left.high[c], m.left.high[c]) : m.left.high[c];
        }
        if (k == 0) all.sure = m.sure, all.unsure = m.unsure;
    }
    for (int c = 0; c < 3; c++) {
        out->left.low[c] *= all.left.low[c];
        out->left.high[c] *= all.left.high[c];
    }
    out->sure += all.sure;
    out->unsure += all.unsure;
}

static void note_count(uint64_t *key, uint64_t value) {
    *key = (*key ^ (value + 11)) * 0x9e3779b97f4a7c15u;
    *key ^= *key >> 29;
}

static arrival occlude_way(const document *d, const way_there *w, uint64_t *key) {
    const site *s = w->start;
    met m = {{{1, 1, 1}, {1, 1, 1}}, 0, 0};
    /* The surface itself is between its front and a light behind it. */
    const real facing = dot(s->own, w->ray),
               turn = w->far < (real)INFINITY ? (length(w->from) + w->far) / w->far : 1;
    const bool sure = SIZE(facing) > 256 * ULP * turn;
    if (!(facing > 0) || !sure) cross_one(&m, &d->things[s->thing].stuff, sure);
    for (size_t i = 0; i < d->thing_count; i++) meet_thing(d, w, i, &m);
    note_count(key, 64 * (uint64_t)m.sure + m.unsure);
    return m.left;
}

arrival occlude_point(const document *d, const lamp *l, const site *s, point toward,
                      uint64_t *key) {
    way_there w = {s->at, toward, (real)INFINITY, 0, s};
    if (l->kind != DIRECTIONAL) w.far = length(sub(l->position, s->at));
    return occlude_way(d, &w, key);
}

/* ---- Lights with a shape: Hammersley's points. ---- */

static real mirrored_bits(unsigned i) {
    real value = 0, bit = (real)1 / 2;
    for (; i; i /= 2, bit /= 2) value += i % 2 * bit;
    return value;
}

/* Returns its weight but for N.L; 0: it sends nothing there. */
static real aim_at_sheet(const lamp *l, real u, real v, point from, way_there *w) {
    point at;
    if (l->kind == RECTANGLE) {
        at = add(times(l->across, 2 * u - 1), times(l->up, 2 * v - 1));
    } else {
        const real r = ROOT(u), turn = degrees(360 * v);
        at = add(times(l->across, r * COSINE(turn)), times(l->up, r * SINE(turn)));
    }
    const point path = sub(add(l->position, at), from);
    w->far = length(path);
    if (!(w->far > 0)) return 0;
    w->ray = times(path, 1 / w->far);
    return larger(0, -dot(w->ray, l->axis)) / (w->far * w->far);
}

static real aim_at_ball(const lamp *l, real u, real v, point from, way_there *w, uint64_t *key) {
    const point path = sub(l->position, from);
    const real apart = length(path), r = l->radius;
    if (!(apart > r)) return 0;
    const point axis = times(path, 1 / apart),
                aside = SIZE(axis.x) < (real)0.5 ? (point){1, 0, 0} : (point){0, 1, 0},
                a = unit(cross(aside, axis)), b = cross(axis, a);
    const real sine = r / apart, least = ROOT((1 - sine) * (1 + sine)),
               fall = u * sine * sine / (1 + least), turn = degrees(360 * v),
               wide = ROOT(fall * (2 - fall));
    note_count(key, SIZE(axis.x) < (real)0.5);
    w->ray = unit(add(times(axis, 1 - fall),
                      add(times(a, wide * COSINE(turn)), times(b, wide * SINE(turn)))));
    const real along = dot(path, w->ray), off = length(sub(path, times(w->ray, along)));
    w->far = along - (off < r ? ROOT((r - off) * (r + off)) : 0);
    /* Where it grazes the ball, its end is any near. */
    w->room = 4 * ROOT(ULP * r * (apart + length(from)));
    return 1;
}

arrival occlude_shape(const document *d, const lamp *l, const site *s, uint64_t *key) {
    arrival sum = {{0, 0, 0}, {0, 0, 0}};
    real all = 0, most = 0;
    for (int i = 0; i < d->shadow_samples; i++) {
        const real n = d->shadow_samples, u = (i + (real)0.5) / n,
                   v = mirrored_bits((unsigned)i) + 1 / (2 * n);
        way_there w = {.from = s->at, .start = s};
        real weight = l->kind == BALL ? aim_at_ball(l, u, v, s->at, &w, key)
                                      : aim_at_sheet(l, u, v, s->at, &w);
        if (!(weight > 0)) continue;
        const real unit_weight =
            l->kind == BALL ? 1 : weight * w.far * w.far; /* but for the distance */
        const real facing = larger(0, dot(s->normal, w.ray));
        most = larger(most, facing * unit_weight);
        weight *= facing;
        if (!(weight > 0)) continue;
        const arrival one = occlude_way(d, &w, key);
        all += weight;
        for (int c = 0; c < 3; c++) {
            sum.low[c] += weight * one.low[c];
            sum.high[c] += weight * one.high[c];
        }
    }
    /* No bound is told of what is nearer to its horizon. */
    const bool known = most > (real)1e-4;
    for (int c = 0; c < 3; c++) {
        sum.low[c] = known ? sum.low[c] / all : 0;
        sum.high[c] = known ? sum.high[c] / all : 1;
    }
    return sum;
}
