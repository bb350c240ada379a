/* Meshes, a batch of rays at a time. Compiled once an instruction set.
 *
 * The rays are a bundle within a rectangle of the image plane. Boxes and triangles that no ray of
 * it may meet are left out, with more room than rounding takes.
 *
 * Which triangle a ray meets is then decided in f64, by the sides on which its edges pass the ray
 * (S. Woop, C. Benthin, I. Wald, "Watertight Ray/Triangle Intersection", 2013). No ray slips
 * through between triangles: corners are moved by the same arithmetic in each triangle that has
 * them, so that an edge's two triangles get opposite values. Rounding cannot give a value of the
 * wrong sign, but only 0, which counts for either side. Depths are weighted means of the corners'
 * depths, so that a triangle that is seen from its edge is met no farther than it reaches. */
#include "sight/mesh_thin_simd.h"

/* ---- Triangles. ---- */

/* Tries the rays from `at` on: a vector of them. Returns whether any was met nearer. */
SHD_INLINE bool try_rays(bundle *k, int at, const shd_seen_vertex *a, const shd_seen_vertex *b,
                         const shd_seen_vertex *c, double name) {
    const shd_vd zero = shd_vd_set(0), p = shd_vd_load(k->p + at), q = shd_vd_load(k->q + at);
    const bool flat = k->orthographic;
    const shd_vd aw = shd_vd_set(shd_seen_w(flat, a)), bw = shd_vd_set(shd_seen_w(flat, b)),
                 cw = shd_vd_set(shd_seen_w(flat, c));
    const shd_vd ax = shd_vd_set(a->x) - p * aw, ay = shd_vd_set(a->y) - q * aw,
                 bx = shd_vd_set(b->x) - p * bw, by = shd_vd_set(b->y) - q * bw,
                 cx = shd_vd_set(c->x) - p * cw, cy = shd_vd_set(c->y) - q * cw;
    const shd_vd u = bx * cy - by * cx, v = cx * ay - cy * ax, w = ax * by - ay * bx;
    const shd_md negative = shd_vd_gt(zero, shd_vd_min(shd_vd_min(u, v), w)),
                 positive = shd_vd_gt(shd_vd_max(shd_vd_max(u, v), w), zero);
    if (!(shd_md_bits(negative) ^ shd_md_bits(positive))) return false;

    /* Beside a triangle that is seen from its edge, all three may round to 0 or to one sign. */
    const shd_vd left = shd_vd_min(shd_vd_min(ax, bx), cx),
                 right = shd_vd_max(shd_vd_max(ax, bx), cx),
                 low = shd_vd_min(shd_vd_min(ay, by), cy),
                 high = shd_vd_max(shd_vd_max(ay, by), cy);
    const shd_md beside = shd_md_or(shd_md_or(shd_vd_gt(left, zero), shd_vd_gt(zero, right)),
                                    shd_md_or(shd_vd_gt(low, zero), shd_vd_gt(zero, high)));
    const shd_md one = shd_md_or(negative, positive), both = shd_md_and(negative, positive),
                 met = shd_md_and(one, shd_md_not(shd_md_or(both, beside)));

    const shd_vd inverse = shd_vd_set(1) / (u + v + w);
    const shd_vd second = v * inverse, third = w * inverse;
    const shd_vd depth =
        (u * shd_vd_set(a->depth) + v * shd_vd_set(b->depth) + w * shd_vd_set(c->depth)) * inverse;
    const shd_vd before = shd_vd_load(k->depth + at), names = shd_vd_set(name),
                 known = shd_vd_load(k->name + at);
    /* At the same depth the first triangle stays. */
    const shd_md first = shd_md_and(shd_md_not(shd_vd_gt(depth, before)), shd_vd_gt(known, names)),
                 nearer = shd_md_or(shd_vd_gt(before, depth), first),
                 kept = shd_md_and(shd_md_and(met, nearer),
                                   shd_vd_gt(depth, shd_vd_load(k->near + at)));
    if (!shd_md_any(kept)) return false;
    shd_vd_store(k->depth + at, shd_vd_select(kept, depth, before));
    shd_vd_store(k->name + at, shd_vd_select(kept, names, known));
    shd_vd_store(k->second + at, shd_vd_select(kept, second, shd_vd_load(k->second + at)));
    shd_vd_store(k->third + at, shd_vd_select(kept, third, shd_vd_load(k->third + at)));
    return true;
}

