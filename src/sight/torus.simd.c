/* The torus, a vector of rays at a time. (|p|^2 + 1 - r^2)^2 = 4 (x^2 + z^2) along a ray is a
 * quartic, which from the line's nearest point to the centre has no cubic term: f = t^4 + p t^2 +
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
 * circle, which is well conditioned for thin tubes and has the quartic's sign. Each lane stops by
 * itself. Compiled once an instruction set. */
#include "sight/batch.h"

enum { LANES = SHD_W / 2, STEPS = 4 };

/* On unit directions, from the line's nearest point to the centre. */
typedef struct rays {
    shd_vd ox, oy, oz, dx, dy, dz;
    shd_vd inverse; /* 1 / the direction's length as it came */
    shd_vd along;   /* from the origin as it came */
    shd_vd near;    /* only t > near counts */
    shd_vd m;       /* the square of that point's distance */
    shd_vd p, q, s;
} rays;

static inline shd_vd magnitude(shd_vd x) {
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
    r.ox = shd_vd_load(w->origin[0] + at), r.oy = shd_vd_load(w->origin[1] + at),
    r.oz = shd_vd_load(w->origin[2] + at);
    r.dx = shd_vd_load(w->direction[0] + at), r.dy = shd_vd_load(w->direction[1] + at),
    r.dz = shd_vd_load(w->direction[2] + at);
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

/* (distance from the tube's circle)^2 - r^2, and the distance from the axis. */
static inline shd_vd excess_at(const rays *r, double tube, shd_vd t, shd_vd *ring) {
    const shd_vd x = r->ox + r->dx * t, y = r->oy + r->dy * t, z = r->oz + r->dz * t;
    *ring = shd_vd_sqrt(x * x + z * z);
    return (*ring - 1 - tube) * (*ring - 1 + tube) + y * y;
}

/* ---- At once. ---- */

static inline shd_vf join(shd_vd a, shd_vd b) {
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
    shd_mf early;   /* enters these before the first inflection */
} guess;

/* Where a root is looked for first: where the ray enters, or the second inflection if that is
 * nearer to it. */
static inline guess start_guess(double tube, const rays *a, const rays *b) {
    const float around = (float)(1 + tube) * (1 + 2e-6f), above = (float)tube + 2e-6f * around,
                eps = 1e-5f * around;
    const shd_vf p = join(a->p, b->p), none = shd_vf_set(0),
                 per_y = 1 / clear_of_zero(join(a->dy, b->dy)),
                 reach = shd_vf_sqrt(shd_vf_max(around * around - join(a->m, b->m), none)),
                 half = above * shd_vf_max(per_y, -per_y), middle = join(a->oy, b->oy) * per_y,
                 low = shd_vf_max(-middle - half, -reach),
                 end = shd_vf_max(middle - half, -reach), /* negated */
        bend = shd_vf_sqrt(shd_vf_max(p * (-1.f / 6), none));
    const shd_mf early = shd_vf_gt(eps - bend, low);
    const shd_vf t = shd_vf_select(early, low, shd_vf_max(low, bend));
    return (guess){p, join(a->q, b->q), join(a->s, b->s), t, shd_vf_gt(-end, low), early};
}

/* Solves for f's parabola, and then by Halley's steps. */
static inline void advance(guess *g, int step) {
    const shd_vf t = g->t, square = t * t, value = ((square + g->p) * t + g->q) * t + g->s,
                 slope = (4 * square + 2 * g->p) * t + g->q, curve = 6 * square + g->p;
    if (step) {
        g->t -= value * slope / (slope * slope - value * curve);
    } else {
        const shd_vf rest = slope * slope - 4 * value * curve;
        g->t += 2 * value / (shd_vf_sqrt(shd_vf_max(rest, shd_vf_set(0))) - slope);
    }
}

/* Where f falls at a root t, whether it is the first one. */
static inline shd_mf is_first(double tube, const guess *g, shd_vf t) {
    const float around = 1 + (float)tube, eps = 1e-5f * around;
    const shd_vf bend = shd_vf_sqrt(shd_vf_max(g->p * (-1.f / 6), shd_vf_set(0))),
                 fall = (4.f / 3) * g->p * bend - eps * around * around;
    return shd_mf_or(shd_mf_not(g->early),
                     shd_mf_or(shd_vf_gt(-bend - eps, t), shd_vf_gt(fall, g->q)));
}

static inline shd_vd value_at(const rays *r, shd_vd t) {
    return ((t * t + r->p) * t + r->q) * t + r->s;
}

static inline shd_vd half_of(shd_vf a, int high) {
    return shd_vd_widen(shd_vf_half(a, high));
}

/* Writes exact roots, t from the origin as it came. If f64 tells what f is, f32 can tell what to
 * add. Returns a bit for each lane in which that may not be the first root: a slope as small as
 * f32's rounding is left to the search, too. */
static inline unsigned polish(double tube, const rays *a, const rays *b, const guess *g,
                              double *restrict out) {
    const float around = 1 + (float)tube, flat = 1e-5f * around * around * around,
                enough = -1e-10f / (around * around);
    shd_vd t = half_of(g->t, 0), u = half_of(g->t, 1);
    shd_vf near = g->t, slope = (4 * near * near + 2 * g->p) * near + g->q;
    const shd_vf value = join(value_at(a, t), value_at(b, u)), curve = 6 * near * near + g->p;
    shd_vf step = value * slope / (slope * slope - value * curve);
    t -= half_of(step, 0), u -= half_of(step, 1);
    near -= step;
    slope = (4 * near * near + 2 * g->p) * near + g->q;
    /* At the surface f is 4 times the one by the other. */
    shd_vd ring, other;
    const shd_vd excess = excess_at(a, tube, t, &ring), beside = excess_at(b, tube, u, &other);
    step = 4 * join(ring * excess, other * beside) / slope;
    t -= half_of(step, 0), u -= half_of(step, 1);
    shd_mf sure = shd_vf_gt_in(is_first(tube, g, near), shd_vf_set(-flat), slope);
    sure = shd_vf_gt_in(sure, enough * slope, shd_vf_max(step, -step));
    /* Steps may end far away, where slopes are so steep that any step seems small. */
    sure = shd_vf_gt_in(sure, shd_vf_set((1 + 1e-5f) * around), shd_vf_max(near, -near));
    const unsigned beyond = shd_md_bits(shd_vd_gt(t, a->near)) | shd_md_bits(shd_vd_gt(u, b->near))
                                                                     << LANES;
    const shd_vf least = shd_vf_select(g->bounded, shd_vf_set(-INFINITY), shd_vf_set(INFINITY));
    shd_vd_store(out, shd_vd_max((t + a->along) * a->inverse, half_of(least, 0)));
    shd_vd_store(out + LANES, shd_vd_max((u + b->along) * b->inverse, half_of(least, 1)));
    return shd_mf_bits(g->bounded) & ~(shd_mf_bits(sure) & beyond);
}

/* ---- Part by part. ---- */

/* Where f turns within the parts that its inflections make of a ray, in each of which its
 * derivative is monotone; the part's end where it does not. Begun at the outer ends of the outer
 * parts, and in the inner one as near to its inflection as may be, Halley's steps do not pass the
 * root. A step's square over the slope is more than what is left after it; of that, the quartic's
 * minimum feels the square. */
static void find_turns(const rays *r, const shd_vd (*mark)[4], int count, bool inner,
                       shd_vd (*turn)[3]) {
    const double enough = 1e-9;
    const shd_vd none = shd_vd_set(0);
    shd_md going[SHD_RAYS / LANES][3];
    for (int i = 0; i < count; i++) {
        const shd_vd *m = mark[i], b = 0.5 * r[i].p, c = 0.25 * r[i].q;
        const shd_vd start[] = {m[0], shd_vd_min(shd_vd_max(none, m[1]), m[2]), m[3]};
        for (int k = 0; k < 3; k++) {
            const shd_vd before = (m[k] * m[k] + b) * m[k] + c,
                         after = (m[k + 1] * m[k + 1] + b) * m[k + 1] + c;
            going[i][k] = shd_vd_gt(none, before * after);
            turn[i][k] = shd_vd_select(going[i][k], start[k], m[k + 1]);
        }
    }
    /* Side by side, for none is to wait for another's division. */
    unsigned any = 1;
    for (int step = 0; any && step < 64; step++) {
        any = 0;
        for (int i = 0; i < count; i++)
            for (int k = 0; k < 3; k += inner ? 1 : 2) {
                if (!shd_md_any(going[i][k])) continue;
                const shd_vd t = turn[i][k], b = 0.5 * r[i].p, c = 0.25 * r[i].q,
                             value = (t * t + b) * t + c, slope = 3 * t * t + b;
                /* not-a-number too is held */
                shd_vd next = t - value * slope / (slope * slope - 3 * t * value);
                next = shd_vd_min(shd_vd_max(next, mark[i][k]), mark[i][k + 1]);
                const shd_vd size = next - t;
                turn[i][k] = shd_vd_select(going[i][k], next, t);
                going[i][k] = shd_vd_gt_in(going[i][k], size * size, enough * magnitude(slope));
                any |= shd_md_bits(going[i][k]);
            }
    }
}

static shd_md is_inside(const rays *r, double tube, shd_vd t) {
    shd_vd ring;
    return shd_vd_gt(shd_vd_set(0), excess_at(r, tube, t, &ring));
}

/* Parts of a ray: where it is within the sphere around the torus and the planes above and below it,
 * a little widened, so that the ends are outside, and the inflections in there. No parts where
 * that is nowhere. Returns where it may start inside. */
static shd_md divide(double tube, const rays *r, shd_vd mark[4]) {
    const double wider = 1 + 1e-6, around = (1 + tube) * wider, above = tube * wider;
    const shd_vd none = shd_vd_set(0), least = shd_vd_set(1e-200),
                 reach = shd_vd_sqrt(shd_vd_max(around * around - r->m, none)),
                 per_y = 1 / shd_vd_select(shd_vd_gt(magnitude(r->dy), least), r->dy, least),
                 half = above * magnitude(per_y), middle = -r->oy * per_y,
                 enters = shd_vd_max(middle - half, -reach), low = shd_vd_max(enters, r->near),
                 high = shd_vd_max(shd_vd_min(middle + half, reach), low),
                 bend = shd_vd_sqrt(shd_vd_max(r->p * (-1.0 / 6), none));
    mark[0] = low;
    mark[1] = shd_vd_min(shd_vd_max(-bend, low), high);
    mark[2] = shd_vd_min(shd_vd_max(bend, low), high);
    mark[3] = high;
    return shd_vd_gt_in(shd_vd_gt(r->near, enters), high, low);
}

/* Where rays from outside enter: between `from` and `to`. Returns which do. */
static shd_md enter(double tube, const rays *r, const shd_vd end[5], shd_vd *from, shd_vd *to) {
    const shd_md met = is_inside(r, tube, end[1]), late = is_inside(r, tube, end[3]);
    *from = shd_vd_select(met, end[0], end[1]);
    *to = shd_vd_select(met, end[1], end[3]);
    return shd_md_or(met, late);
}

/* From inside: the first of the four monotone intervals at whose end it is outside. */
static shd_md leave(double tube, const rays *r, const shd_vd end[5], shd_md inside, shd_vd *from,
                    shd_vd *to) {
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
        shd_vd ring;
        const shd_vd value = excess_at(r, tube, t, &ring),
                     turning = (r->ox + r->dx * t) * r->dx + (r->oz + r->dz * t) * r->dz,
                     slope = 2 * ((ring - 1) / ring * turning + (r->oy + r->dy * t) * r->dy);
        const shd_md behind = shd_vd_gt(shd_vd_set(0), value * side); /* on the side of `to` */
        from = shd_vd_select(behind, from, t);
        to = shd_vd_select(behind, t, to);
        shd_vd next = t - value / slope;
        const shd_md wild = shd_md_or(
            shd_md_not(shd_vd_gt(shd_vd_set(INFINITY), magnitude(next))), /* not-a-number too */
            shd_md_or(shd_vd_gt(from, next), shd_vd_gt(next, to)));
        next = shd_vd_select(wild, 0.5 * (from + to), next);
        /* What a step leaves is about its square over the slope. */
        const shd_vd size = magnitude(next - t), rest = shd_vd_select(wild, size, size * size),
                     unit = shd_vd_select(wild, shd_vd_set(1), magnitude(slope));
        t = shd_vd_select(met, next, t);
        met = shd_vd_gt_in(met, size, shd_vd_set(enough));
        met = shd_vd_gt_in(met, rest, enough * unit);
    }
    return t;
}

