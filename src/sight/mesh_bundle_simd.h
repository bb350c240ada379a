/* A batch's rays as a mesh sees them: a bundle within a rectangle of the image plane, and in groups
 * of it. Only for mesh.simd.c. */
#pragma once

#include <assert.h>

#include "sight/batch.h"

enum {
    GROUPS = SHD_SECTORS, /* of rays that are tried together */
    GROUP = SHD_RAYS / GROUPS,
    FRONT = 4, /* functions of a box, after those of the bundle's four sides */
    REACH,
    DEPTH,
    USED,
    SIDES = 8, /* filled up to whole vectors */
    PAIR = 2 * SIDES
};

static_assert(USED <= SIDES && PAIR % SHD_W == 0, "the functions of two boxes fill vectors");
static_assert(GROUP % (SHD_W / 2) == 0, "a group's rays fill vectors");

/* More than rounding changes a sum of products by, relative to the sum of their sizes. */
static const double ROUNDING = 1e-14;

/* A rectangle of the image plane. */
typedef struct area {
    double left, right, bottom, top;
} area;

typedef struct bundle {
    SHD_ALIGNED double p[SHD_RAYS], q[SHD_RAYS]; /* on the image plane */
    double cosine[SHD_RAYS];                     /* between the ray and the camera's axis */
    double near[SHD_RAYS];                       /* only a depth > near counts */
    double depth[SHD_RAYS], name[SHD_RAYS];      /* of the nearest triangle; infinity: none */
    double second[SHD_RAYS], third[SHD_RAYS];    /* the weights of its corners */
    SHD_ALIGNED double left[GROUPS], right[GROUPS], bottom[GROUPS], top[GROUPS];
    SHD_ALIGNED double middle[2][GROUPS], half[2][GROUPS]; /* the same: p, q */
    area all;
    bool rows; /* groups are rows, in each of which p grows by `step` from ray to ray */
    double step;
    SHD_ALIGNED double first[GROUPS]; /* p of their first rays */
    double most[2];                   /* the largest |p| and |q| */
    bool orthographic;
    bool slim; /* groups are rows, and these are set, in units of slivers: */
    float across[GROUPS], up[GROUPS], steps; /* p of first rays, q, and rays in one of these */
    double reach;                            /* nothing farther is wanted */
    double slack;                            /* more than rounding changes depths by */
    /* Linear functions: how far a point is within each side of the bundle, and before the eye and
     * `reach`. A box is left out if one of them, but that of DEPTH, is negative all over it. */
    SHD_ALIGNED float slope[3][PAIR], fixed[PAIR]; /* in f32, with room for that; twice the same */
    SHD_ALIGNED float along[3][PAIR];              /* their slopes along the axes of `turn` */
    double before;    /* what is constant of the function of DEPTH, in f64 */
    shd_vec3 seen[3]; /* these axes from the camera */
    /* For turned boxes, set with them: the size of the view's rows, and of points times it; what
     * rounding makes of products; the rectangle's middle and half of its sides. */
    double size, sizes, error, p_middle, q_middle, p_half, q_half;
    uint16_t turn; /* of the tree's; 0: they are not set */
} bundle;

/* Finds a little more than the extremes of groups: as much as vertices are rounded by in f32. */
SHD_INLINE void bound_groups(const double *restrict at, double *restrict least,
                             double *restrict most) {
    SHD_ALIGNED double low[GROUPS], high[GROUPS];
    shd_bound_sectors(at, low, high);
    for (int g = 0; g < GROUPS; g++) {
        const double more = 0x1p-23 * (fabs(low[g]) + fabs(high[g])) + 1e-44;
        least[g] = low[g] - more;
        most[g] = high[g] + more;
    }
}

static void bound_bundle(bundle *k) {
    bound_groups(k->p, k->left, k->right);
    bound_groups(k->q, k->bottom, k->top);
    area all = {k->left[0], k->right[0], k->bottom[0], k->top[0]};
    for (int g = 1; g < GROUPS; g++) {
        all.left = shd_smaller(k->left[g], all.left);
        all.right = shd_larger(k->right[g], all.right);
        all.bottom = shd_smaller(k->bottom[g], all.bottom);
        all.top = shd_larger(k->top[g], all.top);
    }
    k->all = all;
    k->most[0] = shd_larger(fabs(all.left), fabs(all.right));
    k->most[1] = shd_larger(fabs(all.bottom), fabs(all.top));
    for (int g = 0; g < GROUPS; g++) {
        k->middle[0][g] = 0.5 * (k->left[g] + k->right[g]);
        k->middle[1][g] = 0.5 * (k->bottom[g] + k->top[g]);
        k->half[0][g] = 0.5 * (k->right[g] - k->left[g]);
        k->half[1][g] = 0.5 * (k->top[g] - k->bottom[g]);
    }
}

