/* The torus, a vector of rays at a time. (|p|^2 + 1 - r^2)^2 = 4 (x^2 + z^2) along a ray is a
 * quartic, which from the line's nearest point to the center has no cubic term: f = t^4 + p t^2 +
 * q t + s. It is convex before and after its inflections, at minus and plus sqrt(-p / 6), and
 * concave between them.
 *
 * A few steps in f32 go from where the ray may enter to a root, and two in f64 make it exact. That
 * it is the first one needs no search: f is positive where the ray enters, so a root at which f
 * falls is the first if it is before the first inflection, if the ray enters after that, or if f
 * falls at the first inflection and so everywhere between. Whatever is not settled so, some of
 * 10,000 rays that meet the torus and those that pass it closely, is searched part by part.
 *
 * From outside, f's first root is before its first minimum, if it is negative there, or else before
 * its last one; from inside, between some of its turning points. Those are found as roots of the
 * derivative between the inflections: no root is lost to cancellation as closed formulas lose them.
 * Turning points need few digits; the surface itself is found on the distance from the tube's
 * circle, which is well conditioned for thin tubes and has the quartic's sign.
 *
 * Each lane stops by itself, so that its result does not depend on how long others take. Compiled
 * once an instruction set. */
#include "base/simd.h"
#include "sight/batch.h"

enum { LANES = SHD_W / 2, STEPS = 4 };

/* Rays with unit directions, which begin where the line is nearest to the center. */
typedef struct rays {
    shd_vd ox, oy, oz, dx, dy, dz;
    shd_vd inverse; /* 1 / the direction's length as it came */
    shd_vd along;   /* from the origin as it came */
    shd_vd near;    /* only t > near counts */
    shd_vd m;       /* the square of that point's distance from the center */
    shd_vd p, q, s;
} rays;

static inline shd_vd magnitude_of(shd_vd x) {
    return shd_vd_max(x, -x);
}

/* As shd_inverse_root. */
static inline shd_vd inverse_root(shd_vd x) {
    shd_vd y = (shd_vd)(0x5fe6eb50c7b537a9u - ((shd_vul)x >> 1)), half = 0.5 * x;
    for (int step = 0; step < 3; step++) y = y * (1.5 - half * y * y);
    return y + y * (0.5 - half * y * y);
}

static inline rays read_rays(double tube, const shd_work *w, int at) {
    rays r;
    r.ox = shd_vd_load(w->ox + at), r.oy = shd_vd_load(w->oy + at), r.oz = shd_vd_load(w->oz + at);
    r.dx = shd_vd_load(w->dx + at), r.dy = shd_vd_load(w->dy + at), r.dz = shd_vd_load(w->dz + at);
    const shd_vd square = r.dx * r.dx + r.dy * r.dy + r.dz * r.dz;
    r.inverse = inverse_root(square);
    r.dx *= r.inverse, r.dy *= r.inverse, r.dz *= r.inverse;
    r.along = -(r.ox * r.dx + r.oy * r.dy + r.oz * r.dz);
    r.ox += r.dx * r.along, r.oy += r.dy * r.along, r.oz += r.dz * r.along;
    r.near = shd_vd_load(w->near + at) * (square * r.inverse) - r.along;
    r.m = r.ox * r.ox + r.oy * r.oy + r.oz * r.oz;
    const shd_vd k = r.m + (1 - tube * tube);
    r.p = 2 * k - 4 + 4 * r.dy * r.dy;
    r.q = 8 * r.oy * r.dy;
    r.s = k * k - 4 * (r.m - r.oy * r.oy);
    return r;
}

/* (distance from the tube's circle)^2 - r^2, and its slope. */
static inline shd_vd distance_at(const rays *r, double tube, shd_vd t, shd_vd *slope) {
    const shd_vd x = r->ox + r->dx * t, y = r->oy + r->dy * t, z = r->oz + r->dz * t;
    const shd_vd square = x * x + z * z, inverse = inverse_root(square), off = square * inverse - 1;
    *slope = 2 * (off * inverse * (x * r->dx + z * r->dz) + y * r->dy);
    return (off - tube) * (off + tube) + y * y;
}

