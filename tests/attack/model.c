#include "attack/model.h"

#include <stdlib.h>

#include "attack/light.h"
#include "attack/prints.h"
#include "attack/sky.h"

#ifdef ATTACK_QUAD
#define MODEL_PROGRAM model_quad
#else
#define MODEL_PROGRAM model_long
#endif

struct model {
    document d;
    const double (*offsets)[2];
    real aside;     /* in pixels: how far beside a sample its case must be the same */
    bool shaped;    /* a light has a shape */
    shade **facets; /* [thing]: of each triangle's corners; or NULL */
};

/* The eye's ray to a place. */
static point ray_to(const model *whole, point at) {
    const document *d = &whole->d;
    return d->orthographic ? times(d->back, -1) : unit(sub(at, d->eye));
}

/* ---- What rays meet. ---- */

typedef struct meeting {
    crossing c;
    size_t thing;
    real u, v; /* of a mesh: weights of its triangle's second and third corner */
} meeting;

enum { MOST_MEETINGS = 64 };

typedef struct meetings {
    meeting list[MOST_MEETINGS];
    int count;
} meetings;

static void put_meeting(meetings *m, const crossing *c, size_t index, real u, real v) {
    if (m->count < MOST_MEETINGS) m->list[m->count++] = (meeting){*c, index, u, v};
}

static void meet_mesh(const thing *t, size_t index, point o, point d, meetings *out) {
    const real slack = 16 * EPS; /* on an edge, a ray meets both */
    for (size_t i = 0; i < t->triangles; i++) {
        const point *p = t->placed + 3 * i, ab = sub(p[1], p[0]), ac = sub(p[2], p[0]);
        const point h = cross(d, ac), from = sub(o, p[0]), q = cross(from, ab);
        const real volume = dot(ab, h);
        if (volume == 0) continue;
        const real u = dot(from, h) / volume, v = dot(d, q) / volume, at = dot(ac, q) / volume;
        if (!(u >= -slack && v >= -slack && u + v <= 1 + slack && at > 0)) continue;
        const crossing c = {at, (int)i, !t->normals, add(o, times(d, at)), face_of(t, i)};
        put_meeting(out, &c, index, u, v);
    }
}

static void meet(const document *d, point o, point ray, meetings *out) {
    out->count = 0;
    for (size_t i = 0; i < d->thing_count; i++) {
        const thing *t = &d->things[i];
        if (t->solid.form == MESH) {
            meet_mesh(t, i, o, ray, out);
            continue;
        }
        crossing found[MOST_CROSSINGS];
        const int count = cross_solid(&t->solid, apply(t->from_world, sub(o, t->origin)),
                                      apply(t->from_world, ray), found);
        for (int k = 0; k < count; k++) {
            found[k].normal = apply(t->cofactor, found[k].normal);
            found[k].at = place(t, found[k].at);
            put_meeting(out, &found[k], i, 0, 0);
        }
    }
}

static void blend(const shade *from, const real weight[3], shade *out) {
    for (int c = 0; c < 3; c++) {
        out->low[c] = out->high[c] = 0;
        for (int k = 0; k < 3; k++) {
            out->low[c] += weight[k] * from[k].low[c];
            out->high[c] += weight[k] * from[k].high[c];
        }
    }
}

/* The normal that light is reckoned with. */
static point normal_of(const thing *t, const meeting *m) {
    const real weight[3] = {1 - m->u - m->v, m->u, m->v};
    if (!t->normals) return m->c.normal;
    point normal = {0, 0, 0};
    for (size_t k = 0; k < 3; k++)
        normal = add(normal, times(t->normals[3 * (size_t)m->c.part + k], weight[k]));
    return apply(t->cofactor, normal);
}

/* The pixel that the thread looks through, whose straight rays see means of patterns. */
static _Thread_local gaze through;

static shade light_meeting(const model *whole, const meeting *m, const stuff *s, point ray,
                           uint64_t *key) {
    const thing *t = &whole->d.things[m->thing];
    return light_place(&whole->d, t, s, m->c.at, m->c.normal, normal_of(t, m), ray, m->c.flat,
                       (size_t)m->c.part, key);
}

