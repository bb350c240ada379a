/* A batch of rays: made, carried into each object's frame, met, and the nearest hits carried back
 * into the world or the plan's frame. Compiled once an instruction set.
 *
 * An object is first only asked for t. When it is known which objects the lanes hit, each of these
 * gives its surface, from the same formulas. */
#include <float.h>

#include "sight/batch.h"
#include "sight/shapes.h"

#define LANES(i) for (int i = 0; i < SHD_RAYS; i++)
#define ALWAYS   static inline __attribute__((always_inline))

/* Rays start at the camera's position, plus `start` in an orthographic camera. */
typedef struct batch {
    SHD_ALIGNED double x[SHD_RAYS], y[SHD_RAYS]; /* in pixels */
    double direction[3][SHD_RAYS];               /* unit */
    double start[3][SHD_RAYS];                   /* orthographic; else not set */
    bool orthographic;
    shd_work work[2];
    shd_surfaces surfaces;
} batch;

/* ---- Rays. ---- */

static void read_shots(const shd_sight *sight, const shd_shots *shots, size_t first, int used,
                       batch *restrict b) {
    const int32_t *x = shots->x + first, *y = shots->y + first;
    const uint8_t *sample = shots->sample + first;
    if (used == SHD_RAYS) {
        int other = 0;
        LANES(i) other |= sample[i] ^ sample[0];
        if (!other) {
            const double dx = sight->offset_x[sample[0]], dy = sight->offset_y[sample[0]];
            LANES(i) {
                b->x[i] = x[i] + dx;
                b->y[i] = y[i] + dy;
            }
            return;
        }
    }
    /* Lanes beyond the last shot repeat it. */
    for (int i = 0; i < SHD_RAYS; i++) {
        int from = i < used ? i : used - 1;
        b->x[i] = x[from] + sight->offset_x[sample[from]];
        b->y[i] = y[from] + sight->offset_y[sample[from]];
    }
}

/* As shd_lens_ray. The image plane's vectors are unit and at right angles, so that nothing can
 * overflow; and from the picture's centre, so that mirrored pixels get mirrored rays. */
static void make_rays(const shd_lens *lens, batch *restrict b) {
    const shd_camera *camera = lens->camera;
    const double middle_x = 0.5 * lens->width, middle_y = 0.5 * lens->height;
    const double step_x = lens->half_x / middle_x, step_y = lens->half_y / middle_y;
    const shd_vec3 right = camera->right, up = camera->up, back = camera->back;
    b->orthographic = camera->projection == SHD_ORTHOGRAPHIC;
    if (!b->orthographic) {
        LANES(i) {
            double p = (b->x[i] - middle_x) * step_x, q = (middle_y - b->y[i]) * step_y;
            double x = right.x * p + up.x * q - back.x, y = right.y * p + up.y * q - back.y,
                   z = right.z * p + up.z * q - back.z;
            double scale = shd_inverse_root(x * x + y * y + z * z);
            b->direction[0][i] = x * scale;
            b->direction[1][i] = y * scale;
            b->direction[2][i] = z * scale;
        }
        return;
    }
    LANES(i) {
        double p = (b->x[i] - middle_x) * step_x, q = (middle_y - b->y[i]) * step_y;
        b->start[0][i] = right.x * p + up.x * q;
        b->start[1][i] = right.y * p + up.y * q;
        b->start[2][i] = right.z * p + up.z * q;
        b->direction[0][i] = -back.x;
        b->direction[1][i] = -back.y;
        b->direction[2][i] = -back.z;
    }
}

/* ---- Balls: spheres that stay spheres, in units of their radius. ---- */

/* A ball's surface on a ray. `side` is minus or plus half the chord: the point is foot + side u. */
typedef struct ball_hit {
    double t; /* in radii; infinity: missed */
    double side, x, y, z;
} ball_hit;

/* The discriminant from the distance of the line to the centre: no cancellation (Haines et al.,
 * "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, chapter 7). From far
 * away the foot's rounding errors along the ray are taken out by a second step. */