static inline double least_of_three(double a, double b, double c) {
    return shd_smaller(shd_smaller(a, b), c);
}

static inline double most_of_three(double a, double b, double c) {
    return shd_larger(shd_larger(a, b), c);
}

/* The groups that may meet what lies in `there`: bit g is group g. */
SHD_INLINE unsigned groups_in(const bundle *k, area there) {
    const shd_vd left = shd_vd_set(there.left), right = shd_vd_set(there.right),
                 bottom = shd_vd_set(there.bottom), top = shd_vd_set(there.top);
    unsigned out = 0;
    for (int g = 0; g < GROUPS; g += SHD_W / 2) {
        const shd_md aside = shd_md_or(shd_vd_gt(shd_vd_load(k->left + g), right),
                                       shd_vd_gt(left, shd_vd_load(k->right + g))),
                     apart = shd_md_or(shd_vd_gt(shd_vd_load(k->bottom + g), top),
                                       shd_vd_gt(bottom, shd_vd_load(k->top + g)));
        out |= shd_md_bits(shd_md_or(aside, apart)) << g;
    }
    return ~out & ALL_GROUPS;
}

/* On which side of an edge rays pass: fixed + p across + q up. */
typedef struct edge {
    double fixed, across, up;
} edge;

typedef struct edges {
    edge of[3];
    double error; /* more than what try_rays finds differs by */
} edges;

SHD_INLINE edge edge_of(bool flat, const shd_seen_vertex *a, const shd_seen_vertex *b) {
    const double aw = shd_seen_w(flat, a), bw = shd_seen_w(flat, b);
    return (edge){a->x * b->y - a->y * b->x, a->y * bw - aw * b->y, aw * b->x - a->x * bw};
}

SHD_INLINE edges edges_of(const bundle *k, const shd_seen_vertex *a, const shd_seen_vertex *b,
                          const shd_seen_vertex *c) {
    const bool flat = k->orthographic;
    const double p = k->most[0], q = k->most[1], aw = fabs(shd_seen_w(flat, a)),
                 bw = fabs(shd_seen_w(flat, b)), cw = fabs(shd_seen_w(flat, c)),
                 x = most_of_three(fabs(a->x) + p * aw, fabs(b->x) + p * bw, fabs(c->x) + p * cw),
                 y = most_of_three(fabs(a->y) + q * aw, fabs(b->y) + q * bw, fabs(c->y) + q * cw);
    return (edges){{edge_of(flat, b, c), edge_of(flat, c, a), edge_of(flat, a, b)},
                   2 * ROUNDING * x * y};
}

/* The groups of which some ray may pass all edges on the same side. */
static unsigned groups_within(const bundle *k, const edges *three) {
    const shd_vd zero = shd_vd_set(0);
    unsigned out = 0;
    for (int g = 0; g < GROUPS; g += SHD_W / 2) {
        const shd_vd p = shd_vd_load(k->middle[0] + g), q = shd_vd_load(k->middle[1] + g),
                     wide = shd_vd_load(k->half[0] + g), high = shd_vd_load(k->half[1] + g);
        unsigned left = 0, right = 0;
        for (int e = 0; e < 3; e++) {
            const edge *at = &three->of[e];
            const shd_vd middle = shd_vd_set(at->fixed) + p * shd_vd_set(at->across) +
                                  q * shd_vd_set(at->up),
                         reach = wide * shd_vd_set(fabs(at->across)) +
                                 high * shd_vd_set(fabs(at->up)) + shd_vd_set(three->error);
            left |= shd_md_bits(shd_vd_gt(zero, middle + reach));
            right |= shd_md_bits(shd_vd_gt(middle - reach, zero));
        }
        out |= (left & right) << g;
    }
    return ~out;
}

/* Where rays of rows, counted from the first, may pass edges on one side. */
typedef struct span {
    shd_vd low, high;
} span;

