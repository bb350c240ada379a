/* Rays meet meshes: by the tree, and by the sides on which edges pass the ray (ray.h). */
#include <assert.h>

#include "plan/tier.h"
#include "sight/ray_parts.h"

/* A ray in the tree's frame, seen along its largest component. */
typedef struct sheared {
    double o[3], d[3];
    double from[3];    /* o from the tree's middle, as boxes are */
    double inverse[3]; /* of d, by `invert` */
    int x, y, z;       /* the axes: z is the largest component's */
    double sx, sy, sz; /* of the shear that makes the direction (0, 0, 1) */
    double pad;        /* more than rounding moves corners by */
    double most;       /* the largest component of the direction */
    shd_vec3 carried;  /* as shd_local_ray has it */
    double far;
    uint32_t start;
    bool starts, put;      /* on a triangle; within it, in its own frame */
    shd_vec3 corner, side; /* of the plane that it starts on, toward where it goes */
    double spread;         /* the product of the edges' lengths there */
} sheared;

static void get_three(shd_vec3 v, double out[3]) {
    out[0] = v.x;
    out[1] = v.y;
    out[2] = v.z;
}

/* Where a ray starts on a triangle, before it is moved inside, if `origin` is that place but for
 * rounding: on the corner that is so near; else at the weights that `origin` has of the corners. It
 * matters which of the triangles around a corner a ray is over, and far from the world's origin
 * rounding puts it over others, by much more than it is moved inside. */
static shd_vec3 place_start(const shd_vec3 p[3], shd_vec3 origin, double rounding) {
    const shd_vec3 ab = shd_sub(p[1], p[0]), ac = shd_sub(p[2], p[0]), n = shd_cross(ab, ac),
                   from = shd_sub(origin, p[0]);
    const double area = shd_dot(n, n), one = shd_dot(n, shd_cross(from, ac)) / area,
                 two = shd_dot(n, shd_cross(ab, from)) / area;
    const double a = shd_larger(1 - one - two, 0), b = shd_larger(one, 0), c = shd_larger(two, 0);
    const int near = a >= b && a >= c ? 0 : b >= c ? 1 : 2;
    if (shd_length(shd_sub(p[near], origin)) <= rounding) return p[near];
    return shd_madd(shd_madd(p[0], ab, b / (a + b + c)), ac, c / (a + b + c));
}

/* The origin of a ray that starts on a triangle, put into it, in the tree's frame: rounding in the
 * world may have left the triangle's plane, and passed its edges and corners. Of slivers weights
 * are not known; those stay, and are false. */
static bool put_inside(const shd_item *it, uint32_t triangle, shd_vec3 carried, shd_vec3 *origin) {
    const double scale = it->view.tree->scale;
    shd_vec3 p[3];
    for (int k = 0; k < 3; k++)
        p[k] = shd_scale(shd_triangle_corner(&it->triangles, triangle, k), scale);
    const double size = shd_max_abs(
                     shd_vec3_max(shd_sizes(p[0]), shd_vec3_max(shd_sizes(p[1]), shd_sizes(p[2])))),
                 rounding = 8 * shd_max_abs(carried);
    const shd_vec3 at = place_start(p, *origin, rounding),
                   middle =
                       shd_madd(p[0], shd_add(shd_sub(p[1], p[0]), shd_sub(p[2], p[0])), 1.0 / 3);
    const bool known =
        shd_length(shd_sub(at, *origin)) <= 0x1p-36 * size + rounding; /* not if it is no number */
    const shd_vec3 start = known ? at : *origin, inward = shd_sub(middle, start);
    const double length = shd_length(inward), step = 0x1p-43 * size + 0x1p-40 * length;
    if (length > 0) *origin = shd_madd(start, inward, step < length ? step / length : 1);
    return known;
}

/* Sets the plane of the triangle that the ray starts on. */
static void set_plane(const shd_item *it, sheared *s) {
    const double scale = it->view.tree->scale;
    shd_vec3 p[3];
    for (int k = 0; k < 3; k++)
        p[k] = shd_scale(shd_triangle_corner(&it->triangles, s->start, k), scale);
    const shd_vec3 ab = shd_sub(p[1], p[0]), ac = shd_sub(p[2], p[0]), n = shd_cross(ab, ac);
    const double along = n.x * s->d[0] + n.y * s->d[1] + n.z * s->d[2];
    s->corner = p[0];
    s->side = along < 0 ? shd_scale(n, -1) : n;
    s->spread = shd_length(ab) * shd_length(ac);
}

/* Where a triangle's corners are, from the plane that the ray starts on, by more than rounding. */
typedef enum shd_side {
    SHD_SIDE_NONE, /* none on the side to which the ray goes: it is not met. The next one of a
                      convex edge is not, over which the ray passes by less than rounding. */
    SHD_SIDE_ALL,  /* one or more there, none on the other side: it is met behind the start, however
                      near. The next one of a fold is, on whose edge the ray starts. */
    SHD_SIDE_BOTH
} shd_side;

