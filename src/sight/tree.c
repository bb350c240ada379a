/* Trees are split where binned surface areas promise the least work (I. Wald, "On fast
 * construction of SAH-based bounding volume hierarchies", 2007). */
#include "sight/tree.h"

#include <assert.h>
#include <float.h>
#include <string.h>

enum {
    BINS = 16,
    FEW = 4,       /* as many triangles are not split further */
    LEAST = 2,     /* triangles on either side of a split: there are fewer branches than leaves */
    SAH_DEPTH = 60 /* below this depth, triangles are split in halves, however they lie */
};

/* A triangle while the tree is made. */
typedef struct part {
    double low[3], high[3];
    uint32_t triangle;
} part;

typedef struct box {
    double low[3], high[3];
} box;

typedef struct job {
    uint32_t branch, first, count;
    int depth;
} job;

/* The flag ends every loop. What the loops return then is not used. */
typedef struct planter {
    const shd_triangles *triangles;
    const atomic_bool *cancelled;
    shd_mesh_tree *tree;
    part *parts;
} planter;

static const box EMPTY = {{INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static inline void enclose_box(box *b, const double low[3], const double high[3]) {
    for (int c = 0; c < 3; c++) {
        b->low[c] = shd_smaller(b->low[c], low[c]);
        b->high[c] = shd_larger(b->high[c], high[c]);
    }
}

static inline double half_area(const box *b) {
    const double x = b->high[0] - b->low[0], y = b->high[1] - b->low[1], z = b->high[2] - b->low[2];
    return x * y + y * z + z * x;
}

static inline double twice_middle(const part *p, int c) {
    return p->low[c] + p->high[c];
}

/* ---- Triangles. ---- */

static shd_vec3 corner_of(const planter *w, uint32_t triangle, int k) {
    return shd_scale(shd_triangle_corner(w->triangles, triangle, k), w->tree->scale);
}

static void measure_mesh(planter *w) {
    const shd_triangles *t = w->triangles;
    double most = 0;
    for (size_t i = 0; i < 3 * t->vertex_count; i++) most = shd_larger(most, fabs(t->positions[i]));
    int exponent = 0;
    if (most > 0) (void)frexp(most, &exponent);
    w->tree->exponent = exponent > 1000 ? 1000 : exponent < -1000 ? -1000 : exponent;
    w->tree->scale = ldexp(1, -w->tree->exponent);
}

/* Lists the triangles with an area. Returns how many there are. */
static uint32_t list_parts(planter *w) {
    uint32_t count = 0;
    for (uint32_t i = 0; i < w->triangles->triangle_count; i++) {
        if (shd_is_cancelled_at(w->cancelled, i)) break;
        const shd_vec3 a = corner_of(w, i, 0), b = corner_of(w, i, 1), c = corner_of(w, i, 2);
        if (!(shd_max_abs(shd_cross(shd_sub(b, a), shd_sub(c, a))) > 0)) continue;
        const shd_vec3 low = shd_vec3_min(shd_vec3_min(a, b), c),
                       high = shd_vec3_max(shd_vec3_max(a, b), c);
        w->parts[count++] = (part){{low.x, low.y, low.z}, {high.x, high.y, high.z}, i};
    }
    return count;
}

static int compare_corners(const shd_triangles *t, uint32_t a, uint32_t b) {
    const double *p = t->positions + 3 * (size_t)a, *q = t->positions + 3 * (size_t)b;
    for (int c = 0; c < 3; c++)
        if (p[c] != q[c]) return p[c] < q[c] ? -1 : 1;
    return 0;
}

static shd_leaf make_leaf(const shd_triangles *t, uint32_t triangle) {
    const uint32_t *given = t->indices + 3 * (size_t)triangle;
    uint32_t place[3] = {0, 0, 0}; /* how many corners come before this one */
    for (int i = 0; i < 3; i++)
        for (int k = i + 1; k < 3; k++) place[compare_corners(t, given[i], given[k]) > 0 ? i : k]++;
    shd_leaf leaf = {.name = 16 * triangle + 4 * place[0] + place[1]};
    for (int i = 0; i < 3; i++) leaf.corner[place[i]] = given[i];
    return leaf;
}

/* ---- Repeated triangles. ---- */

/* Compares the places of triangles' corners. */
static int compare_places(const shd_triangles *t, const part *a, const part *b) {
    const shd_leaf p = make_leaf(t, a->triangle), q = make_leaf(t, b->triangle);
    for (int c = 0; c < 3; c++) {
        const int order = compare_corners(t, p.corner[c], q.corner[c]);
        if (order) return order;
    }
    return 0;
}

/* The same; of equals, the first in the mesh comes first. */
static int compare_parts(const shd_triangles *t, const part *a, const part *b) {
    const int order = compare_places(t, a, b);
    return order ? order : a->triangle < b->triangle ? -1 : a->triangle > b->triangle;
}

static void swap_parts(part *a, part *b) {
    const part before = *a;
    *a = *b;
    *b = before;
}

/* Heapsort (J. W. J. Williams, "Algorithm 232: Heapsort", 1964). It is written here because the
 * library's sorts cannot be cancelled. */
static void sort_parts(const planter *w, part *parts, uint32_t count) {
    const shd_triangles *t = w->triangles;
    uint32_t first = count / 2, end = count; /* [first, end) is a heap, the rest is in order */
    while (end > 1) {
        if (shd_is_cancelled_at(w->cancelled, first + end)) return;
        if (first)
            first--;
        else
            swap_parts(&parts[0], &parts[--end]);
        for (uint32_t at = first, next; (next = 2 * at + 1) < end; at = next) {
            if (next + 1 < end && compare_parts(t, &parts[next], &parts[next + 1]) < 0) next++;
            if (compare_parts(t, &parts[at], &parts[next]) > 0) break;
            swap_parts(&parts[at], &parts[next]);
        }
    }
}

/* Keeps the first of equal triangles. Returns how many are left. */
static uint32_t drop_repeated(const planter *w, part *parts, uint32_t count) {
    sort_parts(w, parts, count);
    uint32_t kept = 1;
    for (uint32_t i = 1; i < count && !shd_is_cancelled_at(w->cancelled, i); i++)
        if (compare_places(w->triangles, &parts[kept - 1], &parts[i])) parts[kept++] = parts[i];
    return kept;
}

/* ---- Splits. ---- */

typedef struct bins {
    box boxes[BINS];
    uint32_t counts[BINS];
} bins;

typedef struct cut {
    double low, steps; /* bin = (twice_middle - low) steps */
    int axis, at;      /* bins below `at` are on the left; 0: no cut is worth it */
} cut;

static inline int bin_of(const cut *c, const part *p) {
    const int bin = (int)((twice_middle(p, c->axis) - c->low) * c->steps);
    return bin < BINS ? bin : BINS - 1;
}

static void fill_bins(const planter *w, const part *parts, uint32_t count, const cut *c,
                      bins *out) {
    for (int k = 0; k < BINS; k++) {
        out->boxes[k] = EMPTY;
        out->counts[k] = 0;
    }
    for (uint32_t i = 0; i < count && !shd_is_cancelled_at(w->cancelled, i); i++) {
        const int k = bin_of(c, &parts[i]);
        enclose_box(&out->boxes[k], parts[i].low, parts[i].high);
        out->counts[k]++;
    }
}

/* The cut between bins with the least sum of areas times triangles. */
static void choose_cut(const bins *b, uint32_t count, cut *c) {
    double right[BINS], best = INFINITY;
    box side = EMPTY;
    uint32_t on = 0;
    for (int k = BINS - 1; k > 0; k--) {
        if (b->counts[k]) enclose_box(&side, b->boxes[k].low, b->boxes[k].high);
        on += b->counts[k];
        right[k] = on >= LEAST ? half_area(&side) * on : INFINITY;
    }
    side = EMPTY;
    on = 0;
    for (int k = 1; k < BINS; k++) {
        if (b->counts[k - 1]) enclose_box(&side, b->boxes[k - 1].low, b->boxes[k - 1].high);
        on += b->counts[k - 1];
        if (on < LEAST || count - on < LEAST) continue;
        const double cost = half_area(&side) * on + right[k];
        if (cost < best) {
            best = cost;
            c->at = k;
        }
    }
}

static uint32_t part_by(const planter *w, const cut *c, part *parts, uint32_t count) {
    uint32_t left = 0, right = count;
    while (left < right && !shd_is_cancelled_at(w->cancelled, count - right + left)) {
        if (bin_of(c, &parts[left]) < c->at)
            left++;
        else
            swap_parts(&parts[left], &parts[--right]);
    }
    return left;
}

/* Sorts parts into two sides. Returns how many are on the left. *count falls if some are repeated.
 */
static uint32_t split_parts(const planter *w, part *parts, uint32_t *count, int depth) {
    box middles = EMPTY;
    for (uint32_t i = 0; i < *count && !shd_is_cancelled_at(w->cancelled, i); i++) {
        const double at[3] = {twice_middle(&parts[i], 0), twice_middle(&parts[i], 1),
                              twice_middle(&parts[i], 2)};
        enclose_box(&middles, at, at);
    }
    cut c = {.axis = 0};
    double most = 0;
    for (int axis = 0; axis < 3; axis++) {
        const double extent = middles.high[axis] - middles.low[axis];
        if (!(extent > most)) continue;
        most = extent;
        c.axis = axis;
    }
    c.low = middles.low[c.axis];
    c.steps = BINS * (1 - 1e-9) / most;
    if (!(most > 0)) {
        *count = drop_repeated(w, parts, *count);
    } else if (c.steps < DBL_MAX && depth < SAH_DEPTH) {
        bins b;
        fill_bins(w, parts, *count, &c, &b);
        choose_cut(&b, *count, &c);
    }
    return c.at ? part_by(w, &c, parts, *count) : *count / 2;
}

/* ---- The tree. ---- */

static void set_box(const planter *w, const job *j) {
    box all = EMPTY;
    for (uint32_t i = j->first; i < j->first + j->count; i++) {
        if (shd_is_cancelled_at(w->cancelled, i)) break;
        enclose_box(&all, w->parts[i].low, w->parts[i].high);
    }
    shd_branch *branch = &w->tree->branches[j->branch];
    memcpy(branch->low, all.low, sizeof all.low);
    memcpy(branch->high, all.high, sizeof all.high);
}

static void put_leaves(const planter *w, const job *j, uint32_t count) {
    shd_mesh_tree *tree = w->tree;
    shd_branch *branch = &tree->branches[j->branch];
    branch->first = (uint32_t)tree->leaf_count;
    branch->count = count;
    for (uint32_t i = 0; i < count; i++)
        tree->leaves[tree->leaf_count++] = make_leaf(w->triangles, w->parts[j->first + i].triangle);
}

/* Grows the tree depth first. The smaller side is grown at once, so that 64 larger ones may wait.
 * False: it was cancelled. */
static bool grow_tree(planter *w, uint32_t count) {
    job waiting[64], now = {0, 0, count, 0};
    int waits = 0;
    w->tree->branch_count = 1;
    for (;;) {
        set_box(w, &now);
        uint32_t left = 0, kept = now.count;
        if (now.count > FEW) left = split_parts(w, w->parts + now.first, &kept, now.depth);
        if (shd_is_cancelled(w->cancelled)) return false;
        if (kept <= FEW) {
            put_leaves(w, &now, kept);
            if (!waits) return true;
            now = waiting[--waits];
            continue;
        }
        shd_branch *branch = &w->tree->branches[now.branch];
        branch->first = w->tree->branch_count;
        branch->count = 0;
        job one = {branch->first, now.first, left, now.depth + 1},
            other = {branch->first + 1, now.first + left, kept - left, now.depth + 1};
        w->tree->branch_count += 2;
        assert(left && left < kept && waits < (int)(sizeof waiting / sizeof *waiting));
        waiting[waits++] = one.count < other.count ? other : one;
        now = one.count < other.count ? one : other;
    }
}

shd_status shd_mesh_tree_new(const shd_triangles *triangles, const atomic_bool *cancelled,
                             shd_arena *arena, const shd_mesh_tree **out, shd_error *error) {
    const size_t count = triangles->triangle_count;
    if (count > SHD_TREE_TRIANGLES)
        return shd_fail(error, SHD_MEMORY, "", "a mesh has more than %d triangles",
                        SHD_TREE_TRIANGLES);
    shd_mesh_tree *tree = shd_arena_zalloc(arena, 1, sizeof *tree);
    part *parts = shd_arena_alloc(arena, count, sizeof *parts);
    if (tree) tree->branches = shd_arena_alloc(arena, count + 1, sizeof *tree->branches);
    if (tree) tree->leaves = shd_arena_alloc(arena, count, sizeof *tree->leaves);
    if (!tree || !parts || !tree->branches || !tree->leaves)
        return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached by a mesh");
    planter w = {triangles, cancelled, tree, parts};
    measure_mesh(&w);
    const uint32_t with_area = list_parts(&w);
    if (shd_is_cancelled(cancelled) || (with_area && !grow_tree(&w, with_area)))
        return shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
    assert(tree->branch_count <= count + 1 && tree->leaf_count <= count);
    *out = tree;
    return SHD_OK;
}