/* The rows in which a ray may be in the span: the whole number nearest to its middle is. */
SHD_INLINE unsigned rows_in(span s) {
    /* Whatever is added rounds to whole numbers. */
    const shd_vd whole = shd_vd_set(0x1.8p52), half = shd_vd_set(0.5), room = shd_vd_set(1e-9);
    const shd_vd low = shd_vd_max(s.low, shd_vd_set(0)),
                 high = shd_vd_min(s.high, shd_vd_set(GROUP - 1)), middle = half * (low + high),
                 nearest = (middle + whole) - whole, reach = half * (high - low) + room;
    return ~shd_md_bits(
        shd_md_or(shd_vd_gt(nearest - middle, reach), shd_vd_gt(middle - nearest, reach)));
}

/* Moves the edge with the least slopes to the end. */
static void put_shortest_last(edges *three) {
    double size[3];
    for (int e = 0; e < 3; e++) size[e] = fabs(three->of[e].across) + fabs(three->of[e].up);
    const int least = size[0] < size[1] ? size[0] < size[2] ? 0 : 2 : size[1] < size[2] ? 1 : 2;
    const edge last = three->of[least];
    three->of[least] = three->of[2];
    three->of[2] = last;
}

/* The same where groups are rows: what is thin passes between most of their rays. Along a row, each
 * edge is passed on one side up to some ray, and on the other one from there on. The shortest edge
 * is not asked. */
static unsigned rows_within(const bundle *k, edges *three) {
    const shd_vd none = shd_vd_set(1e9); /* beyond any ray */
    const double error = 3 * three->error;
    unsigned within = 0;
    put_shortest_last(three);
    for (int g = 0; g < GROUPS; g += SHD_W / 2) {
        const shd_vd p = shd_vd_load(k->first + g), q = shd_vd_load(k->middle[1] + g);
        span above = {-none, none}, below = {-none, none}; /* with positive values; with negative */
        for (int e = 0; e < 2; e++) {
            const edge *at = &three->of[e];
            const double slope = at->across * k->step, inverse = 1 / slope;
            const shd_vd value =
                shd_vd_set(at->fixed) + p * shd_vd_set(at->across) + q * shd_vd_set(at->up);
            if (!(fabs(inverse) < 1e300)) { /* the edge lies along rows */
                above.low = shd_vd_select(shd_vd_gt(shd_vd_set(-error), value), none, above.low);
                below.low = shd_vd_select(shd_vd_gt(value, shd_vd_set(error)), none, below.low);
                continue;
            }
            const shd_vd at_zero = value * shd_vd_set(-inverse),
                         reach = shd_vd_set(fabs(inverse) * error), from = at_zero - reach,
                         until = at_zero + reach;
            span *rising = slope > 0 ? &above : &below, *falling = slope > 0 ? &below : &above;
            rising->low = shd_vd_max(from, rising->low);
            falling->high = shd_vd_min(until, falling->high);
        }
        within |= ((rows_in(above) | rows_in(below)) & ((1u << SHD_W / 2) - 1)) << g;
    }
    return within;
}

/* Tries the groups' rays. */
SHD_INLINE bool try_groups(bundle *k, unsigned groups, const shd_seen_vertex *a,
                           const shd_seen_vertex *b, const shd_seen_vertex *c, double name) {
    bool any = false;
    for (; groups; groups &= groups - 1) {
        const int at = __builtin_ctz(groups) * GROUP;
        for (int i = at; i < at + GROUP; i += SHD_W / 2) any = try_rays(k, i, a, b, c, name) || any;
    }
    return any;
}

/* Tries the groups of which it cannot be told at once that they do not meet the triangle. */
SHD_INLINE bool try_corners(bundle *k, const shd_leaf *leaf, const shd_seen_vertex *a,
                            const shd_seen_vertex *b, const shd_seen_vertex *c) {
    unsigned groups = ALL_GROUPS;
    if (least_of_three(a->depth, b->depth, c->depth) > k->reach) return false;
    if (k->orthographic || least_of_three(a->depth, b->depth, c->depth) > 0) {
        const double p[3] = {(double)a->p, (double)b->p, (double)c->p},
                     q[3] = {(double)a->q, (double)b->q, (double)c->q};
        const area there = {least_of_three(p[0], p[1], p[2]), most_of_three(p[0], p[1], p[2]),
                            least_of_three(q[0], q[1], q[2]), most_of_three(q[0], q[1], q[2])};
        if (there.left > k->all.right || there.right < k->all.left || there.bottom > k->all.top ||
            there.top < k->all.bottom)
            return false;
        groups &= groups_in(k, there);
    }
    if (groups & (groups - 1)) {
        edges three = edges_of(k, a, b, c);
        groups &= k->rows ? rows_within(k, &three) : groups_within(k, &three);
    }
    return try_groups(k, groups, a, b, c, leaf->name);
}