/* ---- All at once. ---- */

static inline shd_vf join_vectors(shd_vd a, shd_vd b) {
    return shd_vf_join(shd_vh_narrow(a), shd_vh_narrow(b));
}

static inline shd_vf clear_of_zero(shd_vf x) {
    const float least = 1e-20f;
    return shd_vf_select(shd_vf_gt(shd_vf_max(x, -x), shd_vf_set(least)), x, shd_vf_set(least));
}

/* Two vectors of rays in f32. */
typedef struct guess {
    shd_vf p, q, s, t;
    shd_mf bounded; /* within the sphere around the torus and the planes above and below it */
    shd_mf early;   /* they enter these before the first inflection */
} guess;

/* Where a root is looked for first: where the ray enters, or the second inflection if that is
 * nearer to it. */
static inline guess start_guess(double tube, const rays *a, const rays *b) {
    const float around = (float)(1 + tube) * (1 + 2e-6f), above = (float)tube + 2e-6f * around,
                eps = 1e-5f * around;
    const shd_vf p = join_vectors(a->p, b->p), none = shd_vf_set(0),
                 per_y = 1 / clear_of_zero(join_vectors(a->dy, b->dy)),
                 reach = shd_vf_sqrt(shd_vf_max(around * around - join_vectors(a->m, b->m), none)),
                 half = above * shd_vf_max(per_y, -per_y),
                 middle = join_vectors(a->oy, b->oy) * per_y,
                 low = shd_vf_max(-middle - half, -reach),
                 end = shd_vf_max(middle - half, -reach), /* negated */
        bend = shd_vf_sqrt(shd_vf_max(p * (-1.f / 6), none));
    const shd_mf early = shd_vf_gt(eps - bend, low);
    const shd_vf t = shd_vf_select(early, low, shd_vf_max(low, bend));
    return (guess){p, join_vectors(a->q, b->q), join_vectors(a->s, b->s),
                   t, shd_vf_gt(-end, low),     early};
}

/* Solves for f's parabola, and then by Halley's steps. */
static inline void advance_guess(guess *g, int step) {
    const shd_vf t = g->t, square = t * t, value = ((square + g->p) * t + g->q) * t + g->s,
                 slope = (4 * square + 2 * g->p) * t + g->q, curve = 6 * square + g->p;
    if (step) {
        g->t -= value * slope / (slope * slope - value * curve);
    } else {
        const shd_vf rest = slope * slope - 4 * value * curve;
        g->t += 2 * value / (shd_vf_sqrt(shd_vf_max(rest, shd_vf_set(0))) - slope);
    }
}

/* Where f falls at a root, whether it is the first one. */
static inline shd_mf is_first(double tube, const guess *g) {
    const float around = 1 + (float)tube, eps = 1e-5f * around;
    const shd_vf bend = shd_vf_sqrt(shd_vf_max(g->p * (-1.f / 6), shd_vf_set(0))),
                 fall = (4.f / 3) * g->p * bend - eps * around * around;
    return shd_mf_or(shd_mf_not(g->early),
                     shd_mf_or(shd_vf_gt(-bend - eps, g->t), shd_vf_gt(fall, g->q)));
}

static inline shd_vd value_at(const rays *r, shd_vd t) {
    return ((t * t + r->p) * t + r->q) * t + r->s;
}

/* (distance from the tube's circle)^2 - r^2, times 4 (x^2 + z^2)^(1/2), by which f's slope is
 * steeper at the surface. */
static inline shd_vd excess_at(const rays *r, double tube, shd_vd t) {
    const shd_vd x = r->ox + r->dx * t, y = r->oy + r->dy * t, z = r->oz + r->dz * t,
                 ring = shd_vd_sqrt(x * x + z * z), off = ring - 1;
    return 4 * ring * ((off - tube) * (off + tube) + y * y);
}

