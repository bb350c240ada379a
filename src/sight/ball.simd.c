/* Balls: spheres that stay spheres, in units of their radius. Compiled once an instruction set. */
#include "sight/batch.h"

/* Where a ray meets a ball. */
typedef struct ball_hit {
    double t;    /* in radii; infinity: missed */
    double side; /* minus or plus half the chord: from the foot, where the ray is nearest */
    shd_vec3 at;
} ball_hit;

/* The discriminant is made from the distance of the line to the center, so that nothing cancels
 * (Haines et al., "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, chapter
 * 7). From far away, a second step takes out the foot's rounding errors along the ray. */
SHD_INLINE ball_hit meet_ball(shd_vec3 origin, shd_vec3 ray, bool far) {
    double along = shd_dot(origin, ray);
    shd_vec3 foot = shd_sub(origin, shd_scale(ray, along));
    if (far) {
        double more = shd_dot(foot, ray);
        foot = shd_sub(foot, shd_scale(ray, more));
        along += more;
    }
    double inside = 1 - shd_dot(foot, foot);
    double half = sqrt(inside);
    double side = -along - half > SHD_BLIND ? -half : half;
    double t = side - along;
    t = t > SHD_BLIND ? t : INFINITY;
    return (ball_hit){inside >= 0 ? t : INFINITY, side, shd_madd(foot, ray, side)};
}

/* What all lanes share. */
typedef struct ball {
    shd_vec3 eye, center; /* the center is in the plan's frame */
    double size, inverse; /* the radius, and one over it */
    double scale;         /* the radius in the plan's frame */
    double turned;        /* -1: normals that face away are negated; else 1 */
} ball;

static inline ball ball_of(const shd_item *it) {
    return (ball){it->eye,      it->to_frame.origin,       it->size,
                  1 / it->size, it->to_frame.linear[0][0], it->front_only ? 1 : -1};
}

/* Calls a function that is compiled for each kind of camera and distance. */
#define CALL_FOR(b, function, ...)                                                                 \
    if ((b)->orthographic)                                                                         \
        function(__VA_ARGS__, true, true);                                                         \
    else if (it->far)                                                                              \
        function(__VA_ARGS__, false, true);                                                        \
    else                                                                                           \
        function(__VA_ARGS__, false, false)

SHD_INLINE ball_hit meet_lane(const ball *own, const shd_batch *b, int i, bool orthographic,
                              bool far) {
    shd_vec3 origin = own->eye;
    if (orthographic) origin = shd_madd(origin, shd_lane(b->start, i), own->inverse);
    return meet_ball(origin, shd_lane(b->direction, i), far);
}

SHD_INLINE void find_ball(const shd_item *it, const shd_batch *restrict b, double *restrict t,
                          bool orthographic, bool far) {
    const ball own = ball_of(it);
    SHD_EACH_LANE(i) t[i] = meet_lane(&own, b, i, orthographic, far).t * own.size;
}

void SHD_VARIANT(shd_find_ball)(const shd_item *it, const shd_batch *b, double *t) {
    CALL_FOR(b, find_ball, it, b, t);
}

/* In some sectors. */
SHD_INLINE void find_ball_in(const shd_item *it, const shd_batch *restrict b, unsigned sectors,
                             double *restrict t, bool orthographic, bool far) {
    const ball own = ball_of(it);
    for (; sectors; sectors &= sectors - 1) {
        const int first = 8 * __builtin_ctz(sectors);
        for (int i = first; i < first + 8; i++)
            t[i] = meet_lane(&own, b, i, orthographic, far).t * own.size;
    }
}

void SHD_VARIANT(shd_find_ball_in)(const shd_item *it, const shd_batch *b, unsigned sectors,
                                   double *t) {
    CALL_FOR(b, find_ball_in, it, b, sectors, t);
}

SHD_INLINE void place_ball(const shd_item *it, const shd_batch *restrict b,
                           shd_surfaces *restrict out, bool orthographic, bool far) {
    const ball own = ball_of(it);
    SHD_EACH_LANE(i) {
        const ball_hit hit = meet_lane(&own, b, i, orthographic, far);
        shd_set_lane(out->point, i, hit.at);
        shd_set_lane(out->normal, i, hit.at);
    }
}