static bool try_triangle(bundle *k, const shd_mesh_view *view, const shd_leaf *leaf) {
    const uint32_t *corner = leaf->corner;
    const shd_seen_vertex *seen = view->vertices;
    if (seen) return try_corners(k, leaf, &seen[corner[0]], &seen[corner[1]], &seen[corner[2]]);
    const shd_seen_vertex a = shd_see_vertex(view, corner[0]), b = shd_see_vertex(view, corner[1]),
                          c = shd_see_vertex(view, corner[2]);
    return try_corners(k, leaf, &a, &b, &c);
}

/* The same of a branch's triangles, which lie alike. It is apart, or others would take longer. */
__attribute__((noinline)) static bool try_thin(bundle *k, const shd_mesh_view *view,
                                               const shd_branch *b) {
    const shd_seen_vertex *seen = view->vertices;
    bool any = false;
    for (unsigned from = 0; from < b->count; from += LANES) {
        const size_t first = b->first + from;
        const unsigned left = b->count - from;
        uint64_t rows[2];
        unsigned lanes = find_thin_rows(k, view->slivers, first, rows);
        if (left < LANES) lanes &= (1u << left) - 1;
        for (; lanes; lanes &= lanes - 1) {
            const unsigned i = (unsigned)__builtin_ctz(lanes);
            const shd_leaf *leaf = &view->tree->leaves[first + i];
            const shd_seen_vertex *corner[3];
            for (int c = 0; c < 3; c++) corner[c] = &seen[leaf->corner[c]];
            if (least_of_three(corner[0]->depth, corner[1]->depth, corner[2]->depth) > k->reach)
                continue;
            any = try_groups(k, rows_of_lane(rows[i / 8], i % 8), corner[0], corner[1], corner[2],
                             leaf->name) ||
                  any;
        }
    }
    return any;
}

SHD_INLINE bool try_leaves(bundle *k, const shd_mesh_view *view, const shd_branch *b) {
    if (b->turn && k->slim) return try_thin(k, view, b);
    const shd_leaf *leaves = view->tree->leaves + b->first;
    bool any = false;
    /* Has all corners on their way at once, of which a large mesh has few in caches. */
    for (uint32_t i = 0; i < b->count && view->vertices; i++)
        for (int c = 0; c < 3; c++) __builtin_prefetch(&view->vertices[leaves[i].corner[c]].x);
    for (uint32_t i = 0; i < b->count; i++) any = try_triangle(k, view, &leaves[i]) || any;
    return any;
}

/* ---- The tree. ---- */

/* The product of an axis with the functions' gradients: their slopes along it. */
SHD_INLINE shd_vf slopes_along(shd_vec3 axis, shd_vf x, shd_vf y, shd_vf z) {
    return x * shd_vf_set((float)axis.x) + y * shd_vf_set((float)axis.y) +
           z * shd_vf_set((float)axis.z);
}

static shd_vec3 seen_along(const shd_mesh_view *view, shd_vec3 v) {
    return (shd_vec3){shd_dot(view->rows[0], v), shd_dot(view->rows[1], v),
                      shd_dot(view->rows[2], v)};
}

/* Whether the bundle passes beside a turned box of which nothing is nearer than `depth`. With e the
 * box's first axis, c its middle and r a ray through the eye, (e x c) . r is the same for all
 * points of the box that differ along e only. In an orthographic camera it is (e x r) . (o - c),
 * of rays that start at o. */
