#include "attack/light.h"

#include "attack/occlude.h"
#include "attack/reflect.h"
#include "attack/sky.h"

/* What is at a place: its point, its normal as it is shaded, whether the surface there is flat. */
typedef struct spot {
    point at, normal, view;
    bool flat;
    real size; /* of the thing that it is a place of, and how far away that is */
    site site; /* what shadows see of it */
} spot;

/* f s, 0 where the light does not come; `unsure`: whether rounding may decide on it. */
static real strength(const lamp *l, const spot *s, point *toward, uint64_t *key, bool *unsure) {
    *toward = l->toward;
    if (l->kind == DIRECTIONAL) return 1;
    const point path = sub(l->position, s->at);
    const real distance = length(path);
    if (!(distance > 0)) return 0;
    *toward = times(path, 1 / distance);
    const real d = larger(distance, l->least), *a = l->attenuation;
    real f = 1 / (a[0] + d * (a[1] + d * a[2]));
    /* A light in the plane of a flat surface. */
    const real off = SIZE(dot(s->normal, path)),
               rounding = EPS * (length(l->position) + length(s->at));
    if (s->flat && off < 64 * rounding) {
        *unsure |= off > 4 * rounding;
        if (off <= 16 * rounding) return 0;
    }
    *unsure |= !s->flat && off < 64 * (rounding + EPS * s->size);
    if (l->kind != SPOT) return f;
    const real cosine = -dot(l->axis, *toward);
    const real t = ANGLE(length(cross(l->axis, *toward)), cosine);
    note(key, (uint64_t)(t <= l->angle) + 2 * (uint64_t)(l->exponent > 0 && cosine > 0));
    if (t > l->angle) return 0;
    const real outer = COSINE(l->angle), inner = COSINE(l->inner);
    if (t > l->inner) {
        const real x = smaller(1, larger(0, (cosine - outer) / (inner - outer)));
        f *= x * x * (3 - 2 * x);
    }
    if (l->exponent > 0) f *= cosine > 0 ? POWER(cosine, l->exponent) : 0;
    return f;
}

static _Thread_local bool cases_only;

void light_cases_only(bool only) {
    cases_only = only;
}

static const arrival ALL = {{1, 1, 1}, {1, 1, 1}};

static void add_shape(const document *d, const lamp *l, const stuff *m, const spot *s,
                      uint64_t *key, shade *out) {
    const point path = sub(l->position, s->at);
    const bool before = l->kind == BALL ? length(path) > l->radius : dot(path, l->axis) < 0;
    real sum[3];
    note(key, before);
    if (!before) return;
    const arrival arrives = d->shadows ? occlude_shape(d, l, &s->site, key) : ALL;
    if (cases_only) return;
    reflect_shape(m, l, s->at, s->normal, s->view, sum);
    for (int c = 0; c < 3; c++) {
        out->low[c] += sum[c] * arrives.low[c];
        out->high[c] += sum[c] * arrives.high[c];
    }
}

/* Which of the cases of reflect_light are jumps of the material. */
static unsigned jumps_of(const stuff *m) {
    unsigned jumps = m->kind == COOK_TORRANCE ? 1 + 4 : 0;
    for (size_t k = 0; k < m->lobe_count; k++)
        if (m->kind != COOK_TORRANCE && m->lobes[k].shininess < 1) jumps |= 2 + 4;
    return jumps;
}

/* What light reflects, and what it may where rounding decides on a jump of the material. Corners of
 * facets need it: no place beside them has another case. */
static shade reflect_any(const stuff *m, const spot *s, point toward, uint64_t *key) {
    const point mirrored = sub(times(s->normal, 2 * dot(s->normal, toward)), toward);
    const unsigned jumps = jumps_of(m);
    unsigned cases, others;
    real sums[3];
    shade out;
    reflect_light(m, s->normal, s->view, toward, &cases, sums);
    note(key, cases & jumps);
    for (int c = 0; c < 3; c++) out.low[c] = out.high[c] = sums[c];
    for (int side = -1; jumps && side <= 1; side += 2) {
        const point view = unit(add(s->view, times(mirrored, side * 64 * EPS)));
        reflect_light(m, s->normal, view, toward, &others, sums);
        for (int c = 0; c < 3 && (cases ^ others) & jumps; c++) {
            out.low[c] = smaller(out.low[c], sums[c]);
            out.high[c] = larger(out.high[c], sums[c]);
        }
    }
    return out;
}

static void add_lamp(const document *d, const lamp *l, const stuff *m, const spot *s, uint64_t *key,
                     shade *out) {
    point toward;
    bool unsure = false;
    if (l->kind == AROUND) {
        if (!cases_only) sky_light(l, m, s->normal, s->view, out->low, out->high);
        return;
    }
    if (l->kind >= RECTANGLE) {
        add_shape(d, l, m, s, key, out);
        return;
    }
    const real f = strength(l, s, &toward, key, &unsure), facing = dot(s->normal, toward);
    note(key, facing > 0);
    unsure |= s->flat && SIZE(facing) < 64 * EPS;
    if (!(facing > 0) && !unsure) return;
    const shade sums = reflect_any(m, s, toward, key);
    const arrival arrives = d->shadows && f != 0 ? occlude_point(d, l, &s->site, toward, key) : ALL;
    for (int c = 0; c < 3; c++) {
        const real by = f * l->color[c], a = sums.low[c] * by * arrives.low[c],
                   b = sums.high[c] * by * arrives.high[c], low = smaller(a, b),
                   high = larger(a, b);
        out->low[c] += unsure ? smaller(0, low) : low;
        out->high[c] += unsure ? larger(0, high) : high;
    }
}

shade light_place(const document *d, const thing *t, const stuff *m, point at, point face,
                  point normal, point ray, bool flat, size_t triangle, uint64_t *key) {
    spot s = {at,
              unit(normal),
              times(ray, -1),
              flat,
              length(t->origin) + t->reach,
              {.at = at, .outward = unit(face), .thing = (size_t)(t - d->things)}};
    const bool away = dot(face, s.view) < 0;
    note(key, away);
    if (away && !m->front_only) s.normal = times(s.normal, -1);
    s.site.normal = s.normal;
    s.site.triangle = triangle;
    s.site.own = times(t->solid.form == MESH ? unit(face_of(t, triangle)) : s.site.outward,
                       away && !m->front_only ? -1 : 1);
    shade out;
    for (int c = 0; c < 3; c++) out.low[c] = out.high[c] = m->constant[c];
    for (size_t j = 0; j < d->lamp_count; j++)
        if (d->lamps[j].kind != AMBIENT) add_lamp(d, &d->lamps[j], m, &s, key, &out);
    return out;
}