/* Writes exact roots, t from the origin as it came. If f64 tells what f is, f32 can tell what to
 * add. Returns a bit for each lane in which that is the first root beyond any doubt: a slope as
 * small as f32's rounding is left to the search. */
static inline unsigned polish_roots(double tube, const rays *a, const rays *b, const guess *g,
                                    double *restrict out) {
    const float around = 1 + (float)tube, flat = 2e-6f * around * around * around,
                enough = 1e-9f * (float)tube;
    shd_vd t = shd_vd_widen(shd_vf_half(g->t, 0)), u = shd_vd_widen(shd_vf_half(g->t, 1));
    shd_vf near = g->t, slope = (4 * near * near + 2 * g->p) * near + g->q;
    const shd_vf value = join_vectors(value_at(a, t), value_at(b, u)),
                 curve = 6 * near * near + g->p;
    shd_vf step = value * slope / (slope * slope - value * curve);
    t -= shd_vd_widen(shd_vf_half(step, 0)), u -= shd_vd_widen(shd_vf_half(step, 1));
    near -= step;
    slope = (4 * near * near + 2 * g->p) * near + g->q;
    step = join_vectors(excess_at(a, tube, t), excess_at(b, tube, u)) / slope;
    t -= shd_vd_widen(shd_vf_half(step, 0)), u -= shd_vd_widen(shd_vf_half(step, 1));
    shd_mf sure = shd_vf_gt_in(is_first(tube, g), shd_vf_set(-flat), slope);
    sure = shd_vf_gt_in(sure, shd_vf_set(enough), shd_vf_max(step, -step));
    const unsigned beyond = shd_md_bits(shd_vd_gt(t, a->near)) | shd_md_bits(shd_vd_gt(u, b->near))
                                                                     << LANES;
    shd_vd_store(out, (t + a->along) * a->inverse);
    shd_vd_store(out + LANES, (u + b->along) * b->inverse);
    return shd_mf_bits(sure) & beyond;
}

/* ---- Part by part. ---- */

/* Where f may turn: the derivative's root between `from` and `to`, where it is monotone; `to` where
 * there is none. Begun at `start`, Halley's steps do not pass the root: at the outer end of the
 * outer intervals, and in the inner one at its inflection. A step's square over the slope is more
 * than what is left after it; of that, the quartic's minimum feels the square. */
static shd_vd find_turn(const rays *r, shd_vd from, shd_vd to, shd_vd start) {
    const double enough = 1e-9;
    const shd_vd b = 0.5 * r->p, c = 0.25 * r->q, before = (from * from + b) * from + c,
                 after = (to * to + b) * to + c;
    shd_md going = shd_vd_gt(shd_vd_set(0), before * after);
    shd_vd t = shd_vd_select(going, start, to);
    for (int step = 0; step < 64 && shd_md_any(going); step++) {
        const shd_vd value = (t * t + b) * t + c, slope = 3 * t * t + b;
        /* not-a-number too is held */
        shd_vd next = shd_vd_max(t - value * slope / (slope * slope - 3 * t * value), from);
        next = shd_vd_min(next, to);
        const shd_vd size = next - t;
        t = shd_vd_select(going, next, t);
        going = shd_vd_gt_in(going, size * size, enough * magnitude_of(slope));
    }
    return t;
}

static shd_md is_inside(const rays *r, double tube, shd_vd t) {
    shd_vd slope;
    return shd_vd_gt(shd_vd_set(0), distance_at(r, tube, t, &slope));
}

/* Where the torus may be: within the sphere around it and the planes above and below it, a little
 * widened, so that the ends are outside. high <= low: nowhere. */
static void torus_range(double tube, const rays *r, shd_vd *low, shd_vd *high) {
    const double wider = 1 + 1e-6, around = (1 + tube) * wider, above = tube * wider;
    const shd_vd none = shd_vd_set(0), least = shd_vd_set(1e-200),
                 reach = shd_vd_sqrt(shd_vd_max(around * around - r->m, none));
    const shd_vd per_y = 1 / shd_vd_select(shd_vd_gt(magnitude_of(r->dy), least), r->dy, least),
                 half = above * magnitude_of(per_y), middle = -r->oy * per_y;
    *low = shd_vd_max(middle - half, -reach);
    *high = shd_vd_min(middle + half, reach);
}

