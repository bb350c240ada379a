/* What is seen of balls. Compiled once an instruction set. */
#include <assert.h>

#include "sight/ball_simd.h"

SHD_INLINE void find_ball(const shd_seen_ball *ball, const shd_batch *restrict b,
                          double *restrict t, bool orthographic, bool far) {
    const shd_seen_ball own = *ball;
    SHD_EACH_LANE(i) t[i] = shd_meet_lane(&own, b, i, orthographic, far).t * own.size;
}

void SHD_VARIANT(shd_find_ball)(const shd_seen_ball *ball, const shd_batch *b, double *t) {
    SHD_FOR_BALL(b, ball->far, find_ball, ball, b, t);
}

SHD_INLINE void place_ball(const shd_seen_ball *ball, const shd_batch *restrict b,
                           shd_surfaces *restrict out, bool orthographic, bool far) {
    const shd_seen_ball own = *ball;
    SHD_EACH_LANE(i) {
        const shd_ball_hit hit = shd_meet_lane(&own, b, i, orthographic, far);
        shd_set_lane(out->point, i, hit.at);
        shd_set_lane(out->normal, i, hit.at);
    }
}

void SHD_VARIANT(shd_place_ball)(const shd_seen_ball *ball, const shd_batch *b, shd_surfaces *out) {
    SHD_FOR_BALL(b, ball->far, place_ball, ball, b, out);
}

/* All at once, for tiers in f32 that want no more. */
SHD_INLINE void show_ball(const shd_seen_ball *ball, const shd_batch *restrict b,
                          double *restrict t, shd_stage *restrict out, bool orthographic,
                          bool far) {
    const shd_seen_ball own = *ball;
    const double scale = own.size * b->scale;
    SHD_EACH_LANE(i) {
        const shd_ball_hit hit = shd_meet_lane(&own, b, i, orthographic, far);
        t[i] = hit.t * own.size;
        shd_set_lane32(out->position32, i, shd_madd(own.center, hit.at, scale));
        shd_set_lane32(out->normal32, i, shd_scale(hit.at, hit.side < 0 ? 1 : own.turned));
        /* N.V is half the chord, because V is minus the ray, at right angles to the foot. */
        shd_set_lane32(out->mirror32, i,
                       shd_madd(shd_lane(b->direction, i), hit.at, -2 * hit.side));
    }
}

/* The same in some sectors. */
SHD_INLINE void show_ball_in(const shd_seen_ball *ball, const shd_batch *restrict b,
                             unsigned sectors, shd_stage *restrict out, bool orthographic,
                             bool far) {
    const shd_seen_ball own = *ball;
    const double scale = own.size * b->scale;
    for (; sectors; sectors &= sectors - 1) {
        const int first = 8 * __builtin_ctz(sectors);
        for (int i = first; i < first + 8; i++) {
            const shd_ball_hit hit = shd_meet_lane(&own, b, i, orthographic, far);
            shd_set_lane32(out->position32, i, shd_madd(own.center, hit.at, scale));
            shd_set_lane32(out->normal32, i, shd_scale(hit.at, hit.side < 0 ? 1 : own.turned));
            shd_set_lane32(out->mirror32, i,
                           shd_madd(shd_lane(b->direction, i), hit.at, -2 * hit.side));
        }
    }
}

void SHD_VARIANT(shd_show_ball_in)(const shd_seen_ball *ball, const shd_batch *b, unsigned sectors,
                                   shd_stage *out) {
    SHD_FOR_BALL(b, ball->far, show_ball_in, ball, b, sectors, out);
}

void SHD_VARIANT(shd_show_ball)(const shd_seen_ball *ball, const shd_batch *b, double *t,
                                shd_stage *out) {
    SHD_FOR_BALL(b, ball->far, show_ball, ball, b, t, out);
}

/* ---- Several balls, each in the lanes that hit it. ---- */

/* The lanes that hit something, one after the other, and padded to a sector. */
typedef struct packed_balls {
    SHD_ALIGNED double direction[3][SHD_RAYS], origin[3][SHD_RAYS], center[3][SHD_RAYS],
        scale[SHD_RAYS], turned[SHD_RAYS];
    float position32[3][SHD_RAYS], normal32[3][SHD_RAYS], mirror32[3][SHD_RAYS];
    uint32_t shot[SHD_RAYS];
    int32_t object[SHD_RAYS];
} packed_balls;

/* The lanes in which an object was hit, or another one than `other`. */
static uint64_t lanes_above(const double *object, double other) {
    uint64_t lanes = 0;
    for (int i = 0; i < SHD_RAYS; i += SHD_W / 2)
        lanes |= (uint64_t)shd_md_bits(shd_vd_gt(shd_vd_load(object + i), shd_vd_set(other))) << i;
    return lanes;
}

