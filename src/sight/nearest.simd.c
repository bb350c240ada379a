/* What each ray of a batch meets first. Compiled once an instruction set.
 *
 * A few objects are each cast at by all lanes. Of many, most are in the way of a few lanes only:
 * each is cast at by those sectors, of 8 lanes each, that pass through the rectangle of
 * pixels in which it may be seen, and have not met something before it in every lane. A lane's
 * result is the same in either way. */
#include "sight/ball_simd.h"
#include "sight/tie.h"

/* For hits that differ by no more than this, relative, it is asked how far rounding moved them. */
static const double CLOSE = 0x1p-24;

/* Adds how far rounding may have moved t, in the lanes that hit `object`. */
static void add_rounding(const shd_sight *sight, double object, shd_batch *b, const double *t,
                         const double *whose, const uint32_t *triangle, double *margin) {
    shd_item room;
    const shd_item *it = shd_item_of(sight, (size_t)object, &room);
    shd_work work;
    if (it->shape != SHD_MESH) SHD_VARIANT(shd_place_shape)(it, b, &work, false);
    for (int i = 0; i < SHD_RAYS; i++) {
        if (whose[i] != object) continue;
        shd_met met = {.ray = shd_lane(b->direction, i), .t = t[i]};
        if (b->orthographic) met.start = shd_lane(b->start, i);
        margin[i] += it->shape == SHD_MESH
                         ? shd_triangle_rounding(it, &sight->lens, &met, triangle[i])
                         : shd_shape_rounding(it, &sight->lens, &met, it->ball ? 0 : work.shift[i],
                                              shd_lane(b->surfaces.point, i),
                                              shd_lane(b->surfaces.normal, i));
    }
}

/* The lanes of a vector in which two hits are close. */
SHD_INLINE shd_md close_in(const double *t, const shd_stage *best, int i) {
    const shd_vd wider = shd_vd_set(1 + CLOSE), now = shd_vd_load(t + i),
                 before = shd_vd_load(best->t + i);
    const shd_md apart = shd_md_or(shd_vd_gt(now, before * wider), shd_vd_gt(before, now * wider));
    return shd_md_and(shd_vd_gt(shd_vd_set(INFINITY), now), shd_md_not(apart));
}

/* Finds how far rounding may have moved two hits, in the lanes in which they are close; it is 0 in
 * the others. `triangle` is of `object`. False: in no lane they are, and nothing is set. */
static bool find_margins(const shd_sight *sight, double object, shd_batch *b, const double *t,
                         const uint32_t *triangle, const shd_stage *best, double *margin) {
    SHD_ALIGNED double whose[SHD_RAYS], mine[SHD_RAYS];
    const shd_vd nothing = shd_vd_set(SHD_NOTHING), name = shd_vd_set(object);
    unsigned any = 0;
    for (int i = 0; i < SHD_RAYS; i += SHD_W / 2) any |= shd_md_bits(close_in(t, best, i));
    if (!any) return false;
    for (int i = 0; i < SHD_RAYS; i += SHD_W / 2) {
        const shd_md close = close_in(t, best, i);
        shd_vd_store(mine + i, shd_vd_select(close, name, nothing));
        shd_vd_store(whose + i, shd_vd_select(close, shd_vd_load(best->object + i), nothing));
        shd_vd_store(margin + i, shd_vd_set(0));
    }
    add_rounding(sight, object, b, t, mine, triangle, margin);
    for (int i = 0; i < SHD_RAYS; i++) {
        const double other = whose[i];
        if (other == SHD_NOTHING) continue;
        add_rounding(sight, other, b, best->t, whose, best->triangle, margin);
        shd_take_lanes(whose, other);
    }
    return true;
}

/* Takes what is nearer in the vector of lanes from i on, where no hits are close. Returns the lanes
 * in which it was. */