ALWAYS ball_hit meet_ball(double ox, double oy, double oz, double dx, double dy, double dz,
                          bool far) {
    double along = ox * dx + oy * dy + oz * dz;
    double x = ox - along * dx, y = oy - along * dy, z = oz - along * dz;
    if (far) {
        double more = x * dx + y * dy + z * dz;
        x -= more * dx, y -= more * dy, z -= more * dz;
        along += more;
    }
    double inside = 1 - (x * x + y * y + z * z);
    double half = sqrt(inside);
    double side = -along - half > 0 ? -half : half;
    double t = side - along;
    t = t > 0 ? t : INFINITY;
    ball_hit hit = {inside >= 0 ? t : INFINITY, side, x + side * dx, y + side * dy, z + side * dz};
    return hit;
}

/* Lane i of a ball. */
ALWAYS ball_hit meet_ball_lane(const shd_item *it, shd_vec3 eye, double inverse,
                               const batch *restrict b, int i, bool orthographic, bool far) {
    (void)it;
    double ox = eye.x, oy = eye.y, oz = eye.z;
    if (orthographic) {
        ox += b->start[0][i] * inverse;
        oy += b->start[1][i] * inverse;
        oz += b->start[2][i] * inverse;
    }
    return meet_ball(ox, oy, oz, b->direction[0][i], b->direction[1][i], b->direction[2][i], far);
}

ALWAYS void find_ball_lanes(const shd_item *it, const batch *restrict b, double *restrict t,
                            bool orthographic, bool far) {
    const shd_vec3 eye = it->eye;
    const double size = it->size, inverse = 1 / size;
    LANES(i) t[i] = meet_ball_lane(it, eye, inverse, b, i, orthographic, far).t * size;
}

static void find_ball(const shd_item *it, const batch *b, double *t) {
    if (b->orthographic)
        find_ball_lanes(it, b, t, true, true);
    else if (it->far)
        find_ball_lanes(it, b, t, false, true);
    else
        find_ball_lanes(it, b, t, false, false);
}

ALWAYS void place_ball_lanes(const shd_item *it, const batch *restrict b,
                             shd_surfaces *restrict out, bool orthographic, bool far) {
    const shd_vec3 eye = it->eye;
    const double inverse = 1 / it->size;
    LANES(i) {
        ball_hit hit = meet_ball_lane(it, eye, inverse, b, i, orthographic, far);
        out->point[0][i] = out->normal[0][i] = hit.x;
        out->point[1][i] = out->normal[1][i] = hit.y;
        out->point[2][i] = out->normal[2][i] = hit.z;
    }
}

static void place_ball(const shd_item *it, const batch *b, shd_surfaces *out) {
    if (b->orthographic)
        place_ball_lanes(it, b, out, true, true);
    else if (it->far)
        place_ball_lanes(it, b, out, false, true);
    else
        place_ball_lanes(it, b, out, false, false);
}

/* All of it at once, for tiers in f32 that want no more. */
ALWAYS void show_ball_lanes(const shd_item *it, const batch *restrict b, double *restrict t,
                            shd_stage *restrict out, bool orthographic, bool far) {
    const shd_vec3 eye = it->eye, center = it->to_frame.origin;
    const double size = it->size, inverse = 1 / size, scale = it->to_frame.linear[0][0];
    const double turned = it->front_only ? 1 : -1;
    LANES(i) {
        ball_hit hit = meet_ball_lane(it, eye, inverse, b, i, orthographic, far);
        double sign = hit.side < 0 ? 1 : turned, twice = -2 * hit.side;
        t[i] = hit.t * size;
        out->position32[0][i] = (float)(scale * hit.x + center.x);
        out->position32[1][i] = (float)(scale * hit.y + center.y);
        out->position32[2][i] = (float)(scale * hit.z + center.z);
        out->normal32[0][i] = (float)(sign * hit.x);
        out->normal32[1][i] = (float)(sign * hit.y);
        out->normal32[2][i] = (float)(sign * hit.z);
        /* N.V is half the chord: V is -u, and the foot is at right angles to u. */
        out->mirror32[0][i] = (float)(twice * hit.x + b->direction[0][i]);
        out->mirror32[1][i] = (float)(twice * hit.y + b->direction[1][i]);
        out->mirror32[2][i] = (float)(twice * hit.z + b->direction[2][i]);
    }
}