/* Light is a sum of coefficients times what is not negative, where no light is. */
static shade light_printed(const model *whole, const meeting *m, point ray, uint64_t *key) {
    const thing *t = &whole->d.things[m->thing];
    const point outward = unit(m->c.normal);
    /* Normals are carried by the cofactor matrix, which back is the map to the world, turned over.
     */
    const real(*w)[3] = t->to_world;
    const point own = {w[0][0] * outward.x + w[1][0] * outward.y + w[2][0] * outward.z,
                       w[0][1] * outward.x + w[1][1] * outward.y + w[2][1] * outward.z,
                       w[0][2] * outward.x + w[1][2] * outward.y + w[2][2] * outward.z};
    const printed_place place = {m->c.at, own, (size_t)m->c.part};
    stuff low, high;
    if (!printed_stuff(t, &through, &place, &low, &high))
        return light_meeting(whole, m, &t->stuff, ray, key);
    shade out = light_meeting(whole, m, &low, ray, key);
    const shade most = light_meeting(whole, m, &high, ray, key);
    for (int c = 0; c < 3; c++) out.high[c] = most.high[c];
    return out;
}

static shade shade_of(const model *whole, const meeting *m, point ray, uint64_t *key) {
    const real weight[3] = {1 - m->u - m->v, m->u, m->v};
    note(key, m->thing + 1);
    note(key, (uint64_t)m->c.part + 1);
    shade out;
    if (whole->facets[m->thing]) {
        blend(whole->facets[m->thing] + 3 * (size_t)m->c.part, weight, &out);
        return out;
    }
    return light_printed(whole, m, ray, key);
}

/* ---- Rays that go on. ---- */

static point mirror(point ray, point n) {
    return sub(ray, times(n, 2 * dot(ray, n)));
}

/* False: all of it is mirrored. */
static bool refract(point ray, point n, real eta, point *out) {
    const real in = -dot(ray, n), square = 1 - eta * eta * (1 - in * in);
    if (square < 0) return false;
    *out = add(times(ray, eta), times(n, eta * in - ROOT(square)));
    return true;
}

static shade follow(const model *whole, point from, point ray, int steps, const real by[3],
                    uint64_t *key);

/* Adds what a further ray brings, which is `by` of the picture and `part` of `out`. */
static void add_ray(const model *whole, point from, point ray, int steps, const real by[3],
                    const real part[3], uint64_t *key, shade *out) {
    real brings[3], most = 0;
    for (int c = 0; c < 3; c++) most = larger(most, brings[c] = by[c] * part[c]);
    if (!(most > 0) || steps >= whole->d.depth || most < (1 - (real)1e-14) * whole->d.least) return;
    const shade more = follow(whole, from, ray, steps + 1, brings, key);
    for (int c = 0; c < 3; c++) {
        out->low[c] += part[c] * more.low[c];
        out->high[c] += part[c] * more.high[c];
    }
}

static shade shade_on(const model *whole, const meeting *m, point ray, int steps, const real by[3],
                      uint64_t *key) {
    const thing *t = &whole->d.things[m->thing];
    const stuff *s = &t->stuff;
    shade out = shade_of(whole, m, ray, key);
    if (!whole->d.depth) return out;
    const bool inside = dot(ray, m->c.normal) > 0;
    const point own = times(unit(m->c.normal), inside ? -1 : 1), n = unit(normal_of(t, m)),
                normal = dot(ray, n) > 0 ? times(n, -1) : n;
    point mirrored = mirror(ray, normal), refracted = ray;
    if (!(dot(mirrored, own) > 0)) mirrored = mirror(ray, own);
    const real eta = inside ? s->ior : 1 / s->ior;
    bool bends = refract(ray, normal, eta, &refracted);
    if (bends && !(dot(refracted, own) < 0)) bends = refract(ray, own, eta, &refracted);
    real parts[3][3];
    note(key,
         bends && larger(s->transmission[0], larger(s->transmission[1], s->transmission[2])) > 0);
    for (int c = 0; c < 3; c++) {
        const real o = s->opacity[c];
        out.low[c] *= o;
        out.high[c] *= o;
        parts[0][c] = o * (s->reflection[c] + (bends ? 0 : s->transmission[c]));
        parts[1][c] = bends ? o * s->transmission[c] : 0;
        parts[2][c] = 1 - o;
    }
    add_ray(whole, m->c.at, unit(mirrored), steps, by, parts[0], key, &out);
    add_ray(whole, m->c.at, unit(refracted), steps, by, parts[1], key, &out);
    add_ray(whole, m->c.at, ray, steps, by, parts[2], key, &out);
    return out;
}

