/* A batch of rays is made, carried into each object's frame and cast there, and the nearest hits
 * are carried back into the world's or the plan's frame. Compiled once an instruction set.
 *
 * At first an object only tells t. When it is known which objects the lanes hit, each of these
 * tells its surface, from the same formulas. */
#include <float.h>

#include "sight/batch.h"

/* What is wanted of a stage. */
typedef struct wants {
    bool fast;  /* position32, normal32, mirror32; else position, normal, view */
    bool low;   /* low32 */
    bool world; /* world32 */
    bool depth;
    bool balls; /* balls' hits may be appended without a stage */
} wants;

/* Whether a ball is quick, because a tier in f32 wants no more of it than it lights. */
static bool shows_balls_quickly(wants want) {
    return want.fast && !want.low && !want.world;
}

static bool is_quick(const shd_seen_object *one, wants want) {
    return one->is_ball && shows_balls_quickly(want);
}

/* ---- Other shapes, in their frames. ---- */

/* Carries rays into an item's frame. Unless it is a plane, they are then moved closer. */
static void carry_rays(const shd_item *it, const shd_batch *restrict b, shd_work *restrict w) {
    const shd_affine m = it->from_world;
    const shd_vec3 eye = it->eye, forward = it->forward;
    const double blind = it->blind;
    if (b->orthographic) {
        SHD_EACH_LANE(i) {
            shd_set_lane(w->origin, i, shd_add(shd_linear(&m, shd_lane(b->start, i)), eye));
            shd_set_lane(w->direction, i, forward);
            w->near[i] = blind;
            w->shift[i] = 0;
        }
    } else {
        SHD_EACH_LANE(i) {
            shd_set_lane(w->origin, i, eye);
            shd_set_lane(w->direction, i, shd_linear(&m, shd_lane(b->direction, i)));
            w->near[i] = blind;
            w->shift[i] = 0;
        }
    }
    if (it->shape != SHD_PLANE) SHD_EACH_LANE(i) shd_approach(w, i);
}

void SHD_VARIANT(shd_find_shape)(const shd_item *it, const shd_batch *b, shd_work *work,
                                 double *restrict t) {
    if (it->ball) {
        SHD_VARIANT(shd_find_ball)(it->ball, b, t);
        return;
    }
    carry_rays(it, b, work);
    SHD_VARIANT(shd_find_surfaces)(it->shape, it->tube, work);
    SHD_EACH_LANE(i) t[i] = work->t[i] + work->shift[i];
}

/* ---- Back into the world. ---- */

/* Makes unit normals in the world, in place, from outward unit normals of the unit form. */
static void turn_normals(const shd_item *it, const shd_batch *restrict b,
                         double n[restrict 3][SHD_RAYS]) {
    const shd_affine k = it->normal_map;
    const double turned = it->front_only || it->smooth ? 1 : -1;
    if (it->similar && it->shape != SHD_MESH) {
        SHD_EACH_LANE(i) {
            const shd_vec3 turn = shd_linear(&k, shd_lane(n, i));
            const double away = shd_dot(turn, shd_lane(b->direction, i));
            shd_set_lane(n, i, shd_scale(turn, away > 0 ? turned : 1));
        }
        return;
    }
    SHD_EACH_LANE(i) {
        const shd_vec3 ray = shd_lane(b->direction, i), turn = shd_linear(&k, shd_lane(n, i));
        /* They are scaled by the largest component first, for thin objects have tiny normals. */
        shd_vec3 unit = shd_scale(turn, 1 / shd_max_abs(turn));
        const double square = shd_dot(unit, unit), scale = shd_inverse_root(square);
        /* A sliver without a normal (0/0) is shaded as if it faced the viewer. */
        unit.x = square > 0 ? unit.x * scale : -ray.x;
        unit.y = square > 0 ? unit.y * scale : -ray.y;
        unit.z = square > 0 ? unit.z * scale : -ray.z;
        shd_set_lane(n, i, shd_scale(unit, shd_dot(unit, ray) > 0 ? turned : 1));
    }
}

static void move_points(const shd_affine *m, const double p[restrict 3][SHD_RAYS],
                        double out[restrict 3][SHD_RAYS]) {
    const shd_affine a = *m;
    SHD_EACH_LANE(i) shd_set_lane(out, i, shd_transform(&a, shd_lane(p, i)));
}

/* Far out on a plane, values beyond f32's range become its end. */
static void narrow_to_f32(const double *restrict x, float *restrict out) {
    SHD_EACH_LANE(i) {
        double low = x[i] > -FLT_MAX ? x[i] : -FLT_MAX;
        out[i] = (float)(low < FLT_MAX ? low : FLT_MAX);
    }
}