static shd_side find_side(const shd_item *it, const sheared *s, const shd_leaf *leaf) {
    bool before = false, behind = false;
    if (!(s->spread > 0)) return SHD_SIDE_BOTH;
    for (int k = 0; k < 3; k++) {
        const shd_vec3 v = shd_scale(shd_vec3_at(it->triangles.positions, leaf->corner[k]),
                                     it->view.tree->scale),
                       from = shd_sub(v, s->corner);
        const double up = shd_dot(s->side, from),
                     least = SHD_HIT_ROUNDING * s->spread * shd_length(from);
        before |= up > least;
        behind |= up < -least;
    }
    return !before ? SHD_SIDE_NONE : behind ? SHD_SIDE_BOTH : SHD_SIDE_ALL;
}

/* 1 / d, and finite: by it, boxes that a ray runs along are passed for ever or never. */
static double invert(double d) {
    return fabs(d) < 0x1p-1000 ? copysign(0x1p1000, d) : 1 / d;
}

static sheared shear_ray(const shd_item *it, const shd_local_ray *r) {
    const double scale = it->view.tree->scale;
    const shd_vec3 d = shd_scale(r->direction, scale), carried = shd_scale(r->carried, scale);
    shd_vec3 o = shd_scale(r->origin, scale);
    const bool put = r->starts && put_inside(it, r->start, carried, &o);
    sheared s = {.far = r->far,
                 .start = r->start,
                 .starts = r->starts,
                 .put = put,
                 .most = shd_max_abs(d),
                 .carried = carried,
                 .pad = 0x1p-49 * (1 + shd_max_abs(o))};
    get_three(o, s.o);
    get_three(shd_sub(o, it->view.tree->middle), s.from);
    get_three(d, s.d);
    s.z = fabs(d.x) == s.most ? 0 : fabs(d.y) == s.most ? 1 : 2;
    s.x = (s.z + 1) % 3;
    s.y = (s.z + 2) % 3;
    s.sx = s.d[s.x] / s.d[s.z];
    s.sy = s.d[s.y] / s.d[s.z];
    s.sz = 1 / s.d[s.z];
    for (int k = 0; k < 3; k++) s.inverse[k] = invert(s.d[k]);
    if (s.starts) set_plane(it, &s);
    return s;
}

/* ---- Triangles. ---- */

/* A corner from the ray: beside it, and along it in units of t. */
typedef struct aside {
    double x, y, t;
} aside;

static aside see_corner(const shd_item *it, const sheared *s, uint32_t vertex) {
    const double *p = it->triangles.positions + 3 * (size_t)vertex, scale = it->view.tree->scale;
    const double x = p[s->x] * scale - s->o[s->x], y = p[s->y] * scale - s->o[s->y],
                 z = p[s->z] * scale - s->o[s->z];
    return (aside){x - s->sx * z, y - s->sy * z, z * s->sz};
}

static bool is_aside(double a, double b, double c) {
    return (a > 0 && b > 0 && c > 0) || (a < 0 && b < 0 && c < 0);
}

/* How far rounding may have moved t: as shd_triangle_rounding has it. `own`: of that what the
 * triangle makes, without what carried the origin into the mesh's frame. */
static double rounding_of(const shd_item *it, const sheared *s, uint32_t triangle, double *own) {
    shd_vec3 corner[3];
    double far = 0, edge = 0;
    const double scale = it->view.tree->scale;
    const shd_vec3 o = {s->o[0], s->o[1], s->o[2]}, d = {s->d[0], s->d[1], s->d[2]};
    for (int k = 0; k < 3; k++) {
        corner[k] = shd_sub(shd_scale(shd_triangle_corner(&it->triangles, triangle, k), scale), o);
        far = fmax(far, shd_length(corner[k]));
    }
    for (int k = 0; k < 3; k++)
        edge = fmax(edge, shd_length(shd_sub(corner[(k + 1) % 3], corner[k])));
    const shd_vec3 normal = shd_cross(shd_sub(corner[1], corner[0]), shd_sub(corner[2], corner[0]));
    const double area = shd_length(normal), steep = fabs(shd_dot(normal, d));
    *own = SHD_HIT_ROUNDING * (far * area + edge * edge * edge) / steep;
    return *own + shd_dot(shd_sizes(normal), s->carried) / steep;
}