/* Where rays from outside enter: between `from` and `to`. Returns which do. */
static shd_md enter_tube(double tube, const rays *r, const shd_vd mark[4], shd_vd *from,
                         shd_vd *to) {
    *from = mark[0];
    *to = find_turn(r, mark[0], mark[1], mark[0]);
    const shd_md met = is_inside(r, tube, *to);
    if (!shd_md_any(shd_md_not(met))) return met;
    const shd_vd last = find_turn(r, mark[2], mark[3], mark[3]);
    *from = shd_vd_select(met, *from, *to);
    *to = shd_vd_select(met, *to, last);
    return shd_md_or(met, is_inside(r, tube, *to));
}

/* From inside: the first of the four monotone intervals at whose end it is outside. */
static shd_md leave_tube(double tube, const rays *r, const shd_vd mark[4], shd_md inside,
                         shd_vd *from, shd_vd *to) {
    const shd_vd middle = shd_vd_min(shd_vd_max(shd_vd_set(0), mark[1]), mark[2]);
    const shd_vd end[] = {mark[0], find_turn(r, mark[0], mark[1], mark[0]),
                          find_turn(r, mark[1], mark[2], middle),
                          find_turn(r, mark[2], mark[3], mark[3]), mark[3]};
    shd_md searching = inside;
    for (int part = 0; part < 4; part++) {
        *from = shd_vd_select(searching, end[part], *from);
        *to = shd_vd_select(searching, end[part + 1], *to);
        searching = shd_md_and(searching, is_inside(r, tube, *to));
    }
    return shd_md_and(inside, shd_md_not(searching));
}

/* From the end outside of the tube Newton's steps do not pass the root where the distance is
 * convex; where they leave the bracket it is halved. */
static shd_vd find_surface(double tube, const rays *r, shd_md met, shd_md inside, shd_vd from,
                           shd_vd to) {
    const double enough = 1e-15 * (1 + tube);
    const shd_vd side = shd_vd_select(inside, shd_vd_set(-1), shd_vd_set(1));
    shd_vd t = shd_vd_select(inside, to, from);
    for (int step = 0; step < 64 && shd_md_any(met); step++) {
        shd_vd slope;
        const shd_vd value = distance_at(r, tube, t, &slope);
        const shd_md behind = shd_vd_gt(shd_vd_set(0), value * side); /* on the side of `to` */
        from = shd_vd_select(behind, from, t);
        to = shd_vd_select(behind, t, to);
        shd_vd next = t - value / slope;
        const shd_md wild = shd_md_or(
            shd_md_not(shd_vd_gt(shd_vd_set(INFINITY), magnitude_of(next))), /* not-a-number too */
            shd_md_or(shd_vd_gt(from, next), shd_vd_gt(next, to)));
        next = shd_vd_select(wild, 0.5 * (from + to), next);
        /* What a step leaves is about its square over the slope. */
        const shd_vd size = magnitude_of(next - t), rest = shd_vd_select(wild, size, size * size),
                     unit = shd_vd_select(wild, shd_vd_set(1), magnitude_of(slope));
        t = shd_vd_select(met, next, t);
        met = shd_vd_gt_in(met, size, shd_vd_set(enough));
        met = shd_vd_gt_in(met, rest, enough * unit);
    }
    return t;
}