/* Splits values into sums of two floats, as shd_split32 of shade/split32.h does. */
static void split_to_f32(const double *restrict x, float *restrict high, float *restrict low) {
    SHD_EACH_LANE(i) {
        double least = x[i] > -1e30 ? x[i] : -1e30, held = least < 1e30 ? least : 1e30;
        double t = held * 536870913.0; /* 2^29 + 1 */
        double h = t - (t - held);     /* rounded to 24 bits */
        high[i] = (float)h;
        low[i] = (float)(held - h);
    }
}

static void narrow_directions(const shd_batch *restrict b, const double n[restrict 3][SHD_RAYS],
                              float normal[restrict 3][SHD_RAYS],
                              float mirror[restrict 3][SHD_RAYS]) {
    SHD_EACH_LANE(i) {
        const shd_vec3 unit = shd_lane(n, i), ray = shd_lane(b->direction, i);
        shd_set_lane32(normal, i, unit);
        shd_set_lane32(mirror, i, shd_madd(ray, unit, -2 * shd_dot(unit, ray)));
    }
}

/* Makes what is seen of an object, in every lane, of its points and outward normals, which are used
 * up. */
static void show_surfaces(const shd_item *it, const shd_batch *b, wants want, shd_surfaces *s,
                          shd_stage *out) {
    turn_normals(it, b, s->normal);
    if (want.world) {
        SHD_ALIGNED double world[3][SHD_RAYS];
        move_points(&it->to_world, s->point, world);
        for (int c = 0; c < 3; c++) narrow_to_f32(world[c], out->world32[c]);
    }
    if (want.fast) {
        move_points(&it->to_frame, s->point, out->position);
        for (int c = 0; c < 3; c++) {
            if (want.low)
                split_to_f32(out->position[c], out->position32[c], out->low32[c]);
            else
                narrow_to_f32(out->position[c], out->position32[c]);
        }
        narrow_directions(b, s->normal, out->normal32, out->mirror32);
        return;
    }
    move_points(&it->to_world, s->point, out->position);
    memcpy(out->normal, s->normal, sizeof out->normal);
}

void SHD_VARIANT(shd_place_shape)(const shd_item *it, shd_batch *b, shd_work *work, bool made) {
    SHD_ALIGNED double t[SHD_RAYS];
    if (it->ball) {
        SHD_VARIANT(shd_place_ball)(it->ball, b, &b->surfaces);
        return;
    }
    if (!made) SHD_VARIANT(shd_find_shape)(it, b, work, t);
    SHD_VARIANT(shd_place_surfaces)(it->shape, it->tube, work, &b->surfaces);
}

/* Shows object `object`. Unless it is `made`, its `work` is made again. */
static void show_object(const shd_sight *sight, int object, shd_batch *b, shd_work *work, bool made,
                        wants want, const shd_stage *hits, shd_stage *out) {
    const shd_seen_object *one = &sight->seen[object];
    SHD_ALIGNED double t[SHD_RAYS];
    if (is_quick(one, want)) {
        SHD_VARIANT(shd_show_ball)(&one->ball, b, t, out);
        return;
    }
    shd_item room;
    const shd_item *it = shd_item_of(sight, (size_t)object, &room);
    if (it->shape == SHD_MESH)
        SHD_VARIANT(shd_place_mesh)(it, object, hits, &b->surfaces);
    else
        SHD_VARIANT(shd_place_shape)(it, b, work, made);
    show_surfaces(it, b, want, &b->surfaces, out);
}

static void take_hits(const shd_stage *restrict from, double object, wants want,
                      shd_stage *restrict to) {
    for (int c = 0; c < 3; c++) {
        if (want.world) SHD_TAKE(to, from, world32[c]);
        if (want.low) SHD_TAKE(to, from, low32[c]);
        if (want.fast) {
            SHD_TAKE(to, from, position32[c]);
            SHD_TAKE(to, from, normal32[c]);
            SHD_TAKE(to, from, mirror32[c]);
        } else {
            SHD_TAKE(to, from, position[c]);
            SHD_TAKE(to, from, normal[c]);
        }
    }
}

/* ---- A batch. ---- */

/* Takes what is quick from vectors of 8 lanes. */
static void take_quick(const shd_stage *restrict from, double object, unsigned vectors,
                       shd_stage *restrict to) {
    for (; vectors; vectors &= vectors - 1) {
        const int first = 8 * __builtin_ctz(vectors);
        for (int c = 0; c < 3; c++)
            for (int i = first; i < first + 8; i++) {
                const bool same = to->object[i] == object;
                to->position32[c][i] = same ? from->position32[c][i] : to->position32[c][i];
                to->normal32[c][i] = same ? from->normal32[c][i] : to->normal32[c][i];
                to->mirror32[c][i] = same ? from->mirror32[c][i] : to->mirror32[c][i];
            }
    }
}