/* t from the origin as it came. `close`: where the ray may start inside. */
static shd_vd meet(double tube, const rays *r, const shd_vd mark[4], const shd_vd turn[3],
                   shd_md close) {
    const shd_vd end[] = {mark[0], turn[0], turn[1], turn[2], mark[3]};
    const shd_md wanted = shd_vd_gt(mark[3], mark[0]);
    shd_md inside = close, met;
    shd_vd from, to;
    if (shd_md_any(close)) inside = shd_md_and(close, is_inside(r, tube, mark[0]));
    met = shd_md_and(shd_md_and(wanted, shd_md_not(inside)), enter(tube, r, end, &from, &to));
    if (shd_md_any(inside)) met = shd_md_or(met, leave(tube, r, end, inside, &from, &to));
    const shd_vd t = find_surface(tube, r, met, inside, from, to);
    return shd_vd_select(met, (t + r->along) * r->inverse, shd_vd_set(INFINITY));
}

static void search_lanes(double tube, uint64_t lanes, shd_work *restrict work) {
    shd_work part;
    int lane[SHD_RAYS], count = 0;
    while (lanes) {
        const int i = lane[count] = __builtin_ctzll(lanes);
        shd_set_lane(part.origin, count, shd_lane(work->origin, i));
        shd_set_lane(part.direction, count, shd_lane(work->direction, i));
        part.near[count++] = work->near[i];
        /* The last one fills its vector. */
        if ((lanes & (lanes - 1)) || count % LANES == 0) lanes &= lanes - 1;
    }
    rays r[SHD_RAYS / LANES];
    shd_vd mark[SHD_RAYS / LANES][4], turn[SHD_RAYS / LANES][3];
    shd_md close[SHD_RAYS / LANES];
    unsigned inner = 0;
    const int vectors = count / LANES;
    for (int k = 0; k < vectors; k++) {
        r[k] = read_rays(tube, &part, k * LANES);
        close[k] = divide(tube, &r[k], mark[k]);
        inner |= shd_md_bits(close[k]);
    }
    find_turns(r, mark, vectors, inner, turn);
    for (int k = 0; k < vectors; k++)
        shd_vd_store(part.t + k * LANES, meet(tube, &r[k], mark[k], turn[k], close[k]));
    for (int k = 0; k < count; k++) work->t[lane[k]] = part.t[k];
}