static void show_ball(const shd_item *it, const batch *b, double *t, shd_stage *out) {
    if (b->orthographic)
        show_ball_lanes(it, b, t, out, true, true);
    else if (it->far)
        show_ball_lanes(it, b, t, out, false, true);
    else
        show_ball_lanes(it, b, t, out, false, false);
}

static bool is_quick(const shd_item *it, shd_wants wants) {
    return it->ball && wants.fast && !wants.low && !wants.world;
}

/* ---- Other shapes, in their frames. ---- */

/* Everything of finite size is moved closer. */
static void carry(const shd_item *it, const batch *restrict b, shd_work *restrict w) {
    const shd_affine m = it->from_world;
    const shd_vec3 eye = it->eye, forward = it->forward;
    if (b->orthographic) {
        LANES(i) {
            double x = b->start[0][i], y = b->start[1][i], z = b->start[2][i];
            w->ox[i] = m.linear[0][0] * x + m.linear[0][1] * y + m.linear[0][2] * z + eye.x;
            w->oy[i] = m.linear[1][0] * x + m.linear[1][1] * y + m.linear[1][2] * z + eye.y;
            w->oz[i] = m.linear[2][0] * x + m.linear[2][1] * y + m.linear[2][2] * z + eye.z;
            w->dx[i] = forward.x;
            w->dy[i] = forward.y;
            w->dz[i] = forward.z;
            w->near[i] = w->shift[i] = 0;
        }
    } else {
        LANES(i) {
            double x = b->direction[0][i], y = b->direction[1][i], z = b->direction[2][i];
            w->dx[i] = m.linear[0][0] * x + m.linear[0][1] * y + m.linear[0][2] * z;
            w->dy[i] = m.linear[1][0] * x + m.linear[1][1] * y + m.linear[1][2] * z;
            w->dz[i] = m.linear[2][0] * x + m.linear[2][1] * y + m.linear[2][2] * z;
            w->ox[i] = eye.x;
            w->oy[i] = eye.y;
            w->oz[i] = eye.z;
            w->near[i] = w->shift[i] = 0;
        }
    }
    if (it->shape != SHD_PLANE) LANES(i) shd_approach(w, i);
}

/* t of an item that is no mesh; `work` keeps what its surface is made from. */
static void find(const shd_item *it, const batch *b, shd_work *work, double *restrict t) {
    if (it->ball) {
        find_ball(it, b, t);
        return;
    }
    carry(it, b, work);
    SHD_VARIANT(shd_find_surfaces)(it->shape, it->tube, work);
    LANES(i) t[i] = work->t[i] + work->shift[i];
}

/* A mesh, a ray at a time. */
static void find_in_mesh(const shd_item *it, const batch *b, int used, double *t,
                         uint32_t *triangle, double *u, double *v) {
    for (int i = 0; i < SHD_RAYS; i++) {
        t[i] = INFINITY;
        if (i >= used) continue;
        shd_ray ray = {it->eye, it->forward, 0};
        if (b->orthographic) {
            shd_vec3 start = {b->start[0][i], b->start[1][i], b->start[2][i]};
            ray.origin = shd_add(shd_linear(&it->from_world, start), it->eye);
        } else {
            shd_vec3 direction = {b->direction[0][i], b->direction[1][i], b->direction[2][i]};
            ray.direction = shd_linear(&it->from_world, direction);
        }
        double at;
        if (shd_mesh_tree_intersect(it->tree, &ray, &at, &triangle[i], &u[i], &v[i])) t[i] = at;
    }
}