static bool is_beside(const bundle *k, const shd_mesh_view *view, const shd_branch *b,
                      double depth) {
    const shd_vec3 *axis = view->tree->turns[b->turn].axis, *seen = k->seen;
    const double size = k->size, sizes = k->sizes, error = k->error;
    const bool orthographic = view->orthographic;
    shd_vec3 middle = shd_scale(view->from, -1);
    for (int c = 0; c < 3; c++)
        middle = shd_madd(middle, axis[c], 0.5 * ((double)b->low[c] + (double)b->high[c]));
    const shd_vec3 at = seen_along(view, middle), ray = {0, 0, 1},
                   n = shd_cross(seen[0], orthographic ? ray : at);
    const double p = k->p_middle, q = k->q_middle,
                 spread = fabs(n.x) * k->p_half + fabs(n.y) * k->q_half,
                 reach =
                     fabs(shd_dot(n, seen[1])) * (0.5 * ((double)b->high[1] - (double)b->low[1])) +
                     fabs(shd_dot(n, seen[2])) * (0.5 * ((double)b->high[2] - (double)b->low[2]));
    if (orthographic)
        return fabs(n.x * (p - at.x) + n.y * (q - at.y)) > spread + reach + error * (size + sizes);
    if (!(depth > 1e-6 * sizes)) return false;
    return fabs(n.x * p + n.y * q + n.z) > spread + reach / depth * (1 + 1e-9) + 3 * size * error;
}

/* Sets what is wanted of a turn. Children mostly have their parents'. */
static void turn_functions(bundle *k, const shd_mesh_view *view, uint16_t turn) {
    const shd_vec3 *axis = view->tree->turns[turn].axis;
    double size = 0;
    for (int c = 0; c < 3; c++) {
        for (int s = 0; s < PAIR; s += SHD_W)
            shd_vf_store(k->along[c] + s,
                         slopes_along(axis[c], shd_vf_load(k->slope[0] + s),
                                      shd_vf_load(k->slope[1] + s), shd_vf_load(k->slope[2] + s)));
        k->seen[c] = seen_along(view, axis[c]);
        size = shd_larger(size, shd_max_abs(view->rows[c]));
    }
    k->turn = turn;
    k->size = size;
    k->sizes = size * (3 + 3 * shd_max_abs(view->from));
    k->error = 100 * ROUNDING * k->sizes * (1 + k->most[0] + k->most[1]);
    k->p_middle = 0.5 * (k->all.left + k->all.right);
    k->q_middle = 0.5 * (k->all.bottom + k->all.top);
    k->p_half = 0.5 * (k->all.right - k->all.left);
    k->q_half = 0.5 * (k->all.top - k->all.bottom);
}

/* Lanes from s on of a pair: SIDES of the first, then of the second. */
SHD_INLINE shd_vf pair_lanes(float first, float second, int s) {
#if SHD_W > 8
    (void)s;
    const shd_vf one = shd_vf_set(first), other = shd_vf_set(second);
    return shd_vf_join(shd_vf_half(one, 0), shd_vf_half(other, 0));
#else
    return shd_vf_set(s < SIDES ? first : second);
#endif
}

/* Which of two boxes with the same turn any ray may meet (bits 0 and 1), and from which depths on.
 * What turning rounds is a small part of the functions' margin. */
SHD_INLINE unsigned may_meet_two(bundle *k, const shd_mesh_view *view, const shd_branch *one,
                                 const shd_branch *other, double depth[2]) {
    SHD_ALIGNED float most[PAIR];
    unsigned out = 0, met = 0;
    if (one->turn && one->turn != k->turn) turn_functions(k, view, one->turn);
    const float(*slope)[PAIR] = one->turn ? k->along : k->slope;
    for (int s = 0; s < PAIR; s += SHD_W) {
        shd_vf all = shd_vf_load(k->fixed + s);
        for (int c = 0; c < 3; c++) {
            const shd_vf along = shd_vf_load(slope[c] + s);
            all += shd_vf_max(along * pair_lanes(one->low[c], other->low[c], s),
                              along * pair_lanes(one->high[c], other->high[c], s));
        }
        out |= shd_mf_bits(shd_vf_gt(shd_vf_set(0), all)) << s;
        shd_vf_store(most + s, all);
    }
    for (int i = 0; i < 2; i++) {
        const unsigned sides = (1u << SIDES) - 1 - (1u << DEPTH);
        depth[i] = -(double)most[i * SIDES + DEPTH];
        met |= (unsigned)!(out >> i * SIDES & sides) << i;
    }
    if (one->turn) {
        if (met & 1 && is_beside(k, view, one, depth[0])) met &= ~1u;
        if (met & 2 && is_beside(k, view, other, depth[1])) met &= ~2u;
    }
    return met;
}