/* The vectors of 8 lanes in which an object was hit. */
static unsigned vectors_of(const double *restrict objects, double object) {
    unsigned vectors = 0;
    for (int v = 0; v < SHD_RAYS / 8; v++) {
        int lanes = 0;
        for (int i = 8 * v; i < 8 * v + 8; i++) lanes |= objects[i] == object;
        vectors |= (unsigned)lanes << v;
    }
    return vectors;
}

/* Every object that some lane hit, in turn. */
static void show_hits(const shd_sight *sight, shd_batch *b, int held, int holder, size_t hits,
                      wants want, shd_stage *out) {
    SHD_ALIGNED double left[SHD_RAYS];
    shd_stage part;
    memcpy(left, out->object, sizeof left);
    for (int i = 0, shown = 0; shown < (int)hits; i++) {
        const double object = left[i];
        if (object == SHD_NOTHING) continue;
        const size_t mine = shd_take_lanes(left, object);
        const bool made = (int)object == holder, alone = mine == hits;
        const shd_seen_object *one = &sight->seen[(int)object];
        shown += (int)mine;
        if (!alone && is_quick(one, want)) {
            const unsigned vectors = vectors_of(out->object, object);
            SHD_VARIANT(shd_show_ball_in)(&one->ball, b, vectors, &part);
            take_quick(&part, object, vectors, out);
            continue;
        }
        shd_work *work = &b->work[made ? held : !held];
        show_object(sight, (int)object, b, work, made, want, out, alone ? out : &part);
        if (!alone) take_hits(&part, object, want, out);
    }
}

/* What is seen of all that the lanes hit. */
static void show_lanes(const shd_sight *sight, shd_batch *b, int held, int holder, size_t hits,
                       wants want, shd_stage *out) {
    show_hits(sight, b, held, holder, hits, want, out);
    if (!want.fast)
        for (int c = 0; c < 3; c++) SHD_EACH_LANE(i) out->view[c][i] = -b->direction[c][i];
}

/* Casts shots [first, first + SHD_RAYS), or as many as there are, and appends the hits. False:
 * other objects than the targets may be nearer, and nothing is appended. */
static bool cast_batch(const shd_sight *sight, const shd_targets *targets, const shd_shots *shots,
                       size_t first, wants want, shd_hits *hits) {
    const size_t left = shots->count - first;
    const int used = left < SHD_RAYS ? (int)left : SHD_RAYS;
    const shd_seen_object *one = targets->count == 1 ? &sight->seen[targets->objects[0]] : NULL;
    const bool quick = one && is_quick(one, want);
    shd_batch b;
    shd_stage stage;
    int held = 0, holder = SHD_NOTHING;
    SHD_VARIANT(shd_make_rays)(sight, shots, first, used, &b);
    if (quick) {
        const double object = targets->objects[0];
        SHD_VARIANT(shd_show_ball)(&one->ball, &b, stage.t, &stage);
        SHD_EACH_LANE(i) stage.object[i] = stage.t[i] < INFINITY ? object : SHD_NOTHING;
    } else {
        held = SHD_VARIANT(shd_find_nearest)(sight, targets, &b, &stage, &holder);
        if (targets->beyond < INFINITY && !(SHD_VARIANT(shd_end_of)(&b, &stage) < targets->beyond))
            return false;
    }
    for (int i = used; i < SHD_RAYS; i++) stage.t[i] = INFINITY, stage.object[i] = SHD_NOTHING;
    long long lanes = 0;
    SHD_EACH_LANE(i) lanes += stage.t[i] < INFINITY ? 1 : 0;
    const size_t count = (size_t)lanes;
    if (!count) return true;
    if (want.balls && !quick &&
        SHD_VARIANT(shd_append_balls)(sight, &b, &stage, count, first, hits))
        return true;
    if (!quick) show_lanes(sight, &b, held, holder, count, want, &stage);
    if (want.depth) {
        const shd_vec3 forward = shd_scale(sight->lens.camera->back, -1);
        SHD_EACH_LANE(i) stage.depth[i] = stage.t[i] * shd_dot(shd_lane(b.direction, i), forward);
    }
    SHD_VARIANT(shd_append_hits)(&stage, count, first, hits);
    return true;
}

size_t SHD_VARIANT(shd_shoot)(const shd_sight *sight, const shd_targets *targets,
                              const shd_shots *shots, size_t first, shd_hits *out) {
    wants want = {out->position32[0], out->low32[0], out->world32[0], out->depth, false};
    if (!targets->count) return shots->count;
    want.balls = sight->has_balls && shows_balls_quickly(want) && !want.depth && !out->triangle;
    for (; first < shots->count; first += SHD_RAYS) {
        if (shd_is_cancelled(sight->cancelled)) break;
        if (!cast_batch(sight, targets, shots, first, want, out)) return first;
    }
    return shots->count;
}