static void place_on_mesh(const shd_item *it, double object, const shd_stage *stage,
                          shd_surfaces *out) {
    for (int i = 0; i < SHD_RAYS; i++) {
        shd_vec3 p = {0, 0, 0}, n = {0, 0, 0};
        if (stage->object[i] == object)
            shd_item_place(it, stage->triangle[i], stage->u[i], stage->v[i], &p, &n);
        out->point[0][i] = p.x, out->normal[0][i] = n.x;
        out->point[1][i] = p.y, out->normal[1][i] = n.y;
        out->point[2][i] = p.z, out->normal[2][i] = n.z;
    }
}

/* ---- Back into the world. ---- */

/* Unit normals in the world, in place, from outward unit normals of the unit form. */
static void turn_normals(const shd_item *it, const batch *restrict b,
                         double n[restrict 3][SHD_RAYS]) {
    const shd_affine k = it->normal_map;
    const double turned = it->front_only ? 1 : -1;
    if (it->similar && it->shape != SHD_MESH) {
        LANES(i) {
            double x = n[0][i], y = n[1][i], z = n[2][i];
            double wx = k.linear[0][0] * x + k.linear[0][1] * y + k.linear[0][2] * z;
            double wy = k.linear[1][0] * x + k.linear[1][1] * y + k.linear[1][2] * z;
            double wz = k.linear[2][0] * x + k.linear[2][1] * y + k.linear[2][2] * z;
            double away =
                wx * b->direction[0][i] + wy * b->direction[1][i] + wz * b->direction[2][i];
            double sign = away > 0 ? turned : 1;
            n[0][i] = wx * sign;
            n[1][i] = wy * sign;
            n[2][i] = wz * sign;
        }
        return;
    }
    LANES(i) {
        double x = n[0][i], y = n[1][i], z = n[2][i];
        double ux = b->direction[0][i], uy = b->direction[1][i], uz = b->direction[2][i];
        double wx = k.linear[0][0] * x + k.linear[0][1] * y + k.linear[0][2] * z;
        double wy = k.linear[1][0] * x + k.linear[1][1] * y + k.linear[1][2] * z;
        double wz = k.linear[2][0] * x + k.linear[2][1] * y + k.linear[2][2] * z;
        /* Scaled by the largest component first: thin objects have tiny normals. */
        double ax = fabs(wx), ay = fabs(wy), az = fabs(wz);
        double most = ax > ay ? ax : ay;
        most = most > az ? most : az;
        wx /= most;
        wy /= most;
        wz /= most;
        double square = wx * wx + wy * wy + wz * wz, scale = shd_inverse_root(square);
        /* A sliver without a normal (0/0) is shaded somehow: as if it faced the viewer. */
        wx = square > 0 ? wx * scale : -ux;
        wy = square > 0 ? wy * scale : -uy;
        wz = square > 0 ? wz * scale : -uz;
        double sign = wx * ux + wy * uy + wz * uz > 0 ? turned : 1;
        n[0][i] = wx * sign;
        n[1][i] = wy * sign;
        n[2][i] = wz * sign;
    }
}

static void move_points(const shd_affine *m, const double p[restrict 3][SHD_RAYS],
                        double out[restrict 3][SHD_RAYS]) {
    const shd_affine a = *m;
    LANES(i) {
        double x = p[0][i], y = p[1][i], z = p[2][i];
        out[0][i] = a.linear[0][0] * x + a.linear[0][1] * y + a.linear[0][2] * z + a.origin.x;
        out[1][i] = a.linear[1][0] * x + a.linear[1][1] * y + a.linear[1][2] * z + a.origin.y;
        out[2][i] = a.linear[2][0] * x + a.linear[2][1] * y + a.linear[2][2] * z + a.origin.z;
    }
}

/* Beyond f32's range is its end: far out on a plane. */
static void narrow(const double *restrict x, float *restrict out) {
    LANES(i) {
        double low = x[i] > -FLT_MAX ? x[i] : -FLT_MAX;
        out[i] = (float)(low < FLT_MAX ? low : FLT_MAX);
    }
}