SHD_INLINE unsigned keep_vector(shd_vd mine, const double *restrict t, int i,
                                shd_stage *restrict best) {
    const shd_vd now = shd_vd_load(t + i), before = shd_vd_load(best->t + i),
                 whose = shd_vd_load(best->object + i);
    const shd_md nearer = shd_vd_gt(before, now);
    shd_vd_store(best->t + i, shd_vd_select(nearer, now, before));
    shd_vd_store(best->object + i, shd_vd_select(nearer, mine, whose));
    return shd_md_bits(nearer);
}

/* The same of all lanes. Returns whether any was. */
SHD_INLINE bool keep_plain(shd_vd mine, const double *restrict t, shd_stage *restrict best) {
    unsigned any = 0;
    for (int i = 0; i < SHD_RAYS; i += SHD_W / 2) any |= keep_vector(mine, t, i, best);
    return any;
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
    if (!find_margins(sight, object, b, t, triangle, best, margin))
        return keep_plain(mine, t, best);
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

/* The largest depth of lanes. They are positive, so that their bits are in their order. */
SHD_INLINE double farthest_of(const double *restrict t, const double *restrict cosine, int first,
                              int end) {
    int64_t most = 0;
    for (int i = first; i < end; i++) {
        const int64_t bits = (int64_t)shd_bits64_of(t[i] * cosine[i]);
        most = bits > most ? bits : most;
    }
    return shd_double_of((uint64_t)most);
}

double SHD_VARIANT(shd_end_of)(const shd_batch *b, const shd_stage *s) {
    return farthest_of(s->t, b->cosine, 0, SHD_RAYS) * (1 + 2 * CLOSE);
}

/* ---- A few objects. ---- */

/* Objects between looks at the flag that cancels. */
enum { OBJECTS_AT_ONCE = 16 };

static bool is_late(const shd_sight *sight, size_t k) {
    return k % OBJECTS_AT_ONCE == OBJECTS_AT_ONCE - 1 && shd_is_cancelled(sight->cancelled);
}

/* Takes the lanes of the mesh `object` that it was met in nearest. */
static void take_triangles(const shd_mesh_hits *met, double object, shd_stage *out) {
    SHD_TAKE(out, met, u);
    SHD_TAKE(out, met, v);
    SHD_TAKE(out, met, triangle);
}

/* As shd_find_nearest, which has cleared `out`. */
static int find_few(const shd_sight *sight, const shd_targets *targets, shd_batch *b,
                    shd_stage *out, int *holder) {
    SHD_ALIGNED double t[SHD_RAYS];
    shd_mesh_hits met;
    int held = 0;
    bool some = false; /* lane hit an object */
    for (size_t k = 0; k < targets->count; k++) {
        const shd_seen_object *one = &sight->seen[targets->objects[k]];
        const shd_item *it = one->is_ball ? NULL : sight->items[targets->objects[k]];
        const double object = targets->objects[k];
        if (it && it->shape == SHD_MESH) {
            const double limit = some ? SHD_VARIANT(shd_end_of)(b, out) : INFINITY;
            if ((double)one->nearest > limit ||
                !SHD_VARIANT(shd_find_mesh)(&sight->lens, it, b, limit, &met) ||
                !(some ? keep_nearer(sight, object, b, met.t, met.triangle, out)
                       : keep_first(object, met.t, out)))
                continue;
            take_triangles(&met, object, out);
        } else {
            if (!it)
                SHD_VARIANT(shd_find_ball)(&one->ball, b, t);
            else
                SHD_VARIANT(shd_find_shape)(it, b, &b->work[!held], t);
            if (!(some ? keep_nearer(sight, object, b, t, NULL, out) : keep_first(object, t, out)))
                continue;
            held = !held;
            *holder = (int)targets->objects[k];
        }
        some = true;
    }
    return held;
}

/* ---- Many objects. ---- */

/* Rectangles of pixels around the sectors' rays, and the depths from which on nothing is seen there
 * any more, nor equal to what is. */
typedef struct outlook {
    SHD_ALIGNED double left[SHD_SECTORS], right[SHD_SECTORS], top[SHD_SECTORS], bottom[SHD_SECTORS],
        limit[SHD_SECTORS];
    double farthest; /* of the limits */
} outlook;

static void bound_sectors(const shd_batch *b, bool framed, outlook *look) {
    shd_bound_sectors(b->x, look->left, look->right);
    shd_bound_sectors(b->y, look->top, look->bottom);
    for (int v = 0; v < SHD_SECTORS; v++) look->limit[v] = INFINITY;
    for (int v = 0; v < SHD_SECTORS && !framed; v++) {
        look->left[v] = look->top[v] = -INFINITY;
        look->right[v] = look->bottom[v] = INFINITY;
    }
    look->farthest = INFINITY;
}

/* The sectors that may see an object. */
static unsigned sectors_reached(const outlook *look, const shd_seen_object *g) {
    const shd_vd left = shd_vd_set((double)g->frame.left),
                 right = shd_vd_set((double)g->frame.right), top = shd_vd_set((double)g->frame.top),
                 bottom = shd_vd_set((double)g->frame.bottom),
                 nearest = shd_vd_set((double)g->nearest);
    unsigned beside = 0;
    for (int v = 0; v < SHD_SECTORS; v += SHD_W / 2) { /* not-a-number reaches anywhere */
        const shd_md across = shd_md_or(shd_vd_gt(shd_vd_load(look->left + v), right),
                                        shd_vd_gt(left, shd_vd_load(look->right + v))),
                     down = shd_md_or(shd_vd_gt(shd_vd_load(look->top + v), bottom),
                                      shd_vd_gt(top, shd_vd_load(look->bottom + v))),
                     behind = shd_vd_gt(nearest, shd_vd_load(look->limit + v));
        beside |= shd_md_bits(shd_md_or(shd_md_or(across, down), behind)) << v;
    }
    return ~beside & ((1u << SHD_SECTORS) - 1);
}

/* Sets the limits of all sectors: without branches, which would wait for what was met last. */
static void limit_sectors(const shd_batch *b, const shd_stage *best, outlook *look) {
    double farthest = 0;
    for (int v = 0; v < SHD_SECTORS; v++) {
        look->limit[v] = farthest_of(best->t, b->cosine, 8 * v, 8 * v + 8) * (1 + 2 * CLOSE);
        farthest = shd_larger(farthest, look->limit[v]);
    }
    look->farthest = farthest;
}

/* Whether two hits are close in any lane of the sectors. */
static bool are_close(const double *t, const shd_stage *best, unsigned sectors) {
    unsigned any = 0;
    for (; sectors; sectors &= sectors - 1) {
        const int first = 8 * __builtin_ctz(sectors);
        for (int i = first; i < first + 8; i += SHD_W / 2) any |= shd_md_bits(close_in(t, best, i));
    }
    return any;
}

/* Takes what is nearer in the sectors, outside of which `t` is not read. Returns those in which any
 * lane was. */
static unsigned keep_in_sectors(const shd_sight *sight, double object, shd_batch *b,
                                double *restrict t, const uint32_t *triangle, unsigned sectors,
                                shd_stage *restrict best) {
    if (are_close(t, best, sectors)) { /* seldom */
        for (int i = 0; i < SHD_RAYS; i++)
            if (!(sectors >> i / 8 & 1)) t[i] = INFINITY;
        return keep_nearer(sight, object, b, t, triangle, best) ? sectors : 0;
    }
    const shd_vd mine = shd_vd_set(object);
    unsigned kept = 0;
    for (; sectors; sectors &= sectors - 1) {
        const int v = __builtin_ctz(sectors);
        unsigned any = 0;
        for (int i = 8 * v; i < 8 * v + 8; i += SHD_W / 2) any |= keep_vector(mine, t, i, best);
        kept |= (unsigned)(any != 0) << v;
    }
    return kept;
}

/* Casts at a ball and takes what is nearer, sector by sector. Nothing is taken in those in which
 * hits are close, which are returned; t is set there. */
SHD_INLINE unsigned meet_in_sectors(const shd_seen_ball *ball, double object, const shd_batch *b,
                                    unsigned sectors, double *restrict t, shd_stage *restrict best,
                                    bool orthographic, bool far) {
    const shd_seen_ball own = *ball;
    const shd_vd mine = shd_vd_set(object);
    unsigned close = 0;
    for (; sectors; sectors &= sectors - 1) {
        const int v = __builtin_ctz(sectors), first = 8 * v;
        unsigned near = 0;
        for (int i = first; i < first + 8; i++)
            t[i] = shd_meet_lane(&own, b, i, orthographic, far).t * own.size;
        for (int i = first; i < first + 8; i += SHD_W / 2)
            near |= shd_md_bits(close_in(t, best, i));
        if (near)
            close |= 1u << v;
        else
            for (int i = first; i < first + 8; i += SHD_W / 2) (void)keep_vector(mine, t, i, best);
    }
    return close;
}

static void find_ball_in(const shd_sight *sight, uint32_t object, shd_batch *b, unsigned sectors,
                         double *t, shd_stage *out) {
    const shd_seen_ball *ball = &sight->seen[object].ball;
    unsigned close = 0;
    SHD_FOR_BALL(b, ball->far, close = meet_in_sectors, ball, object, b, sectors, t, out);
    if (close) (void)keep_in_sectors(sight, object, b, t, NULL, close, out);
}

/* As shd_find_nearest, which has cleared `out`. */
static int find_many(const shd_sight *sight, const shd_targets *targets, shd_batch *b,
                     shd_stage *out, int *holder) {
    enum { OFTEN = 4 }; /* balls that are cast at before limits are worth their while */
    SHD_ALIGNED double t[SHD_RAYS];
    shd_mesh_hits met;
    outlook look;
    int held = 0, unlimited = 0;
    bound_sectors(b, targets->surveyed, &look);
    for (size_t k = 0; k < targets->count && !is_late(sight, k); k++) {
        const shd_seen_object *one = &sight->seen[targets->objects[k]];
        const shd_item *it = one->is_ball ? NULL : sight->items[targets->objects[k]];
        const double object = targets->objects[k];
        if (unlimited >= (it ? 1 : OFTEN)) {
            limit_sectors(b, out, &look);
            unlimited = 0;
        }
        if (targets->surveyed && (double)one->nearest > look.farthest) break;
        const unsigned sectors = sectors_reached(&look, one);
        if (!sectors) continue;
        if (!it) {
            find_ball_in(sight, targets->objects[k], b, sectors, t, out);
            unlimited++;
        } else if (it->shape != SHD_MESH) {
            SHD_VARIANT(shd_find_shape)(it, b, &b->work[!held], t);
            if (!keep_in_sectors(sight, object, b, t, NULL, sectors, out)) continue;
            unlimited = OFTEN;
            held = !held;
            *holder = (int)targets->objects[k];
        } else if (SHD_VARIANT(shd_find_mesh)(&sight->lens, it, b, look.farthest, &met)) {
            if (!keep_in_sectors(sight, object, b, met.t, met.triangle, sectors, out)) continue;
            unlimited = OFTEN;
            take_triangles(&met, object, out);
        }
    }
    return held;
}

/* Whether targets are many, or too small to be in the way of most lanes, as the first one is. */
static bool are_aside(const shd_sight *sight, const shd_targets *targets) {
    enum { FEW = 12, SOME = 2, LOW = 6 /* pixels */ };
    if (targets->count <= SOME) return false;
    const shd_seen_object *first = &sight->seen[targets->objects[0]];
    return targets->count > FEW ||
           (targets->surveyed && first->is_ball && first->frame.bottom - first->frame.top < LOW);
}

int SHD_VARIANT(shd_find_nearest)(const shd_sight *sight, const shd_targets *targets, shd_batch *b,
                                  shd_stage *out, int *holder) {
    *holder = SHD_NOTHING;
    SHD_VARIANT(shd_set_cosines)(sight, b);
    SHD_EACH_LANE(i) {
        out->t[i] = INFINITY;
        out->object[i] = SHD_NOTHING;
    }
    return are_aside(sight, targets) ? find_many(sight, targets, b, out, holder)
                                     : find_few(sight, targets, b, out, holder);
}