static shade follow(const model *whole, point from, point ray, int steps, const real by[3],
                    uint64_t *key) {
    const document *d = &whole->d;
    meetings list;
    meet(d, from, ray, &list);
    const meeting *nearest = NULL;
    /* A ray begins on a surface, which it does not meet there. */
    for (int i = 0; i < list.count; i++)
        if (list.list[i].c.t > (real)1e-14 * (length(from) + length(d->eye)) &&
            (!nearest || list.list[i].c.t < nearest->c.t))
            nearest = &list.list[i];
    if (nearest) return shade_on(whole, nearest, ray, steps, by, key);
    shade out;
    note(key, 77);
    for (int c = 0; c < 3; c++) out.low[c] = out.high[c] = d->transparent ? 0 : d->background[c];
    return out;
}

/* ---- Samples. ---- */

#define NONE SIZE_MAX

typedef struct candidate {
    real low[4], high[4];
    uint64_t key;
    size_t thing; /* that is seen; NONE: nothing is */
    bool edge;    /* beside it another one is */
} candidate;

static void widen(candidate *to, const candidate *by) {
    for (int c = 0; c < 4; c++) {
        to->low[c] = smaller(to->low[c], by->low[c]);
        to->high[c] = larger(to->high[c], by->high[c]);
    }
}

static candidate candidate_of(const model *whole, const meeting *m, point ray) {
    const document *d = &whole->d;
    candidate out = {.key = 1, .thing = m ? m->thing : NONE};
    if (m) {
        const real all[3] = {1, 1, 1};
        const shade s = shade_on(whole, m, ray, 0, all, &out.key);
        for (int c = 0; c < 3; c++) out.low[c] = s.low[c], out.high[c] = s.high[c];
        out.low[3] = out.high[3] = 1;
        return out;
    }
    for (int c = 0; c < 3; c++) out.low[c] = out.high[c] = d->transparent ? 0 : d->background[c];
    out.low[3] = out.high[3] = d->transparent ? 0 : 1;
    return out;
}

/* The ray through a point of the picture, in pixels. */
static point aim(const document *d, real x, real y, point *from) {
    const real u = (2 * x / d->width - 1) * d->half * d->width / d->height,
               v = (1 - 2 * y / d->height) * d->half;
    const point across = add(times(d->right, u), times(d->up, v)), along = times(d->back, -1);
    *from = d->orthographic ? add(d->eye, across) : d->eye;
    return d->orthographic ? along : unit(add(across, along));
}

static const meeting *nearest_of(const meetings *list) {
    const meeting *nearest = NULL;
    for (int i = 0; i < list->count; i++)
        if (!nearest || list->list[i].c.t < nearest->c.t) nearest = &list->list[i];
    return nearest;
}

/* What is seen through a point of the picture; true: a second surface is as near. */
static bool look(const model *whole, real x, real y, candidate *out) {
    const document *d = &whole->d;
    point o;
    const point ray = aim(d, x, y, &o);
    meetings list;
    meet(d, o, ray, &list);
    const meeting *nearest = nearest_of(&list);
    *out = candidate_of(whole, nearest, ray);
    bool tied = false;
    for (int i = 0; i < list.count; i++) {
        const meeting *m = &list.list[i];
        const real reach = d->things[m->thing].reach + d->things[nearest->thing].reach;
        if (m == nearest) continue;
        if (!(m->c.t - nearest->c.t <= 64 * EPS * (m->c.t + length(o) + reach))) continue;
        const candidate other = candidate_of(whole, m, ray);
        if (other.key == out->key) continue;
        widen(out, &other);
        tied = true;
    }
    return tied;
}