void SHD_VARIANT(shd_find_torus)(double tube, shd_work *work) {
    rays r[SHD_RAYS / LANES];
    guess g[SHD_RAYS / SHD_W];
    uint64_t open = 0;
    if (tube > 1e5) { /* f32 has no room for the coefficients */
        search_lanes(tube, UINT64_MAX, work);
        return;
    }
    /* One after the other, each would wait for its own results. */
    for (int k = 0; k < SHD_RAYS / LANES; k++) r[k] = read_rays(tube, work, k * LANES);
    for (int k = 0; k < SHD_RAYS / SHD_W; k++) g[k] = start_guess(tube, &r[2 * k], &r[2 * k + 1]);
    for (int step = 0; step < STEPS; step++)
        for (int k = 0; k < SHD_RAYS / SHD_W; k++) advance(&g[k], step);
    for (int k = 0; k < SHD_RAYS / SHD_W; k++) {
        const unsigned left = polish(tube, &r[2 * k], &r[2 * k + 1], &g[k], work->t + k * SHD_W);
        open |= (uint64_t)left << (k * SHD_W);
    }
    if (open) search_lanes(tube, open, work);
}

/* From the tube's circle, of radius 1 around y. */
void SHD_VARIANT(shd_place_torus)(double tube, const shd_work *restrict w,
                                  shd_surfaces *restrict out) {
    SHD_EACH_LANE(i) {
        const shd_vec3 p = shd_lane_at(w, i, w->t[i]);
        const double square = p.x * p.x + p.z * p.z, inverse = shd_inverse_root(square);
        const double x = p.x * inverse, z = p.z * inverse, off = square * inverse - 1;
        const double scale = shd_inverse_root(off * off + p.y * p.y);
        const double n = off * scale, y = p.y * scale;
        shd_set_lane(out->normal, i, (shd_vec3){x * n, y, z * n});
        shd_set_lane(out->point, i, (shd_vec3){x * (1 + tube * n), tube * y, z * (1 + tube * n)});
    }
}