/* The same of a pair of any turns. */
SHD_INLINE unsigned may_meet_pair(bundle *k, const shd_mesh_view *view, const shd_branch *pair,
                                  double depth[2]) {
    if (pair[0].turn == pair[1].turn) return may_meet_two(k, view, pair, pair + 1, depth);
    double second[2];
    const unsigned met = may_meet_two(k, view, pair, pair, depth) & 1,
                   other = may_meet_two(k, view, pair + 1, pair + 1, second) & 2;
    depth[1] = second[1];
    return met | other;
}

static void update_reach(bundle *k) {
    shd_vd most = shd_vd_load(k->depth);
    for (int i = SHD_W / 2; i < SHD_RAYS; i += SHD_W / 2)
        most = shd_vd_max(shd_vd_load(k->depth + i), most);
    SHD_ALIGNED double lanes[SHD_W / 2];
    shd_vd_store(lanes, most);
    for (int i = 1; i < SHD_W / 2; i++) lanes[0] = lanes[i] > lanes[0] ? lanes[i] : lanes[0];
    if (lanes[0] + k->slack < k->reach) set_reach(k, lanes[0]);
}

/* Whether any ray met a triangle. */
static bool walk_tree(bundle *k, const shd_mesh_view *view) {
    struct {
        uint32_t branch;
        double depth;
    } waiting[SHD_TREE_DEPTH];
    int waits = 0;
    size_t steps = 0;
    bool met = false;
    const shd_branch *branches = view->tree->branches;
    double depth[2];
    if (!view->tree->leaf_count || !may_meet_two(k, view, branches, branches, depth)) return false;
    for (uint32_t at = 0;;) {
        const shd_branch *now = &branches[at];
        if (shd_is_cancelled_at(view->cancelled, ++steps)) return met;
        if (now->count) {
            const bool any = try_leaves(k, view, now);
            if (any) update_reach(k);
            met = met || any;
        } else {
            const unsigned pair = may_meet_pair(k, view, &branches[now->first], depth);
            const bool first = pair & 1, second = pair & 2,
                       swapped = second && (!first || depth[1] < depth[0]);
            if (first && second) {
                assert(waits < SHD_TREE_DEPTH);
                waiting[waits].branch = now->first + !swapped;
                waiting[waits++].depth = depth[!swapped];
            }
            if (first || second) {
                at = now->first + swapped;
                continue;
            }
        }
        do
            if (!waits--) return met;
        while (waiting[waits].depth > k->reach);
        at = waiting[waits].branch;
    }
}

/* ---- For cast.simd.c. ---- */

static void tell_hits(const bundle *restrict k, double unit, shd_mesh_hits *restrict out) {
    SHD_EACH_LANE(i) {
        const double second = k->second[i], third = k->third[i];
        const double rest = 1 - second - third, first = rest > 0 ? rest : 0;
        const int32_t name = (int32_t)(k->depth[i] < INFINITY ? k->name[i] : 0);
        const int one = name >> 2 & 3, two = name & 3, three = 3 - one - two;
        const double u = two == 1 ? second : third, v = three == 1 ? second : third;
        out->t[i] = k->depth[i] * unit / k->cosine[i];
        out->triangle[i] = (uint32_t)name >> 4;
        out->u[i] = two == 0 ? first : u;
        out->v[i] = three == 0 ? first : v;
    }
}

bool SHD_VARIANT(shd_find_mesh)(const shd_lens *lens, const shd_item *it, const shd_batch *b,
                                double limit, shd_mesh_hits *out) {
    bundle k;
    aim_bundle(lens, it, b, limit, &k);
    if (!walk_tree(&k, &it->view)) return false;
    tell_hits(&k, it->view.unit, out);
    return true;
}

bool SHD_VARIANT(shd_name_triangles)(const shd_lens *lens, const shd_item *it, const shd_batch *b,
                                     double *name) {
    bundle k;
    aim_bundle(lens, it, b, INFINITY, &k);
    if (!walk_tree(&k, &it->view)) return false;
    memcpy(name, k.name, sizeof k.name);
    return true;
}