/* Looks beside a sample. True: another case is there, or a tie. */
static bool look_beside(const model *whole, real x, real y, const candidate *at, candidate *range) {
    bool differs = false;
    *range = *at;
    for (int k = 0; k < 4; k++) {
        candidate beside;
        differs |= look(whole, x + (k & 1 ? whole->aside : -whole->aside),
                        y + (k & 2 ? whole->aside : -whole->aside), &beside);
        differs |= beside.key != at->key;
        range->edge |= beside.thing != at->thing;
        widen(range, &beside);
    }
    return differs;
}

/* Adds what is seen there if the nearest thing is missed, as rays along its edge may do. Its
 * shadows may be as undecided: beside the sample they are not. */
static void look_behind(const model *whole, real x, real y, candidate *range) {
    const document *d = &whole->d;
    point o;
    const point ray = aim(d, x, y, &o);
    meetings list;
    meet(d, o, ray, &list);
    const meeting *nearest = nearest_of(&list), *next = NULL;
    for (int i = 0; nearest && i < list.count; i++)
        if (list.list[i].thing != nearest->thing && (!next || list.list[i].c.t < next->c.t))
            next = &list.list[i];
    if (!next) return;
    const candidate other = candidate_of(whole, next, ray);
    widen(range, &other);
}

static gaze gaze_at(const document *d, int px, int py) {
    const real u = (2 * (px + (real)0.5) / d->width - 1) * d->half * d->width / d->height,
               v = (1 - 2 * (py + (real)0.5) / d->height) * d->half, step = 2 * d->half / d->height;
    const point across = add(times(d->right, u), times(d->up, v)), ahead = times(d->back, -1);
    return (gaze){d->orthographic ? add(d->eye, across) : d->eye,
                  d->orthographic ? ahead : add(across, ahead), times(d->right, step),
                  times(d->up, -step), d->orthographic};
}

static void evaluate(const model *whole, int px, int py, model_pixel *out) {
    through = gaze_at(&whole->d, px, py);
    real low[4] = {0, 0, 0, 0}, high[4] = {0, 0, 0, 0};
    const int samples = whole->d.samples;
    out->undecided = 0;
    for (int i = 0; i < samples; i++) {
        const real x = px + (real)whole->offsets[i][0], y = py + (real)whole->offsets[i][1];
        candidate at;
        candidate range;
        bool unsure = look(whole, x, y, &at);
        light_cases_only(whole->shaped);
        unsure |= look_beside(whole, x, y, &at, &range);
        light_cases_only(false);
        if (unsure && whole->shaped) look_beside(whole, x, y, &at, &range);
        if (range.edge && whole->d.shadows) look_behind(whole, x, y, &range);
        for (int c = 0; c < 4; c++) unsure |= at.low[c] != at.high[c];
        for (int c = 0; c < 4; c++) {
            low[c] += unsure ? range.low[c] : at.low[c];
            high[c] += unsure ? range.high[c] : at.high[c];
        }
        out->undecided += unsure;
    }
    out->low[3] = (double)(low[3] / samples);
    out->high[3] = (double)(high[3] / samples);
    for (int c = 0; c < 3; c++) {
        /* Straight colors: of the samples that hit. Where their number is undecided, so are these.
         */
        const real count = whole->d.transparent && high[3] > 0 ? high[3] : samples;
        const bool known = !whole->d.transparent || low[3] == high[3];
        out->low[c] = known ? (double)(low[c] / count) : -INFINITY;
        out->high[c] = known ? (double)(high[c] / count) : INFINITY;
    }
}

/* ---- A model. ---- */

/* See model.h. */
static real find_aside(const document *d) {
    real most = (real)1e-9;
    const real pixel = 2 * d->half / d->height;
    for (size_t i = 0; i < d->thing_count; i++) {
        const thing *t = &d->things[i];
        real away = length(sub(d->eye, t->origin)) - t->reach;
        if (t->solid.form == PLANE) {
            const point up = unit(apply(t->cofactor, (point){0, 1, 0}));
            away = SIZE(dot(up, sub(d->eye, t->origin)));
        }
        away = larger(away, t->reach / 1000);
        const real size = length(d->eye) + length(t->origin) + t->reach + away,
                   footprint = d->orthographic ? pixel : pixel * away;
        if (footprint > 0) most = larger(most, 256 * EPS * size / footprint);
    }
    return smaller(most, 1);
}

