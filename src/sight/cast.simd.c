/* A batch of rays is made, carried into each object's frame and cast there, and the nearest hits
 * are carried back into the world's or the plan's frame. Compiled once an instruction set.
 *
 * At first an object only tells t. When it is known which objects the lanes hit, each of these
 * tells its surface, from the same formulas. */
#include <float.h>

#include "base/simd.h"
#include "sight/rays.h"
#include "sight/tie.h"

/* ---- Other shapes, in their frames. ---- */

/* Carries rays into an item's frame. Unless it is a plane, they are then moved closer. */
static void carry_rays(const shd_item *it, const shd_batch *restrict b, shd_work *restrict w) {
    const shd_affine m = it->from_world;
    const shd_vec3 eye = it->eye, forward = it->forward;
    const double blind = it->blind;
    if (b->orthographic) {
        SHD_EACH_LANE(i) {
            double x = b->start[0][i], y = b->start[1][i], z = b->start[2][i];
            w->ox[i] = m.linear[0][0] * x + m.linear[0][1] * y + m.linear[0][2] * z + eye.x;
            w->oy[i] = m.linear[1][0] * x + m.linear[1][1] * y + m.linear[1][2] * z + eye.y;
            w->oz[i] = m.linear[2][0] * x + m.linear[2][1] * y + m.linear[2][2] * z + eye.z;
            w->dx[i] = forward.x;
            w->dy[i] = forward.y;
            w->dz[i] = forward.z;
            w->near[i] = blind;
            w->shift[i] = 0;
        }
    } else {
        SHD_EACH_LANE(i) {
            double x = b->direction[0][i], y = b->direction[1][i], z = b->direction[2][i];
            w->dx[i] = m.linear[0][0] * x + m.linear[0][1] * y + m.linear[0][2] * z;
            w->dy[i] = m.linear[1][0] * x + m.linear[1][1] * y + m.linear[1][2] * z;
            w->dz[i] = m.linear[2][0] * x + m.linear[2][1] * y + m.linear[2][2] * z;
            w->ox[i] = eye.x;
            w->oy[i] = eye.y;
            w->oz[i] = eye.z;
            w->near[i] = blind;
            w->shift[i] = 0;
        }
    }
    if (it->shape != SHD_PLANE) SHD_EACH_LANE(i) shd_approach(w, i);
}