static bool try_leaf(const shd_item *it, sheared *s, const shd_leaf *leaf, shd_meeting *out) {
    const uint32_t triangle = leaf->name >> 4;
    if (s->starts && triangle == s->start) return false;
    aside p[3];
    for (int k = 0; k < 3; k++) p[k] = see_corner(it, s, leaf->corner[k]);
    const double u = p[1].x * p[2].y - p[1].y * p[2].x, v = p[2].x * p[0].y - p[2].y * p[0].x,
                 w = p[0].x * p[1].y - p[0].y * p[1].x;
    if ((u < 0 || v < 0 || w < 0) && (u > 0 || v > 0 || w > 0)) return false;
    const double sum = u + v + w;
    if (sum == 0 || is_aside(p[0].x, p[1].x, p[2].x) || is_aside(p[0].y, p[1].y, p[2].y))
        return false;
    const double weight[3] = {u / sum, v / sum, w / sum};
    const double t = weight[0] * p[0].t + weight[1] * p[1].t + weight[2] * p[2].t;
    const shd_side side = s->starts && t < s->far ? find_side(it, s, leaf) : SHD_SIDE_BOTH;
    if (!(t < s->far && (t > 0 || side == SHD_SIDE_ALL)) || side == SHD_SIDE_NONE) return false;
    double own;
    const double rounding = rounding_of(it, s, triangle, &own);
    if (!(t < s->far - rounding)) return false;
    if (side != SHD_SIDE_ALL && !(t > (s->put ? own : rounding))) return false;
    double by[3]; /* by the triangle's own order of corners */
    const uint32_t one = leaf->name >> 2 & 3, two = leaf->name & 3, three = 3 - one - two;
    by[0] = weight[one];
    by[1] = weight[two];
    by[2] = weight[three];
    *out = (shd_meeting){
        .t = t > 0 ? t : 0, .rounding = rounding, .triangle = triangle, .u = by[1], .v = by[2]};
    s->far = t;
    return true;
}

/* ---- The tree. ---- */

/* The ray in the coordinates of a box. */
typedef struct turned_ray {
    double o[3], inverse[3], pad;
} turned_ray;

static turned_ray turn_ray(const sheared *s, const shd_turn *turn) {
    turned_ray r = {.pad = 4 * s->pad};
    for (int k = 0; k < 3; k++) {
        r.o[k] = shd_dot(turn->axis[k], (shd_vec3){s->from[0], s->from[1], s->from[2]});
        r.inverse[k] = invert(shd_dot(turn->axis[k], (shd_vec3){s->d[0], s->d[1], s->d[2]}));
    }
    return r;
}

/* Entering behind this is not before `far`. */
static bool is_before(double enter, double far) {
    return enter <= far * (1 + 0x1p-48);
}

/* Whether the ray may meet the box before s->far, and from which t on. */
static bool may_meet(const shd_mesh_tree *tree, const sheared *s, const shd_branch *b,
                     double *enter) {
    turned_ray turned;
    const double *o = s->from, *inverse = s->inverse;
    double low = 0, high = s->far, pad = s->pad;
    if (b->turn) {
        turned = turn_ray(s, &tree->turns[b->turn]);
        o = turned.o;
        inverse = turned.inverse;
        pad = turned.pad;
    }
    for (int k = 0; k < 3; k++) {
        const double one = ((double)b->low[k] - pad - o[k]) * inverse[k],
                     two = ((double)b->high[k] + pad - o[k]) * inverse[k];
        low = shd_larger(shd_smaller(one, two), low);
        high = shd_smaller(shd_larger(one, two), high);
    }
    *enter = low;
    return is_before(low, high);
}

/* A branch that the ray may meet, and from where on. */
typedef struct entry {
    uint32_t branch;
    double enter;
} entry;

bool shd_meet_mesh(const shd_item *it, const shd_local_ray *r, const atomic_bool *cancelled,
                   shd_meeting *out) {
    const shd_mesh_tree *tree = it->view.tree;
    entry waiting[SHD_TREE_DEPTH];
    int waits = 0;
    size_t steps = 0;
    bool met = false;
    entry root = {0, 0};
    sheared s = shear_ray(it, r);
    if (!tree->leaf_count || !may_meet(tree, &s, tree->branches, &root.enter)) return false;
    waiting[waits++] = root;
    while (waits && !(met && r->any)) {
        const entry at = waiting[--waits];
        if (shd_is_cancelled_at(cancelled, ++steps)) return met;
        if (!is_before(at.enter, s.far)) continue;
        const shd_branch *now = &tree->branches[at.branch];
        if (now->count) {
            for (uint32_t i = now->first; i < now->first + now->count; i++)
                met = try_leaf(it, &s, &tree->leaves[i], out) || met;
            continue;
        }
        entry one = {now->first, 0}, other = {now->first + 1, 0};
        const bool first = may_meet(tree, &s, &tree->branches[one.branch], &one.enter),
                   second = may_meet(tree, &s, &tree->branches[other.branch], &other.enter);
        const bool swapped = first && second && other.enter < one.enter;
        assert(waits + 2 <= SHD_TREE_DEPTH);
        if (second && !swapped) waiting[waits++] = other;
        if (first) waiting[waits++] = one;
        if (second && swapped) waiting[waits++] = other;
    }
    return met;
}
