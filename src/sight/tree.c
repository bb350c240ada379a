/* Trees are split where binned surface areas promise the least work (I. Wald, "On fast
 * construction of SAH-based bounding volume hierarchies", 2007). */
#include "sight/tree.h"

#include <assert.h>
#include <float.h>

#include "sight/parts.h"

enum {
    BINS = 16,
    FEW = 4,       /* as many triangles are not split further */
    FEW_THIN = 16, /* of those in turned boxes, which are met side by side */
    LEAST = 2,     /* triangles on either side of a split: there are fewer branches than leaves */
    LEAN = 6,      /* a triangle is, if half of its box's surface is as often twice its area */
    FEW_LEAN = 16, /* fewer triangles are not turned */
    MOST_TURNS = 4096,
    SAH_DEPTH = 60 /* below this depth, triangles are split in halves, however they lie */
};

typedef struct job {
    uint32_t branch, first, count;
    uint16_t turn; /* of its parts' boxes */
    bool differ;   /* no triangle is repeated */
    int depth;
} job;

/* The flag ends every loop. What the loops return then is not used. */
typedef struct planter {
    const shd_triangles *triangles;
    const atomic_bool *cancelled;
    shd_mesh_tree *tree;
    part *parts;
    uint32_t lean;       /* triangles that boxes are much too large for */
    uint32_t most_turns; /* that there is room for */
} planter;

/* ---- Triangles. ---- */

static shd_vec3 corner_of(const planter *w, uint32_t triangle, int k) {
    const shd_triangles *t = w->triangles;
    return shd_scale(shd_vec3_at(t->positions, t->indices[3 * (size_t)triangle + (size_t)k]),
                     w->tree->scale);
}

static void measure_mesh(planter *w) {
    const shd_triangles *t = w->triangles;
    shd_vec3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < t->vertex_count && !shd_is_cancelled_at(w->cancelled, i); i++) {
        low = shd_vec3_min(shd_vec3_at(t->positions, i), low);
        high = shd_vec3_max(shd_vec3_at(t->positions, i), high);
    }
    const double most = t->vertex_count ? shd_larger(shd_max_abs(low), shd_max_abs(high)) : 0;
    int exponent = 0;
    if (most > 0) (void)frexp(most, &exponent);
    w->tree->exponent = exponent > 1000 ? 1000 : exponent < -1000 ? -1000 : exponent;
    w->tree->scale = ldexp(1, -w->tree->exponent);
    if (t->vertex_count)
        w->tree->middle = shd_madd(shd_scale(shd_scale(low, w->tree->scale), 0.5),
                                   shd_scale(high, w->tree->scale), 0.5);
}

static int compare_corners(const shd_triangles *t, uint32_t a, uint32_t b) {
    const double *p = t->positions + 3 * (size_t)a, *q = t->positions + 3 * (size_t)b;
    for (int c = 0; c < 3; c++)
        if (p[c] != q[c]) return p[c] < q[c] ? -1 : 1;
    return 0;
}

/* Which of the sorted corners the first and the second are: 4 first + second. */
static uint32_t find_order(const shd_triangles *t, uint32_t triangle) {
    const uint32_t *given = t->indices + 3 * (size_t)triangle;
    uint32_t place[3] = {0, 0, 0}; /* how many corners come before this one */
    for (int i = 0; i < 3; i++)
        for (int k = i + 1; k < 3; k++) place[compare_corners(t, given[i], given[k]) > 0 ? i : k]++;
    return 4 * place[0] + place[1];
}

static shd_leaf make_leaf(const shd_triangles *t, const part *p) {
    const uint32_t triangle = triangle_of(p), order = order_of(p), one = order / 4, two = order % 4;
    const uint32_t *given = t->indices + 3 * (size_t)triangle;
    shd_leaf leaf = {.name = 16 * triangle + order};
    leaf.corner[one] = given[0];
    leaf.corner[two] = given[1];
    leaf.corner[3 - one - two] = given[2];
    return leaf;
}

/* Lists the triangles with an area. Returns how many there are. */
static uint32_t list_parts(planter *w) {
    const shd_vec3 middle = w->tree->middle;
    uint32_t count = 0;
    for (uint32_t i = 0; i < w->triangles->triangle_count; i++) {
        if (shd_is_cancelled_at(w->cancelled, i)) break;
        const shd_vec3 a = corner_of(w, i, 0), b = corner_of(w, i, 1), c = corner_of(w, i, 2);
        const shd_vec3 normal = shd_cross(shd_sub(b, a), shd_sub(c, a));
        if (!(shd_max_abs(normal) > 0)) continue;
        const shd_vec3 low = shd_vec3_min(shd_vec3_min(a, b), c),
                       high = shd_vec3_max(shd_vec3_max(a, b), c), size = shd_sub(high, low);
        const double half = size.x * size.y + size.y * size.z + size.z * size.x;
        w->lean += half * half > LEAN * LEAN * shd_dot(normal, normal);
        w->parts[count++] =
            make_part(shd_sub(low, middle), shd_sub(high, middle), i, find_order(w->triangles, i));
    }
    return count;
}