/* Finds t of an item that is no mesh. `work` keeps what its surface is made from. */
static void find_shape(const shd_item *it, const shd_batch *b, shd_work *work, double *restrict t) {
    if (it->ball) {
        SHD_VARIANT(shd_find_ball)(it, b, t);
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
    SHD_EACH_LANE(i) {
        double x = n[0][i], y = n[1][i], z = n[2][i];
        double ux = b->direction[0][i], uy = b->direction[1][i], uz = b->direction[2][i];
        double wx = k.linear[0][0] * x + k.linear[0][1] * y + k.linear[0][2] * z;
        double wy = k.linear[1][0] * x + k.linear[1][1] * y + k.linear[1][2] * z;
        double wz = k.linear[2][0] * x + k.linear[2][1] * y + k.linear[2][2] * z;
        /* They are scaled by the largest component first, for thin objects have tiny normals. */
        double ax = fabs(wx), ay = fabs(wy), az = fabs(wz);
        double most = ax > ay ? ax : ay;
        most = most > az ? most : az;
        double inverse = 1 / most;
        wx *= inverse;
        wy *= inverse;
        wz *= inverse;
        double square = wx * wx + wy * wy + wz * wz, scale = shd_inverse_root(square);
        /* A sliver without a normal (0/0) is shaded as if it faced the viewer. */
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
    SHD_EACH_LANE(i) {
        double x = p[0][i], y = p[1][i], z = p[2][i];
        out[0][i] = a.linear[0][0] * x + a.linear[0][1] * y + a.linear[0][2] * z + a.origin.x;
        out[1][i] = a.linear[1][0] * x + a.linear[1][1] * y + a.linear[1][2] * z + a.origin.y;
        out[2][i] = a.linear[2][0] * x + a.linear[2][1] * y + a.linear[2][2] * z + a.origin.z;
    }
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

/* Makes what is seen of an object, in every lane, of its points and outward normals, which are used
 * up. */
static void show_surfaces(const shd_item *it, const shd_batch *b, shd_wants wants, shd_surfaces *s,
                          shd_stage *out) {
    turn_normals(it, b, s->normal);
    if (wants.world) {
        SHD_ALIGNED double world[3][SHD_RAYS];
        move_points(&it->to_world, s->point, world);
        for (int c = 0; c < 3; c++) narrow_to_f32(world[c], out->world32[c]);
    }
    if (wants.fast) {
        move_points(&it->to_frame, s->point, out->position);
        for (int c = 0; c < 3; c++) {
            if (wants.low)
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

/* Shows object `object`. Unless it is `made`, its `work` is made again. */
static void show_object(const shd_sight *sight, int object, shd_batch *b, shd_work *work, bool made,
                        shd_wants wants, const shd_stage *hits, shd_stage *out) {
    const shd_item *it = &sight->items[object];
    SHD_ALIGNED double t[SHD_RAYS];
    if (shd_is_quick(it, wants)) {
        SHD_VARIANT(shd_show_ball)(it, b, t, out);
        return;
    }
    if (it->ball) {
        SHD_VARIANT(shd_place_ball)(it, b, &b->surfaces);
    } else if (it->shape == SHD_MESH) {
        SHD_VARIANT(shd_place_mesh)(it, object, hits, &b->surfaces);
    } else {
        if (!made) find_shape(it, b, work, t);
        SHD_VARIANT(shd_place_surfaces)(it->shape, it->tube, work, &b->surfaces);
    }
    show_surfaces(it, b, wants, &b->surfaces, out);
}

/* Takes the lanes of `from` that hit `object`. */
static void take_floats(const double *restrict object, double wanted, const float *restrict from,
                        float *restrict to) {
    SHD_EACH_LANE(i) to[i] = object[i] == wanted ? from[i] : to[i];
}

static void take_doubles(const double *restrict object, double wanted, const double *restrict from,
                         double *restrict to) {
    SHD_EACH_LANE(i) to[i] = object[i] == wanted ? from[i] : to[i];
}

static void take_hits(const shd_stage *from, double object, shd_wants wants, shd_stage *to) {
    for (int c = 0; c < 3; c++) {
        if (wants.world) take_floats(to->object, object, from->world32[c], to->world32[c]);
        if (wants.fast) {
            take_floats(to->object, object, from->position32[c], to->position32[c]);
            take_floats(to->object, object, from->normal32[c], to->normal32[c]);
            take_floats(to->object, object, from->mirror32[c], to->mirror32[c]);
            if (wants.low) take_floats(to->object, object, from->low32[c], to->low32[c]);
        } else {
            take_doubles(to->object, object, from->position[c], to->position[c]);
            take_doubles(to->object, object, from->normal[c], to->normal[c]);
        }
    }
}

/* ---- A batch. ---- */

/* For hits that differ by no more than this, relative, it is asked how far rounding moved them. */
static const double CLOSE = 0x1p-24;

/* Adds how far rounding may have moved t, in the lanes that hit `object`. */
static void add_rounding(const shd_sight *sight, double object, shd_batch *b, const double *t,
                         const double *whose, const uint32_t *triangle, double *margin) {
    const shd_item *it = &sight->items[(int)object];
    shd_surfaces *s = &b->surfaces;
    SHD_ALIGNED double again[SHD_RAYS];
    shd_work work;
    if (it->ball) {
        SHD_VARIANT(shd_place_ball)(it, b, s);
    } else if (it->shape != SHD_MESH) {
        find_shape(it, b, &work, again);
        SHD_VARIANT(shd_place_surfaces)(it->shape, it->tube, &work, s);
    }
    for (int i = 0; i < SHD_RAYS; i++) {
        if (whose[i] != object) continue;
        shd_met met = {.ray = {b->direction[0][i], b->direction[1][i], b->direction[2][i]},
                       .t = t[i]};
        if (b->orthographic) met.start = (shd_vec3){b->start[0][i], b->start[1][i], b->start[2][i]};
        const shd_vec3 point = {s->point[0][i], s->point[1][i], s->point[2][i]},
                       normal = {s->normal[0][i], s->normal[1][i], s->normal[2][i]};
        margin[i] += it->shape == SHD_MESH
                         ? shd_triangle_rounding(it, &sight->lens, &met, triangle[i])
                         : shd_shape_rounding(it, &sight->lens, &met, it->ball ? 0 : work.shift[i],
                                              point, normal);
    }
}

/* Returns how many lanes hit an object, and takes them from `left`. */
static size_t take_lanes(double *restrict left, double object) {
    long long lanes = 0;
    SHD_EACH_LANE(i) {
        const bool same = left[i] == object;
        lanes += same ? 1 : 0;
        left[i] = same ? SHD_NOTHING : left[i];
    }
    return (size_t)lanes;
}

/* Finds how far rounding may have moved two hits, in the lanes in which they are close; it is 0 in
 * the others. `triangle` is of `object`. Returns whether there are such lanes. */
static bool find_margins(const shd_sight *sight, double object, shd_batch *b, const double *t,
                         const uint32_t *triangle, const shd_stage *best, double *margin) {
    SHD_ALIGNED double whose[SHD_RAYS], mine[SHD_RAYS];
    const shd_vd wider = shd_vd_set(1 + CLOSE), missed = shd_vd_set(INFINITY),
                 nothing = shd_vd_set(SHD_NOTHING), name = shd_vd_set(object);
    unsigned any = 0;
    for (int i = 0; i < SHD_RAYS; i += SHD_W / 2) {
        const shd_vd now = shd_vd_load(t + i), before = shd_vd_load(best->t + i);
        const shd_md apart =
                         shd_md_or(shd_vd_gt(now, before * wider), shd_vd_gt(before, now * wider)),
                     close = shd_md_and(shd_vd_gt(missed, now), shd_md_not(apart));
        any |= shd_md_bits(close);
        shd_vd_store(mine + i, shd_vd_select(close, name, nothing));
        shd_vd_store(whose + i, shd_vd_select(close, shd_vd_load(best->object + i), nothing));
        shd_vd_store(margin + i, shd_vd_set(0));
    }
    if (!any) return false;
    add_rounding(sight, object, b, t, mine, triangle, margin);
    for (int i = 0; i < SHD_RAYS; i++) {
        const double other = whose[i];
        if (other == SHD_NOTHING) continue;
        add_rounding(sight, other, b, best->t, whose, best->triangle, margin);
        take_lanes(whose, other);
    }
    return true;
}

/* At equal distance, to within rounding, the object that comes first in the scene stays: or
 * surfaces that lie in each other would be seen in speckles. Returns whether any lane was nearer.
 */
static bool keep_nearer(const shd_sight *sight, double object, shd_batch *b,
                        const double *restrict t, const uint32_t *triangle,
                        shd_stage *restrict best) {
    SHD_ALIGNED double margin[SHD_RAYS];
    const shd_vd mine = shd_vd_set(object);
    unsigned any = 0;
    find_margins(sight, object, b, t, triangle, best, margin);
    for (int i = 0; i < SHD_RAYS; i += SHD_W / 2) {
        const shd_vd now = shd_vd_load(t + i), before = shd_vd_load(best->t + i),
                     whose = shd_vd_load(best->object + i), rounding = shd_vd_load(margin + i);
        const shd_md farther = shd_vd_gt(now, before + rounding),
                     nearer = shd_vd_gt(before, now + rounding),
                     first = shd_md_and(shd_md_not(farther), shd_vd_gt(whose, mine)),
                     kept = shd_md_or(nearer, first);
        any |= shd_md_bits(kept);
        shd_vd_store(best->t + i, shd_vd_select(kept, now, before));
        shd_vd_store(best->object + i, shd_vd_select(kept, mine, whose));
    }
    return any;
}

/* The same if no lane has hit anything before. */
static bool keep_first(double object, const double *restrict t, shd_stage *restrict best) {
    const shd_vd mine = shd_vd_set(object), nothing = shd_vd_set(SHD_NOTHING),
                 missed = shd_vd_set(INFINITY);
    unsigned any = 0;
    for (int i = 0; i < SHD_RAYS; i += SHD_W / 2) {
        const shd_vd now = shd_vd_load(t + i);
        const shd_md met = shd_vd_gt(missed, now);
        any |= shd_md_bits(met);
        shd_vd_store(best->t + i, shd_vd_select(met, now, missed));
        shd_vd_store(best->object + i, shd_vd_select(met, mine, nothing));
    }
    return any;
}

/* The largest t of any lane. They are positive, so that their bits are in their order. */
static double farthest_hit(const double *restrict t) {
    int64_t most = 0;
    SHD_EACH_LANE(i) {
        const int64_t bits = (int64_t)shd_bits64_of(t[i]);
        most = bits > most ? bits : most;
    }
    return shd_double_of((uint64_t)most);
}

/* Objects between looks at the flag that cancels. */
enum { OBJECTS_AT_ONCE = 16 };

/* Fills t and object of `out`. Returns which of the batch's works belongs to the object
 * `*holder`. */
static int find_nearest(const shd_sight *sight, const uint32_t *candidates, size_t count,
                        shd_batch *b, shd_stage *out, int *holder) {
    SHD_ALIGNED double t[SHD_RAYS], limit = INFINITY;
    shd_mesh_hits met;
    int held = 0;
    bool some = false; /* lane hit an object */
    *holder = SHD_NOTHING;
    SHD_EACH_LANE(i) {
        out->t[i] = INFINITY;
        out->object[i] = SHD_NOTHING;
    }
    for (size_t k = 0; k < count; k++) {
        if (k % OBJECTS_AT_ONCE == OBJECTS_AT_ONCE - 1 && shd_is_cancelled(sight->cancelled)) break;
        const shd_item *it = &sight->items[candidates[k]];
        const double object = candidates[k];
        if (it->nearest > limit) continue;
        if (it->shape == SHD_MESH) {
            if (!SHD_VARIANT(shd_find_mesh)(&sight->lens, it, b, limit, &met) ||
                !(some ? keep_nearer(sight, object, b, met.t, met.triangle, out)
                       : keep_first(object, met.t, out)))
                continue;
            take_doubles(out->object, object, met.u, out->u);
            take_doubles(out->object, object, met.v, out->v);
            SHD_EACH_LANE(i)
            out->triangle[i] = out->object[i] == object ? met.triangle[i] : out->triangle[i];
        } else {
            find_shape(it, b, &b->work[!held], t);
            if (!(some ? keep_nearer(sight, object, b, t, NULL, out) : keep_first(object, t, out)))
                continue;
            held = !held;
            *holder = (int)candidates[k];
        }
        some = true;
        if (count > 4) limit = farthest_hit(out->t) * (1 + 2 * CLOSE);
    }
    return held;
}

static size_t count_hits(const double *restrict t) {
    long long hits = 0;
    SHD_EACH_LANE(i) hits += t[i] < INFINITY ? 1 : 0;
    return (size_t)hits;
}

/* Every object that some lane hit, in turn. */
static void show_hits(const shd_sight *sight, shd_batch *b, int held, int holder, size_t hits,
                      shd_wants wants, shd_stage *out) {
    SHD_ALIGNED double left[SHD_RAYS];
    shd_stage part;
    memcpy(left, out->object, sizeof left);
    for (int i = 0, shown = 0; shown < (int)hits; i++) {
        const double object = left[i];
        if (object == SHD_NOTHING) continue;
        const size_t mine = take_lanes(left, object);
        const bool made = (int)object == holder, alone = mine == hits;
        shd_work *work = &b->work[made ? held : !held];
        if (alone) {
            show_object(sight, (int)object, b, work, made, wants, out, out);
        } else {
            show_object(sight, (int)object, b, work, made, wants, out, &part);
            take_hits(&part, object, wants, out);
        }
        shown += (int)mine;
    }
}

static size_t cast_batch(const shd_sight *sight, const uint32_t *candidates, size_t candidate_count,
                         const shd_shots *shots, size_t first, shd_wants wants, shd_stage *out) {
    const size_t left = shots->count - first;
    const int used = left < SHD_RAYS ? (int)left : SHD_RAYS;
    const shd_item *one = candidate_count == 1 ? &sight->items[candidates[0]] : NULL;
    const bool quick = one && shd_is_quick(one, wants);
    shd_batch b;
    int held = 0, holder = SHD_NOTHING;
    shd_read_shots(sight, shots, first, used, b.x, b.y);
    shd_make_rays(&sight->lens, &b);
    if (quick) {
        const double object = candidates[0];
        SHD_VARIANT(shd_show_ball)(one, &b, out->t, out);
        SHD_EACH_LANE(i) out->object[i] = out->t[i] < INFINITY ? object : SHD_NOTHING;
    } else {
        held = find_nearest(sight, candidates, candidate_count, &b, out, &holder);
    }
    for (int i = used; i < SHD_RAYS; i++) out->t[i] = INFINITY, out->object[i] = SHD_NOTHING;
    const size_t hits = count_hits(out->t);
    if (!hits) return 0;
    if (!quick) show_hits(sight, &b, held, holder, hits, wants, out);
    if (!wants.fast)
        for (int c = 0; c < 3; c++) SHD_EACH_LANE(i) out->view[c][i] = -b.direction[c][i];
    if (wants.depth) {
        const shd_vec3 forward = shd_scale(sight->lens.camera->back, -1);
        SHD_EACH_LANE(i)
        out->depth[i] = out->t[i] * (b.direction[0][i] * forward.x + b.direction[1][i] * forward.y +
                                     b.direction[2][i] * forward.z);
    }
    return hits;
}

const shd_cast_kernel SHD_VARIANT(shd_cast_kernel) = {cast_batch, SHD_VARIANT(shd_append_hits)};
