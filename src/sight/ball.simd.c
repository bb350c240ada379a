/* Balls: spheres that stay spheres, in units of their radius. Compiled once an instruction set. */
#include "sight/rays.h"

/* Where a ray u meets a ball: at the point (x, y, z). */
typedef struct ball_hit {
    double t;    /* in radii; infinity: missed */
    double side; /* minus or plus half the chord: from the foot, where the ray is nearest */
    double x, y, z;
} ball_hit;

/* The discriminant is made from the distance of the line to the center, so that nothing cancels
 * (Haines et al., "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, chapter
 * 7). From far away, a second step takes out the foot's rounding errors along the ray. */
SHD_ALWAYS ball_hit meet_ball(shd_vec3 o, shd_vec3 u, bool far) {
    double along = o.x * u.x + o.y * u.y + o.z * u.z;
    double x = o.x - along * u.x, y = o.y - along * u.y, z = o.z - along * u.z;
    if (far) {
        double more = x * u.x + y * u.y + z * u.z;
        x -= more * u.x, y -= more * u.y, z -= more * u.z;
        along += more;
    }
    double inside = 1 - (x * x + y * y + z * z);
    double half = sqrt(inside);
    double side = -along - half > SHD_BLIND ? -half : half;
    double t = side - along;
    t = t > SHD_BLIND ? t : INFINITY;
    return (ball_hit){inside >= 0 ? t : INFINITY, side, x + side * u.x, y + side * u.y,
                      z + side * u.z};
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

SHD_ALWAYS shd_vec3 start_from_ball(const ball *own, shd_vec3 start) {
    return (shd_vec3){own->eye.x + start.x * own->inverse, own->eye.y + start.y * own->inverse,
                      own->eye.z + start.z * own->inverse};
}

/* ---- Rays of a batch. ---- */

/* Calls a function that is compiled for each kind of camera and distance. */
#define CALL_FOR(b, function, ...)                                                                 \
    if ((b)->orthographic)                                                                         \
        function(__VA_ARGS__, true, true);                                                         \
    else if (it->far)                                                                              \
        function(__VA_ARGS__, false, true);                                                        \
    else                                                                                           \
        function(__VA_ARGS__, false, false)

SHD_ALWAYS shd_vec3 direction_of(const shd_batch *b, int i) {
    return (shd_vec3){b->direction[0][i], b->direction[1][i], b->direction[2][i]};
}

SHD_ALWAYS ball_hit meet_lane(const ball *own, const shd_batch *b, int i, bool orthographic,
                              bool far) {
    shd_vec3 origin = own->eye;
    if (orthographic)
        origin = start_from_ball(own, (shd_vec3){b->start[0][i], b->start[1][i], b->start[2][i]});
    return meet_ball(origin, direction_of(b, i), far);
}

SHD_ALWAYS void find_ball(const shd_item *it, const shd_batch *restrict b, double *restrict t,
                          bool orthographic, bool far) {
    const ball own = ball_of(it);
    SHD_EACH_LANE(i) t[i] = meet_lane(&own, b, i, orthographic, far).t * own.size;
}

void SHD_VARIANT(shd_find_ball)(const shd_item *it, const shd_batch *b, double *t) {
    CALL_FOR(b, find_ball, it, b, t);
}

SHD_ALWAYS void place_ball(const shd_item *it, const shd_batch *restrict b,
                           shd_surfaces *restrict out, bool orthographic, bool far) {
    const ball own = ball_of(it);
    SHD_EACH_LANE(i) {
        const ball_hit hit = meet_lane(&own, b, i, orthographic, far);
        out->point[0][i] = out->normal[0][i] = hit.x;
        out->point[1][i] = out->normal[1][i] = hit.y;
        out->point[2][i] = out->normal[2][i] = hit.z;
    }
}

void SHD_VARIANT(shd_place_ball)(const shd_item *it, const shd_batch *b, shd_surfaces *out) {
    CALL_FOR(b, place_ball, it, b, out);
}

/* ---- All at once, for tiers in f32 that want no more. ---- */

SHD_ALWAYS void show_lane(const ball *own, shd_vec3 u, ball_hit hit, int i,
                          shd_stage *restrict out) {
    double sign = hit.side < 0 ? 1 : own->turned, twice = -2 * hit.side;
    out->position32[0][i] = (float)(own->scale * hit.x + own->center.x);
    out->position32[1][i] = (float)(own->scale * hit.y + own->center.y);
    out->position32[2][i] = (float)(own->scale * hit.z + own->center.z);
    out->normal32[0][i] = (float)(sign * hit.x);
    out->normal32[1][i] = (float)(sign * hit.y);
    out->normal32[2][i] = (float)(sign * hit.z);
    /* N.V is half the chord, because V is -u and the foot is at right angles to u. */
    out->mirror32[0][i] = (float)(twice * hit.x + u.x);
    out->mirror32[1][i] = (float)(twice * hit.y + u.y);
    out->mirror32[2][i] = (float)(twice * hit.z + u.z);
}

SHD_ALWAYS void show_ball(const shd_item *it, const shd_batch *restrict b, double *restrict t,
                          shd_stage *restrict out, bool orthographic, bool far) {
    const ball own = ball_of(it);
    SHD_EACH_LANE(i) {
        const ball_hit hit = meet_lane(&own, b, i, orthographic, far);
        t[i] = hit.t * own.size;
        show_lane(&own, direction_of(b, i), hit, i, out);
    }
}

void SHD_VARIANT(shd_show_ball)(const shd_item *it, const shd_batch *b, double *t, shd_stage *out) {
    CALL_FOR(b, show_ball, it, b, t, out);
}