/* Whether all lanes hit the same object. */
static bool is_one_object(const double *object, uint64_t lanes) {
    return !~lanes && !lanes_above(object, object[0]) && !~lanes_above(object, object[0] - 0.5);
}

/* False: not all are balls that are as far as the first one. */
static bool pack_lanes(const shd_seen_object *objects, const shd_batch *b, const double *object,
                       uint64_t lanes, size_t first, packed_balls *p) {
    const shd_seen_object *one = &objects[(int)object[__builtin_ctzll(lanes)]];
    if (!one->is_ball) return false; /* and its `ball` is not set */
    const bool far = one->ball.far;
    int n = 0;
    for (; lanes; lanes &= lanes - 1, n++) {
        const int i = __builtin_ctzll(lanes);
        const shd_seen_object *g = &objects[p->object[n] = (int32_t)object[i]];
        if (!g->is_ball || g->ball.far != far) return false;
        shd_vec3 origin = g->ball.eye;
        if (b->orthographic) origin = shd_madd(origin, shd_lane(b->start, i), 1 / g->ball.size);
        p->shot[n] = (uint32_t)first + (uint32_t)i;
        shd_set_lane(p->direction, n, shd_lane(b->direction, i));
        shd_set_lane(p->origin, n, origin);
        shd_set_lane(p->center, n, g->ball.center);
        p->scale[n] = g->ball.size * b->scale;
        p->turned[n] = g->ball.turned;
    }
    for (; n % 8; n++) {
        p->shot[n] = p->shot[n - 1];
        p->object[n] = p->object[n - 1];
        shd_set_lane(p->direction, n, shd_lane(p->direction, n - 1));
        shd_set_lane(p->origin, n, shd_lane(p->origin, n - 1));
        shd_set_lane(p->center, n, shd_lane(p->center, n - 1));
        p->scale[n] = p->scale[n - 1];
        p->turned[n] = p->turned[n - 1];
    }
    return true;
}

SHD_INLINE void show_packed(packed_balls *restrict p, int count, bool orthographic, bool far) {
    (void)orthographic;
    for (int from = 0; from < count; from += 8)
        for (int i = from; i < from + 8; i++) {
            const shd_vec3 ray = shd_lane(p->direction, i);
            const shd_ball_hit hit = shd_meet_ball(shd_lane(p->origin, i), ray, far);
            shd_set_lane32(p->position32, i, shd_madd(shd_lane(p->center, i), hit.at, p->scale[i]));
            shd_set_lane32(p->normal32, i, shd_scale(hit.at, hit.side < 0 ? 1 : p->turned[i]));
            shd_set_lane32(p->mirror32, i, shd_madd(ray, hit.at, -2 * hit.side));
        }
}

/* Appends an array: in whole vectors, if there is room for them. */
SHD_INLINE void append_packed(void *to, const void *from, size_t at, size_t count, size_t room) {
    char *out = (char *)to + 4 * at;
    if (count + SHD_W > room) {
        memcpy(out, from, 4 * count);
        return;
    }
    for (size_t i = 0; i < count; i += SHD_W) {
        shd_vf some;
        memcpy(&some, (const char *)from + 4 * i, sizeof some);
        memcpy(out + 4 * i, &some, sizeof some);
    }
}

bool SHD_VARIANT(shd_append_balls)(const shd_sight *sight, const shd_batch *b,
                                   const shd_stage *stage, size_t hits, size_t first,
                                   shd_hits *out) {
    packed_balls p;
    const double *object = stage->object;
    const size_t at = out->count, room = out->capacity - at;
    const uint64_t lanes = lanes_above(object, SHD_NOTHING);
    assert(hits <= room);
    if (is_one_object(object, lanes) || !pack_lanes(sight->seen, b, object, lanes, first, &p))
        return false;
    const int sectors = (int)(hits + 7) / 8;
    SHD_FOR_BALL(b, sight->seen[p.object[0]].ball.far, show_packed, &p, 8 * sectors);
    append_packed(out->shot, p.shot, at, hits, room);
    append_packed(out->object, p.object, at, hits, room);
    for (int c = 0; c < 3; c++) {
        append_packed(out->position32[c], p.position32[c], at, hits, room);
        append_packed(out->normal32[c], p.normal32[c], at, hits, room);
        append_packed(out->mirror32[c], p.mirror32[c], at, hits, room);
    }
    out->count = at + hits;
    return true;
}