void SHD_VARIANT(shd_place_ball)(const shd_item *it, const shd_batch *b, shd_surfaces *out) {
    CALL_FOR(b, place_ball, it, b, out);
}

/* All at once, for tiers in f32 that want no more. */
SHD_INLINE void show_ball(const shd_item *it, const shd_batch *restrict b, double *restrict t,
                          shd_stage *restrict out, bool orthographic, bool far) {
    const ball own = ball_of(it);
    SHD_EACH_LANE(i) {
        const ball_hit hit = meet_lane(&own, b, i, orthographic, far);
        t[i] = hit.t * own.size;
        shd_set_lane32(out->position32, i, shd_madd(own.center, hit.at, own.scale));
        shd_set_lane32(out->normal32, i, shd_scale(hit.at, hit.side < 0 ? 1 : own.turned));
        /* N.V is half the chord, because V is minus the ray, at right angles to the foot. */
        shd_set_lane32(out->mirror32, i,
                       shd_madd(shd_lane(b->direction, i), hit.at, -2 * hit.side));
    }
}

/* The same in some sectors. */
SHD_INLINE void show_ball_in(const shd_item *it, const shd_batch *restrict b, unsigned sectors,
                             shd_stage *restrict out, bool orthographic, bool far) {
    const ball own = ball_of(it);
    for (; sectors; sectors &= sectors - 1) {
        const int first = 8 * __builtin_ctz(sectors);
        for (int i = first; i < first + 8; i++) {
            const ball_hit hit = meet_lane(&own, b, i, orthographic, far);
            shd_set_lane32(out->position32, i, shd_madd(own.center, hit.at, own.scale));
            shd_set_lane32(out->normal32, i, shd_scale(hit.at, hit.side < 0 ? 1 : own.turned));
            shd_set_lane32(out->mirror32, i,
                           shd_madd(shd_lane(b->direction, i), hit.at, -2 * hit.side));
        }
    }
}

void SHD_VARIANT(shd_show_ball_in)(const shd_item *it, const shd_batch *b, unsigned sectors,
                                   shd_stage *out) {
    CALL_FOR(b, show_ball_in, it, b, sectors, out);
}

void SHD_VARIANT(shd_show_ball)(const shd_item *it, const shd_batch *b, double *t, shd_stage *out) {
    CALL_FOR(b, show_ball, it, b, t, out);
}

/* Several balls, each in the lanes that hit it. */
SHD_INLINE void show_balls(const shd_sight *sight, const shd_batch *restrict b,
                           shd_stage *restrict out, bool orthographic, bool far) {
    SHD_ALIGNED double eye[3][SHD_RAYS], center[3][SHD_RAYS], scale[SHD_RAYS], turned[SHD_RAYS],
        inverse[SHD_RAYS];
    for (int i = 0; i < SHD_RAYS; i++) {
        const double object = out->object[i];
        const shd_item *it = &sight->items[object == SHD_NOTHING ? 0 : (int)object];
        shd_set_lane(eye, i, it->eye);
        shd_set_lane(center, i, it->to_frame.origin);
        scale[i] = it->to_frame.linear[0][0];
        turned[i] = it->front_only ? 1 : -1;
        inverse[i] = orthographic ? 1 / it->size : 0;
    }
    SHD_EACH_LANE(i) {
        shd_vec3 origin = shd_lane(eye, i);
        if (orthographic) origin = shd_madd(origin, shd_lane(b->start, i), inverse[i]);
        const ball_hit hit = meet_ball(origin, shd_lane(b->direction, i), far);
        shd_set_lane32(out->position32, i, shd_madd(shd_lane(center, i), hit.at, scale[i]));
        shd_set_lane32(out->normal32, i, shd_scale(hit.at, hit.side < 0 ? 1 : turned[i]));
        shd_set_lane32(out->mirror32, i,
                       shd_madd(shd_lane(b->direction, i), hit.at, -2 * hit.side));
    }
}

void SHD_VARIANT(shd_show_balls)(const shd_sight *sight, const shd_item *it, const shd_batch *b,
                                 shd_stage *out) {
    CALL_FOR(b, show_balls, sight, b, out);
}