/* The sum of two floats, as shd_split32 of shade/math32.h. */
static void split(const double *restrict x, float *restrict high, float *restrict low) {
    LANES(i) {
        double least = x[i] > -1e30 ? x[i] : -1e30, held = least < 1e30 ? least : 1e30;
        double t = held * 536870913.0; /* 2^29 + 1 */
        double h = t - (t - held);     /* rounded to 24 bits */
        high[i] = (float)h;
        low[i] = (float)(held - h);
    }
}

static void narrow_directions(const batch *restrict b, const double n[restrict 3][SHD_RAYS],
                              float normal[restrict 3][SHD_RAYS],
                              float mirror[restrict 3][SHD_RAYS]) {
    LANES(i) {
        double x = n[0][i], y = n[1][i], z = n[2][i];
        double ux = b->direction[0][i], uy = b->direction[1][i], uz = b->direction[2][i];
        double twice = -2 * (x * ux + y * uy + z * uz); /* 2 N.V */
        normal[0][i] = (float)x;
        normal[1][i] = (float)y;
        normal[2][i] = (float)z;
        mirror[0][i] = (float)(twice * x + ux);
        mirror[1][i] = (float)(twice * y + uy);
        mirror[2][i] = (float)(twice * z + uz);
    }
}

/* What is seen of an object, in every lane, from its points and outward normals. Both are used
 * up. */
static void show(const shd_item *it, const batch *b, shd_wants wants, shd_surfaces *s,
                 shd_stage *out) {
    turn_normals(it, b, s->normal);
    if (wants.world) {
        SHD_ALIGNED double world[3][SHD_RAYS];
        move_points(&it->to_world, s->point, world);
        for (int c = 0; c < 3; c++) narrow(world[c], out->world32[c]);
    }
    if (wants.fast) {
        move_points(&it->to_frame, s->point, out->position);
        for (int c = 0; c < 3; c++) {
            if (wants.low)
                split(out->position[c], out->position32[c], out->low32[c]);
            else
                narrow(out->position[c], out->position32[c]);
        }
        narrow_directions(b, s->normal, out->normal32, out->mirror32);
        return;
    }
    move_points(&it->to_world, s->point, out->position);
    memcpy(out->normal, s->normal, sizeof out->normal);
}

/* Shows object `object`, whose `work` is made already or must be made again. */
static void show_object(const shd_sight *sight, int object, batch *b, shd_work *work, bool made,
                        shd_wants wants, const shd_stage *hits, shd_stage *out) {
    const shd_item *it = &sight->items[object];
    SHD_ALIGNED double t[SHD_RAYS];
    if (is_quick(it, wants)) {
        show_ball(it, b, t, out);
        return;
    }
    if (it->ball) {
        place_ball(it, b, &b->surfaces);
    } else if (it->shape == SHD_MESH) {
        place_on_mesh(it, object, hits, &b->surfaces);
    } else {
        if (!made) find(it, b, work, t);
        SHD_VARIANT(shd_place_surfaces)(it->shape, it->tube, work, &b->surfaces);
    }
    show(it, b, wants, &b->surfaces, out);
}

/* Takes the lanes of `from` that hit `object`. */
static void take32(const double *restrict object, double wanted, const float *restrict from,
                   float *restrict to) {
    LANES(i) to[i] = object[i] == wanted ? from[i] : to[i];
}

static void take64(const double *restrict object, double wanted, const double *restrict from,
                   double *restrict to) {
    LANES(i) to[i] = object[i] == wanted ? from[i] : to[i];
}

static void take(const shd_stage *from, double object, shd_wants wants, shd_stage *to) {
    for (int c = 0; c < 3; c++) {
        if (wants.world) take32(to->object, object, from->world32[c], to->world32[c]);
        if (wants.fast) {
            take32(to->object, object, from->position32[c], to->position32[c]);
            take32(to->object, object, from->normal32[c], to->normal32[c]);
            take32(to->object, object, from->mirror32[c], to->mirror32[c]);
            if (wants.low) take32(to->object, object, from->low32[c], to->low32[c]);
        } else {
            take64(to->object, object, from->position[c], to->position[c]);
            take64(to->object, object, from->normal[c], to->normal[c]);
        }
    }
}