/* Whether the viewer sees the side of a triangle that is inward. */
static bool is_away(const model *whole, const thing *t, size_t triangle) {
    return dot(face_of(t, triangle), ray_to(whole, t->placed[3 * triangle])) > 0;
}

/* The first triangle that has a corner, seen from the same side: that of its light. */
static size_t first_with(const model *whole, const thing *t, size_t corner) {
    const bool away = is_away(whole, t, corner / 3);
    for (size_t c = 0; t->normals && c < corner; c++)
        if (t->vertices[c] == t->vertices[corner] &&
            (t->stuff.front_only || is_away(whole, t, c / 3) == away))
            return c / 3;
    return corner / 3;
}

static void light_polygon(const model *whole, const thing *t, size_t first, size_t count,
                          shade *out) {
    point middle = {0, 0, 0}, face = {0, 0, 0};
    real area = 0;
    uint64_t key = 0;
    for (size_t i = first; i < first + count; i++) {
        const point *p = t->placed + 3 * i, n = face_of(t, i);
        middle = add(middle, times(add(p[0], add(p[1], p[2])), length(n) / 3));
        area += length(n);
        face = add(face, n);
    }
    middle = times(middle, 1 / area);
    out[0] = light_place(&whole->d, t, &t->stuff, middle, face, face, ray_to(whole, middle), true,
                         first, &key);
    for (size_t c = 1; c < 3 * count; c++) out[c] = out[0];
}

static shade *light_corners(const model *whole, const thing *t) {
    shade *out = calloc(3 * t->triangles + 1, sizeof *out);
    uint64_t key = 0;
    for (size_t i = 0; out && t->way == FLAT && i < t->triangles;) {
        size_t count = 1;
        while (i + count < t->triangles && t->polygons[i + count] == t->polygons[i]) count++;
        light_polygon(whole, t, i, count, out + 3 * i);
        i += count;
    }
    for (size_t c = 0; out && t->way == GOURAUD && c < 3 * t->triangles; c++) {
        const point p = t->placed[c], face = face_of(t, c / 3),
                    normal = t->normals ? apply(t->cofactor, t->normals[c]) : face;
        out[c] = light_place(&whole->d, t, &t->stuff, p, face, normal, ray_to(whole, p),
                             !t->normals, whole->d.shadows ? first_with(whole, t, c) : c / 3, &key);
    }
    return out;
}

static void drop(model *whole) {
    if (!whole) return;
    for (size_t i = 0; whole->facets && i < whole->d.thing_count; i++) free(whole->facets[i]);
    free(whole->facets);
    document_drop(&whole->d);
    free(whole);
}

static struct model *read_document(const char *json, const double (*offsets)[2]) {
    struct model *whole = calloc(1, sizeof *whole);
    bool good = whole && document_read(json, &whole->d);
    if (good) {
        whole->offsets = offsets;
        whole->aside = find_aside(&whole->d);
        for (size_t j = 0; j < whole->d.lamp_count; j++)
            whole->shaped |= whole->d.lamps[j].kind >= RECTANGLE;
        whole->facets = calloc(whole->d.thing_count + 1, sizeof *whole->facets);
        good = whole->facets;
    }
    for (size_t i = 0; good && i < whole->d.thing_count; i++) {
        const thing *t = &whole->d.things[i];
        if (t->way == PHONG) continue;
        whole->facets[i] = light_corners(whole, t);
        good = whole->facets[i];
    }
    if (good) return whole;
    drop(whole);
    return NULL;
}

static void tell(model *whole, table_function *weigh, const void *table) {
    for (size_t i = 0; i < whole->d.thing_count; i++) {
        whole->d.things[i].stuff.weigh = weigh;
        whole->d.things[i].stuff.table = table;
    }
}

static bool surround(model *whole, size_t index, int width, int height, const float *texels) {
    const sky_map map = {width, height, texels};
    /* Texels are a part of a degree wide, or few. */
    const int parts = width > 128 ? 1 : 2;
    lamp *l = &whole->d.lamps[index];
    l->coarse = sky_cut(&map, parts, l->turn, &l->coarse_count);
    l->fine = sky_cut(&map, 2 * parts, l->turn, &l->fine_count);
    return l->coarse && l->fine;
}

const model_program MODEL_PROGRAM = {read_document, evaluate, tell, surround, drop};