/* t from the origin as it came. */
static shd_vd search_roots(double tube, const rays *r) {
    shd_vd low, high, from, to;
    torus_range(tube, r, &low, &high);
    shd_md inside = shd_vd_gt(r->near, low); /* perhaps */
    low = shd_vd_max(low, r->near);
    const shd_md wanted = shd_vd_gt(high, low);
    high = shd_vd_max(high, low);
    const shd_vd bend = shd_vd_sqrt(shd_vd_max(r->p * (-1.0 / 6), shd_vd_set(0)));
    const shd_vd mark[] = {low, shd_vd_min(shd_vd_max(-bend, low), high),
                           shd_vd_min(shd_vd_max(bend, low), high), high};
    inside = shd_md_and(shd_md_and(inside, wanted), is_inside(r, tube, low));
    shd_md met = shd_md_and(wanted, shd_md_not(inside));
    met = shd_md_and(met, enter_tube(tube, r, mark, &from, &to));
    if (shd_md_any(inside)) met = shd_md_or(met, leave_tube(tube, r, mark, inside, &from, &to));
    const shd_vd t = find_surface(tube, r, met, inside, from, to);
    return shd_vd_select(met, (t + r->along) * r->inverse, shd_vd_set(INFINITY));
}

static void search_lanes(double tube, uint64_t lanes, shd_work *restrict work) {
    shd_work part;
    int lane[SHD_RAYS], count = 0;
    while (lanes) {
        const int i = lane[count] = __builtin_ctzll(lanes);
        part.ox[count] = work->ox[i], part.oy[count] = work->oy[i], part.oz[count] = work->oz[i];
        part.dx[count] = work->dx[i], part.dy[count] = work->dy[i], part.dz[count] = work->dz[i];
        part.near[count++] = work->near[i];
        /* The last one fills its vector. */
        if ((lanes & (lanes - 1)) || count % LANES == 0) lanes &= lanes - 1;
    }
    for (int at = 0; at < count; at += LANES) {
        const rays r = read_rays(tube, &part, at);
        shd_vd_store(part.t + at, search_roots(tube, &r));
    }
    for (int k = 0; k < count; k++) work->t[lane[k]] = part.t[k];
}

void SHD_VARIANT(shd_find_torus)(double tube, shd_work *work) {
    rays r[SHD_RAYS / LANES];
    guess g[SHD_RAYS / SHD_W];
    uint64_t open = 0;
    /* One after the other, each would wait for its own results. */
    for (int k = 0; k < SHD_RAYS / LANES; k++) r[k] = read_rays(tube, work, k * LANES);
    for (int k = 0; k < SHD_RAYS / SHD_W; k++) g[k] = start_guess(tube, &r[2 * k], &r[2 * k + 1]);
    for (int step = 0; step < STEPS; step++)
        for (int k = 0; k < SHD_RAYS / SHD_W; k++) advance_guess(&g[k], step);
    for (int k = 0; k < SHD_RAYS / SHD_W; k++) {
        double *out = work->t + k * SHD_W;
        const unsigned bounded = shd_mf_bits(g[k].bounded),
                       sure =
                           bounded ? polish_roots(tube, &r[2 * k], &r[2 * k + 1], &g[k], out) : 0;
        for (int i = 0; i < SHD_W; i++) out[i] = bounded >> i & 1 ? out[i] : INFINITY;
        open |= (uint64_t)(bounded & ~sure) << (k * SHD_W);
    }
    if (open) search_lanes(tube, open, work);
}

/* From the tube's circle, of radius 1 around y. */
void SHD_VARIANT(shd_place_torus)(double tube, const shd_work *work, shd_surfaces *out) {
    const shd_work *restrict w = work;
    shd_surfaces *restrict to = out;
    for (int i = 0; i < SHD_RAYS; i++) {
        double x = w->ox[i] + w->dx[i] * w->t[i], y = w->oy[i] + w->dy[i] * w->t[i],
               z = w->oz[i] + w->dz[i] * w->t[i];
        double square = x * x + z * z, inverse = shd_inverse_root(square);
        double ax = x * inverse, az = z * inverse, off = square * inverse - 1;
        double scale = shd_inverse_root(off * off + y * y);
        double n = off * scale, ny = y * scale;
        to->normal[0][i] = ax * n;
        to->normal[1][i] = ny;
        to->normal[2][i] = az * n;
        to->point[0][i] = ax * (1 + tube * n);
        to->point[1][i] = tube * ny;
        to->point[2][i] = az * (1 + tube * n);
    }
}