/* ---- A batch. ---- */

/* At equal distance the object that comes first in the scene stays. Returns whether any lane
 * was nearer. */
static bool keep_nearer(const double *restrict t, double object, shd_stage *restrict best) {
    long long any = 0;
    LANES(i) {
        bool nearer = t[i] < best->t[i], first = t[i] == best->t[i] && object < best->object[i];
        bool kept = nearer || first;
        any |= kept ? 1 : 0;
        best->t[i] = kept ? t[i] : best->t[i];
        best->object[i] = kept ? object : best->object[i];
    }
    return any;
}

/* t of all lanes at least; times are positive, so that their bits are in their order. */
static double farthest(const double *restrict t) {
    int64_t most = 0;
    LANES(i) {
        int64_t bits;
        memcpy(&bits, &t[i], sizeof bits);
        most = bits > most ? bits : most;
    }
    double out;
    memcpy(&out, &most, sizeof out);
    return out;
}

/* Fills t and object of `out`. Returns which of the batch's works belongs to the object
 * `*holder`. */
static int find_nearest(const shd_sight *sight, const uint32_t *candidates, size_t count, int used,
                        batch *b, shd_stage *out, int *holder) {
    SHD_ALIGNED double t[SHD_RAYS], u[SHD_RAYS], v[SHD_RAYS], limit = INFINITY;
    uint32_t triangle[SHD_RAYS];
    int held = 0;
    *holder = SHD_NOTHING;
    LANES(i) {
        out->t[i] = INFINITY;
        out->object[i] = SHD_NOTHING;
    }
    for (size_t k = 0; k < count; k++) {
        const shd_item *it = &sight->items[candidates[k]];
        const double object = candidates[k];
        if (it->nearest > limit) continue;
        if (it->shape == SHD_MESH) {
            find_in_mesh(it, b, used, t, triangle, u, v);
            if (!keep_nearer(t, object, out)) continue;
            for (int i = 0; i < used; i++) {
                if (out->object[i] != object) continue;
                out->triangle[i] = triangle[i];
                out->u[i] = u[i];
                out->v[i] = v[i];
            }
        } else {
            find(it, b, &b->work[!held], t);
            if (!keep_nearer(t, object, out)) continue;
            held = !held;
            *holder = (int)candidates[k];
        }
        if (count > 4) limit = farthest(out->t);
    }
    return held;
}

static size_t count_hits(const double *restrict t) {
    long long hits = 0;
    LANES(i) hits += t[i] < INFINITY ? 1 : 0;
    return (size_t)hits;
}

/* Every object that some lane hit, in turn. */
static void show_hits(const shd_sight *sight, batch *b, int held, int holder, size_t hits,
                      shd_wants wants, shd_stage *out) {
    shd_stage part;
    bool shown[SHD_RAYS] = {false};
    for (int i = 0; hits; i++) {
        const double object = out->object[i];
        if (object == SHD_NOTHING || shown[i]) continue;
        size_t mine = 0;
        for (int k = i; k < SHD_RAYS; k++) {
            shown[k] = shown[k] || out->object[k] == object;
            mine += out->object[k] == object;
        }
        const bool made = (int)object == holder, alone = mine == hits && i == 0;
        shd_work *work = &b->work[made ? held : !held];
        show_object(sight, (int)object, b, work, made, wants, out, alone ? out : &part);
        if (!alone) take(&part, object, wants, out);
        hits -= mine;
    }
}