/* ---- Repeated triangles. ---- */

/* Compares the places of triangles' corners. */
static int compare_places(const shd_triangles *t, const part *a, const part *b) {
    const shd_leaf p = make_leaf(t, a), q = make_leaf(t, b);
    for (int c = 0; c < 3; c++) {
        const int order = compare_corners(t, p.corner[c], q.corner[c]);
        if (order) return order;
    }
    return 0;
}

/* The same; of equals, the first in the mesh comes first. */
static int compare_parts(const shd_triangles *t, const part *a, const part *b) {
    const int order = compare_places(t, a, b);
    const uint32_t one = triangle_of(a), other = triangle_of(b);
    return order ? order : one < other ? -1 : one > other;
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

/* ---- Turns. ---- */

/* What triangles lie along: the sum of their longest edges' products, and their normals. */
typedef struct lay {
    double xx, yy, zz, xy, xz, yz;
    shd_vec3 longest, normal;
    double area, boxes; /* twice their areas; half of their boxes' surfaces */
} lay;

static void add_lay(const planter *w, const part *p, lay *to) {
    const uint32_t i = triangle_of(p);
    const shd_vec3 a = corner_of(w, i, 0), b = corner_of(w, i, 1), c = corner_of(w, i, 2);
    const shd_vec3 sides[3] = {shd_sub(b, a), shd_sub(c, b), shd_sub(a, c)};
    const shd_vec3 normal = shd_cross(sides[0], sides[1]);
    shd_vec3 side = sides[0];
    for (int k = 1; k < 3; k++)
        if (shd_dot(sides[k], sides[k]) > shd_dot(side, side)) side = sides[k];
    if (shd_dot(side, side) > shd_dot(to->longest, to->longest)) to->longest = side;
    to->xx += side.x * side.x;
    to->yy += side.y * side.y;
    to->zz += side.z * side.z;
    to->xy += side.x * side.y;
    to->xz += side.x * side.z;
    to->yz += side.y * side.z;
    to->normal = shd_madd(to->normal, normal, shd_dot(normal, to->normal) < 0 ? -1 : 1);
    to->area += shd_length(normal);
    to->boxes += half_area(&(box){p->low, p->high});
}

/* Axes of which the first is what most of the triangles lie along. False: there is none. */
static bool find_turn(const lay *l, shd_turn *out) {
    shd_vec3 along = l->longest, side = l->normal;
    for (int step = 0; step < 8; step++) { /* power iteration */
        if (!shd_normalize(along, &along)) return false;
        along = (shd_vec3){l->xx * along.x + l->xy * along.y + l->xz * along.z,
                           l->xy * along.x + l->yy * along.y + l->yz * along.z,
                           l->xz * along.x + l->yz * along.y + l->zz * along.z};
    }
    if (!shd_normalize(along, &along)) return false;
    if (!shd_normalize(side, &side) || fabs(shd_dot(side, along)) > 0.9)
        side = fabs(along.x) < 0.6 ? (shd_vec3){1, 0, 0} : (shd_vec3){0, 1, 0};
    if (!shd_normalize(shd_madd(side, along, -shd_dot(side, along)), &side)) return false;
    out->axis[0] = along;
    out->axis[1] = side;
    return shd_normalize(shd_cross(along, side), &out->axis[2]);
}

/* Turned, and larger than rounding makes it. */
static part turn_part(const planter *w, const shd_turn *turn, const part *from) {
    const uint32_t triangle = triangle_of(from);
    const shd_vec3 room = {0x1p-48, 0x1p-48, 0x1p-48};
    shd_vec3 at[3];
    for (int k = 0; k < 3; k++) {
        const shd_vec3 corner = shd_sub(corner_of(w, triangle, k), w->tree->middle);
        at[k] = (shd_vec3){shd_dot(turn->axis[0], corner), shd_dot(turn->axis[1], corner),
                           shd_dot(turn->axis[2], corner)};
    }
    return make_part(shd_sub(shd_vec3_min(shd_vec3_min(at[0], at[1]), at[2]), room),
                     shd_add(shd_vec3_max(shd_vec3_max(at[0], at[1]), at[2]), room), triangle,
                     order_of(from));
}

static double turned_areas(const planter *w, const job *j, const shd_turn *turn) {
    double sum = 0;
    for (uint32_t i = j->first; i < j->first + j->count; i++) {
        if (shd_is_cancelled_at(w->cancelled, i)) break;
        const part p = turn_part(w, turn, &w->parts[i]);
        sum += half_area(&(box){p.low, p.high});
    }
    return sum;
}

/* Turns the boxes of a branch's triangles if that makes them much smaller. */
static void turn_parts(planter *w, job *j) {
    shd_mesh_tree *tree = w->tree;
    lay l = {.area = 0};
    shd_turn turn;
    if (j->count < FEW_LEAN || j->depth % 2 || tree->turn_count >= w->most_turns) return;
    for (uint32_t i = j->first; i < j->first + j->count; i++) {
        if (shd_is_cancelled_at(w->cancelled, i)) return;
        add_lay(w, &w->parts[i], &l);
    }
    if (!(l.boxes > LEAN * l.area) || !find_turn(&l, &turn)) return;
    if (!(turned_areas(w, j, &turn) < 0.5 * l.boxes)) return;
    j->turn = (uint16_t)tree->turn_count;
    tree->turns[tree->turn_count++] = turn;
    for (uint32_t i = j->first; i < j->first + j->count; i++) {
        if (shd_is_cancelled_at(w->cancelled, i)) return;
        w->parts[i] = turn_part(w, &turn, &w->parts[i]);
    }
}

/* ---- Splits. ---- */

typedef struct bins {
    box boxes[BINS];
    uint32_t counts[BINS];
} bins;

typedef struct cut {
    float low, steps; /* bin = (twice_middle - low) steps */
    int axis, at;     /* bins below `at` are on the left; 0: no cut is worth it */
} cut;

static inline int bin_of(const cut *c, const part *p) {
    const int bin = (int)((twice_middle(p)[c->axis] - c->low) * c->steps);
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
    float right[BINS], best = INFINITY;
    box side = EMPTY;
    uint32_t on = 0;
    for (int k = BINS - 1; k > 0; k--) {
        if (b->counts[k]) enclose_box(&side, b->boxes[k].low, b->boxes[k].high);
        on += b->counts[k];
        right[k] = on >= LEAST ? half_area(&side) * (float)on : INFINITY;
    }
    side = EMPTY;
    on = 0;
    for (int k = 1; k < BINS; k++) {
        if (b->counts[k - 1]) enclose_box(&side, b->boxes[k - 1].low, b->boxes[k - 1].high);
        on += b->counts[k - 1];
        if (on < LEAST || count - on < LEAST) continue;
        const float cost = half_area(&side) * (float)on + right[k];
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

/* Sorts a branch's parts into two sides. Returns how many are on the left. The count falls if some
 * are repeated. */
static uint32_t split_parts(const planter *w, job *j, const box *middles) {
    part *parts = w->parts + j->first;
    const four extent = middles->high - middles->low;
    cut c = {.axis = 0};
    float most = 0;
    for (int axis = 0; axis < 3; axis++) {
        if (!(extent[axis] > most)) continue;
        most = extent[axis];
        c.axis = axis;
    }
    c.low = middles->low[c.axis];
    c.steps = BINS * (1 - 1e-6f) / most;
    if (!(most > 0)) {
        if (!j->differ) j->count = drop_repeated(w, parts, j->count);
        j->differ = true;
    } else if (c.steps < FLT_MAX && j->depth < SAH_DEPTH) {
        bins b;
        fill_bins(w, parts, j->count, &c, &b);
        choose_cut(&b, j->count, &c);
    }
    return c.at ? part_by(w, &c, parts, j->count) : j->count / 2;
}

/* ---- The tree. ---- */

/* Sets a branch's box. Finds that of twice the middles of its parts. */
static void set_box(const planter *w, const job *j, box *middles) {
    box all = EMPTY;
    *middles = EMPTY;
    for (uint32_t i = j->first; i < j->first + j->count; i++) {
        if (shd_is_cancelled_at(w->cancelled, i)) break;
        const part *p = &w->parts[i];
        const four at = twice_middle(p);
        enclose_box(&all, p->low, p->high);
        enclose_box(middles, at, at);
    }
    shd_branch *branch = &w->tree->branches[j->branch];
    for (int c = 0; c < 3; c++) {
        branch->low[c] = all.low[c];
        branch->high[c] = all.high[c];
    }
    branch->turn = j->turn;
}

static void put_leaves(const planter *w, const job *j) {
    shd_mesh_tree *tree = w->tree;
    shd_branch *branch = &tree->branches[j->branch];
    branch->first = (uint32_t)tree->leaf_count;
    branch->count = (uint16_t)j->count;
    for (uint32_t i = 0; i < j->count; i++)
        tree->leaves[tree->leaf_count++] = make_leaf(w->triangles, &w->parts[j->first + i]);
}

/* Grows the tree depth first. The smaller side is grown at once, so that 64 larger ones may wait.
 * False: it was cancelled. */
static bool grow_tree(planter *w, uint32_t count) {
    job waiting[64], now = {.count = count};
    int waits = 0;
    w->tree->branch_count = 2;
    w->tree->branches[1] = (shd_branch){.count = 0};
    for (;;) {
        box middles;
        if (w->most_turns) turn_parts(w, &now);
        set_box(w, &now, &middles);
        const uint32_t few = now.turn ? FEW_THIN : FEW;
        uint32_t left = 0;
        if (now.count > few) left = split_parts(w, &now, &middles);
        if (shd_is_cancelled(w->cancelled)) return false;
        if (now.count <= few) {
            put_leaves(w, &now);
            if (!waits) return true;
            now = waiting[--waits];
            continue;
        }
        shd_branch *branch = &w->tree->branches[now.branch];
        branch->first = w->tree->branch_count;
        branch->count = 0;
        job one = now, other = now;
        one.branch = branch->first;
        one.count = left;
        one.depth = other.depth = now.depth + 1;
        other.branch = branch->first + 1;
        other.first += left;
        other.count -= left;
        w->tree->branch_count += 2;
        assert(left && other.count && waits < (int)(sizeof waiting / sizeof *waiting));
        waiting[waits++] = one.count < other.count ? other : one;
        now = one.count < other.count ? one : other;
    }
}

/* Turns of which there is room for more than are wanted of most meshes, and the first. */
static size_t turns_of(size_t triangles) {
    const size_t wanted = triangles / FEW_LEAN;
    return 1 + (wanted < MOST_TURNS ? wanted : MOST_TURNS);
}

/* Turns boxes only if many triangles are lean. */
static void allow_turns(planter *w) {
    shd_mesh_tree *tree = w->tree;
    if (w->lean < FEW_LEAN || w->lean < w->triangles->triangle_count / 8) {
        tree->turns = NULL;
        return;
    }
    w->most_turns = (uint32_t)turns_of(w->triangles->triangle_count);
    tree->turn_count = 1;
    tree->turns[0] = (shd_turn){{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

size_t shd_mesh_tree_bytes(size_t triangles) {
    return shd_arena_size(1, sizeof(shd_mesh_tree)) + shd_arena_size(triangles, sizeof(part)) +
           shd_arena_size(triangles + 2, sizeof(shd_branch)) +
           shd_arena_size(triangles, sizeof(shd_leaf)) +
           shd_arena_size(turns_of(triangles), sizeof(shd_turn));
}

/* What the parts take is given back, for what is made of the tree. */
shd_status shd_mesh_tree_new(const shd_triangles *triangles, const atomic_bool *cancelled,
                             shd_arena *arena, const shd_mesh_tree **out, shd_error *error) {
    const size_t count = triangles->triangle_count;
    if (count > SHD_TREE_TRIANGLES)
        return shd_fail(error, SHD_MEMORY, "", "a mesh has more than %d triangles",
                        SHD_TREE_TRIANGLES);
    shd_mesh_tree *tree = shd_arena_zalloc(arena, 1, sizeof *tree);
    if (tree) tree->branches = shd_arena_alloc(arena, count + 2, sizeof *tree->branches);
    if (tree) tree->leaves = shd_arena_alloc(arena, count, sizeof *tree->leaves);
    if (tree) tree->turns = shd_arena_alloc(arena, turns_of(count), sizeof *tree->turns);
    const shd_arena_mark mark = shd_arena_mark_here(arena);
    part *parts = shd_arena_alloc(arena, count, sizeof *parts);
    if (!tree || !parts || !tree->branches || !tree->leaves || !tree->turns)
        return shd_fail(error, SHD_MEMORY, "", "the limit `memory` is reached by a mesh");
    planter w = {triangles, cancelled, tree, parts, 0, 0};
    measure_mesh(&w);
    const uint32_t with_area = list_parts(&w);
    allow_turns(&w);
    if (shd_is_cancelled(cancelled) || (with_area && !grow_tree(&w, with_area)))
        return shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
    assert(tree->branch_count <= count + 2 && tree->leaf_count <= count);
    shd_arena_return(arena, mark);
    *out = tree;
    return SHD_OK;
}