/* Finds out whether groups are rows. */
static void find_rows(bundle *k) {
    SHD_ALIGNED double place[GROUP];
    shd_vd off = shd_vd_set(0), up = shd_vd_set(0);
    k->step = (k->p[GROUP - 1] - k->p[0]) / (GROUP - 1);
    for (int i = 0; i < GROUP; i++) place[i] = i * k->step;
    for (int g = 0; g < GROUPS; g++) {
        const shd_vd p = shd_vd_set(k->p[g * GROUP]), q = shd_vd_set(k->q[g * GROUP]);
        for (int i = 0; i < GROUP; i += SHD_W / 2) {
            const shd_vd aside = shd_vd_load(k->p + g * GROUP + i) - (p + shd_vd_load(place + i)),
                         above = shd_vd_load(k->q + g * GROUP + i) - q;
            off = shd_vd_max(shd_vd_max(aside, -aside), off);
            up = shd_vd_max(shd_vd_max(above, -above), up);
        }
        k->first[g] = k->p[g * GROUP];
    }
    k->rows = !shd_md_any(shd_md_or(shd_vd_gt(off, shd_vd_set(ROUNDING * k->most[0])),
                                    shd_vd_gt(up, shd_vd_set(ROUNDING * k->most[1]))));
}

/* Places rows among slivers. A step that is no part of the picture worth telling stays out of f32.
 */
static void find_slim(bundle *k, const shd_slivers *s) {
    k->slim = s && k->rows && k->step > 1e-7 * s->most[0] && k->most[0] <= s->most[0] &&
              k->most[1] <= s->most[1];
    if (!k->slim) return;
    k->steps = (float)(s->most[0] / k->step);
    for (int g = 0; g < GROUPS; g++) {
        k->across[g] = (float)(k->first[g] / s->most[0]);
        k->up[g] = (float)(k->middle[1][g] / s->most[1]);
    }
}

/* In f32 all is rounded some 20 times by less than 2^-24 of its size. What is too large to be told
 * leaves out nothing. */
static void set_constant(bundle *k, int at, double fixed) {
    double sizes = fabs(fixed);
    for (int c = 0; c < 3; c++) sizes += 2 * fabs((double)k->slope[c][at]);
    const double more = fixed + 0x1p-19 * sizes + 1e-30;
    k->fixed[at] = k->fixed[at + SIDES] = sizes < 1e30 ? (float)more : INFINITY;
}

static void set_function(bundle *k, int at, shd_vec3 n, double fixed) {
    k->slope[0][at] = k->slope[0][at + SIDES] = (float)n.x;
    k->slope[1][at] = k->slope[1][at + SIDES] = (float)n.y;
    k->slope[2][at] = k->slope[2][at + SIDES] = (float)n.z;
    set_constant(k, at, fixed);
}

/* How far the components of points in boxes, of 1 at most, are from the eye's. */
static shd_vec3 far_of(shd_vec3 eye) {
    return shd_add((shd_vec3){1, 1, 1}, shd_sizes(eye));
}

/* Sets the function of a side: sign * (row - bound * w), and more than rounding changes it by. */
static void set_side(const shd_mesh_view *view, bundle *k, int at, double sign, shd_vec3 row,
                     double bound) {
    const shd_vec3 w = view->orthographic ? (shd_vec3){0, 0, 0} : view->rows[2];
    const shd_vec3 n = shd_scale(shd_madd(row, w, -bound), sign);
    const double fixed = view->orthographic ? -sign * bound : 0;
    const shd_vec3 sizes = shd_madd(shd_sizes(row), shd_sizes(w), fabs(bound));
    const double error = shd_dot(sizes, far_of(view->from)) + fabs(fixed);
    set_function(k, at, n, fixed - shd_dot(n, view->from) + ROUNDING * error);
}

static void set_reach(bundle *k, double reach) {
    k->reach = reach + k->slack;
    set_constant(k, REACH, k->before + k->reach);
}

static void set_box_functions(const shd_mesh_view *view, bundle *k) {
    const shd_vec3 forward = view->rows[2], back = shd_scale(forward, -1), e = view->from;
    k->slack = ROUNDING * shd_dot(shd_sizes(forward), far_of(e));
    set_side(view, k, 0, 1, view->rows[0], k->all.left);
    set_side(view, k, 1, -1, view->rows[0], k->all.right);
    set_side(view, k, 2, 1, view->rows[1], k->all.bottom);
    set_side(view, k, 3, -1, view->rows[1], k->all.top);
    set_function(k, FRONT, forward, k->slack - shd_dot(forward, e));
    k->before = k->slack - shd_dot(back, e);
    set_function(k, DEPTH, back, k->before);
    set_function(k, REACH, back, 0);
    for (int s = USED; s < SIDES; s++) set_function(k, s, (shd_vec3){0, 0, 0}, 0);
}

static void aim_bundle(const shd_lens *lens, const shd_item *it, const shd_batch *restrict b,
                       double limit, bundle *restrict k) {
    const shd_mesh_view *view = &it->view;
    const double middle_x = lens->middle_x, middle_y = lens->middle_y;
    const double unit = 1 / view->unit, blind = it->blind * unit;
    const double across = view->orthographic ? lens->step_x * unit : lens->step_x,
                 up = view->orthographic ? lens->step_y * unit : lens->step_y;
    SHD_EACH_LANE(i) {
        const double cosine = b->cosine[i];
        k->p[i] = (b->x[i] - middle_x) * across;
        k->q[i] = (middle_y - b->y[i]) * up;
        k->cosine[i] = cosine;
        k->near[i] = blind * cosine;
        k->depth[i] = INFINITY;
        k->name[i] = INFINITY;
        k->second[i] = k->third[i] = 0; /* copied with lanes that met nothing, used of none */
    }
    k->turn = 0;
    k->orthographic = view->orthographic;
    bound_bundle(k);
    find_rows(k);
    find_slim(k, view->slivers);
    set_box_functions(view, k);
    set_reach(k, limit * unit);
}