static size_t cast(const shd_sight *sight, const uint32_t *candidates, size_t candidate_count,
                   const shd_shots *shots, size_t first, shd_wants wants, shd_stage *out) {
    const size_t left = shots->count - first;
    const int used = left < SHD_RAYS ? (int)left : SHD_RAYS;
    const shd_item *one = candidate_count == 1 ? &sight->items[candidates[0]] : NULL;
    const bool quick = one && is_quick(one, wants);
    batch b;
    int held = 0, holder = SHD_NOTHING;
    read_shots(sight, shots, first, used, &b);
    make_rays(&sight->lens, &b);
    if (quick) {
        const double object = candidates[0];
        show_ball(one, &b, out->t, out);
        LANES(i) out->object[i] = out->t[i] < INFINITY ? object : SHD_NOTHING;
    } else {
        held = find_nearest(sight, candidates, candidate_count, used, &b, out, &holder);
    }
    for (int i = used; i < SHD_RAYS; i++) out->t[i] = INFINITY, out->object[i] = SHD_NOTHING;
    const size_t hits = count_hits(out->t);
    if (!hits) return 0;
    if (!quick) show_hits(sight, &b, held, holder, hits, wants, out);
    if (!wants.fast)
        for (int c = 0; c < 3; c++) LANES(i) out->view[c][i] = -b.direction[c][i];
    if (wants.depth) {
        const shd_vec3 forward = shd_scale(sight->lens.camera->back, -1);
        LANES(i)
        out->depth[i] = out->t[i] * (b.direction[0][i] * forward.x + b.direction[1][i] * forward.y +
                                     b.direction[2][i] * forward.z);
    }
    return hits;
}

/* ---- Hits, without what hit nothing. ---- */

ALWAYS void put(void *to, const void *from, size_t size, size_t at, const uint8_t *lanes,
                size_t hits) {
    if (hits == SHD_RAYS) {
        memcpy((char *)to + at * size, from, SHD_RAYS * size);
        return;
    }
    if (size == sizeof(uint32_t)) {
        uint32_t *restrict out = (uint32_t *)to + at;
        const uint32_t *restrict in = from;
        for (size_t k = 0; k < hits; k++) out[k] = in[lanes[k]];
    } else {
        uint64_t *restrict out = (uint64_t *)to + at;
        const uint64_t *restrict in = from;
        for (size_t k = 0; k < hits; k++) out[k] = in[lanes[k]];
    }
}

static void append(const shd_stage *s, size_t hits, size_t first, shd_hits *out) {
    const size_t at = out->count;
    uint32_t shot[SHD_RAYS];
    int32_t object[SHD_RAYS];
    uint8_t lanes[SHD_RAYS];
    LANES(i) {
        shot[i] = (uint32_t)first + (uint32_t)i;
        object[i] = (int32_t)s->object[i];
    }
    if (hits < SHD_RAYS) {
        size_t n = 0;
        for (int i = 0; n < hits; i++) {
            lanes[n] = (uint8_t)i; /* stays if it hit: no branch to mispredict */
            n += object[i] != SHD_NOTHING;
        }
    }
    put(out->shot, shot, sizeof *shot, at, lanes, hits);
    put(out->object, object, sizeof *object, at, lanes, hits);
    for (int c = 0; c < 3; c++) {
        if (out->position32[c]) {
            put(out->position32[c], s->position32[c], sizeof(float), at, lanes, hits);
            put(out->normal32[c], s->normal32[c], sizeof(float), at, lanes, hits);
            put(out->mirror32[c], s->mirror32[c], sizeof(float), at, lanes, hits);
        } else {
            put(out->position[c], s->position[c], sizeof(double), at, lanes, hits);
            put(out->normal[c], s->normal[c], sizeof(double), at, lanes, hits);
            put(out->view[c], s->view[c], sizeof(double), at, lanes, hits);
        }
        if (out->low32[c]) put(out->low32[c], s->low32[c], sizeof(float), at, lanes, hits);
        if (out->world32[c]) put(out->world32[c], s->world32[c], sizeof(float), at, lanes, hits);
    }
    if (out->depth) put(out->depth, s->depth, sizeof(double), at, lanes, hits);
    if (out->triangle) {
        put(out->triangle, s->triangle, sizeof(uint32_t), at, lanes, hits);
        put(out->u, s->u, sizeof(double), at, lanes, hits);
        put(out->v, s->v, sizeof(double), at, lanes, hits);
    }
    out->count = at + hits;
}

const shd_cast_kernel SHD_VARIANT(shd_cast_kernel) = {cast, append};
