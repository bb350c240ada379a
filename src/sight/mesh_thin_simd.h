/* Thin triangles against a bundle's rows, a vector of triangles at a time. Only for mesh.simd.c.
 *
 * Needles that lie alike cross every row of a bundle, mostly between its rays. Two of a needle's
 * edges run along it, in opposite directions: along a row, rays pass both on the same side only
 * from where one edge crosses the row to where the other one does. */
#pragma once

#include "sight/mesh_bundle_simd.h"
#include "sight/tree.h"

enum { LANES = SHD_W / 2, ALL_GROUPS = (1 << GROUPS) - 1 };

static_assert(GROUPS == 8 && LANES <= 8, "a row's lanes are a byte, and a lane's rows too");

/* Corners of triangles, and their edges: on which side rays pass is fixed + p across + q up. */
typedef struct thin_corner {
    shd_vd x, y, w;
} thin_corner;

typedef struct thin_edge {
    shd_vd fixed, across, up;
} thin_edge;

SHD_INLINE void load_corners(const shd_mesh_view *view, const shd_leaf *leaves, unsigned count,
                             thin_corner out[3]) {
    SHD_ALIGNED double x[3][LANES], y[3][LANES], w[3][LANES];
    for (unsigned i = 0; i < LANES; i++)
        for (int c = 0; c < 3; c++) {
            const shd_seen_vertex *at =
                &view->vertices[leaves[i < count ? i : count - 1].corner[c]];
            x[c][i] = at->x;
            y[c][i] = at->y;
            w[c][i] = at->w;
        }
    for (int c = 0; c < 3; c++)
        out[c] = (thin_corner){shd_vd_load(x[c]), shd_vd_load(y[c]), shd_vd_load(w[c])};
}

SHD_INLINE thin_edge thin_edge_of(const thin_corner *a, const thin_corner *b) {
    return (thin_edge){a->x * b->y - a->y * b->x, a->y * b->w - a->w * b->y,
                       a->w * b->x - a->x * b->w};
}

SHD_INLINE shd_vd size_of(shd_vd v) {
    return shd_vd_max(v, -v);
}

SHD_INLINE thin_edge choose_edge(shd_md m, const thin_edge *a, const thin_edge *b) {
    return (thin_edge){shd_vd_select(m, a->fixed, b->fixed), shd_vd_select(m, a->across, b->across),
                       shd_vd_select(m, a->up, b->up)};
}

/* Leaves out the edge with the least slopes. Any two would do, but these tell most. */
SHD_INLINE void choose_edges(const thin_corner corner[3], thin_edge out[2]) {
    const thin_edge e[3] = {thin_edge_of(&corner[1], &corner[2]),
                            thin_edge_of(&corner[2], &corner[0]),
                            thin_edge_of(&corner[0], &corner[1])};
    shd_vd size[3];
    for (int k = 0; k < 3; k++) size[k] = size_of(e[k].across) + size_of(e[k].up);
    const shd_md zero = shd_md_and(shd_vd_gt(size[1], size[0]), shd_vd_gt(size[2], size[0])),
                 one = shd_md_and(shd_md_not(zero), shd_vd_gt(size[2], size[1]));
    out[0] = choose_edge(zero, &e[2], &e[0]);
    out[1] = choose_edge(one, &e[2], &e[1]);
}

/* More than what try_rays finds differs by. */
SHD_INLINE shd_vd thin_error(const bundle *k, const thin_corner corner[3]) {
    const shd_vd p = shd_vd_set(k->most[0]), q = shd_vd_set(k->most[1]);
    shd_vd x = shd_vd_set(0), y = x;
    for (int c = 0; c < 3; c++) {
        const shd_vd w = size_of(corner[c].w);
        x = shd_vd_max(size_of(corner[c].x) + p * w, x);
        y = shd_vd_max(size_of(corner[c].y) + q * w, y);
    }
    return shd_vd_set(6 * ROUNDING) * x * y;
}

/* Bit i of byte g becomes bit g of the result. */
static inline unsigned rows_of_lane(uint64_t bits, unsigned lane) {
    return (unsigned)((bits >> lane & 0x0101010101010101u) * 0x0102040810204080u >> 56);
}

/* Finds in which of the bundle's rows rays may meet up to LANES triangles: bit g of rows[i] is row
 * g. All of them, if a triangle's two longest edges do not cross rows in opposite directions. */
static void find_thin_rows(const bundle *k, const shd_mesh_view *view, const shd_leaf *leaves,
                           unsigned count, unsigned rows[LANES]) {
    /* Whatever is added to `whole` rounds to whole numbers. */
    const shd_vd none = shd_vd_set(1e-300), room = shd_vd_set(1e-9), step = shd_vd_set(k->step),
                 whole = shd_vd_set(0x1.8p52), below = shd_vd_set(1e-9 - 0.5),
                 first = shd_vd_set(0), last = shd_vd_set(GROUP - 1);
    thin_corner corner[3];
    thin_edge e[2];
    load_corners(view, leaves, count, corner);
    choose_edges(corner, e);
    const shd_vd one = e[0].across * step, other = e[1].across * step,
                 per_one = shd_vd_set(-1) / one, per_other = shd_vd_set(-1) / other;
    const shd_md crossing = shd_md_or(shd_md_and(shd_vd_gt(one, none), shd_vd_gt(-none, other)),
                                      shd_md_and(shd_vd_gt(other, none), shd_vd_gt(-none, one)));
    const shd_vd reach =
        shd_vd_max(size_of(per_one), size_of(per_other)) * thin_error(k, corner) + room;
    uint64_t outside = 0;
    for (int g = 0; g < GROUPS; g++) {
        const shd_vd p = shd_vd_set(k->first[g]), q = shd_vd_set(k->middle[1][g]);
        const shd_vd a = (e[0].fixed + p * e[0].across + q * e[0].up) * per_one,
                     b = (e[1].fixed + p * e[1].across + q * e[1].up) * per_other;
        const shd_vd low = shd_vd_max(shd_vd_min(a, b) - reach, first),
                     high = shd_vd_min(shd_vd_max(a, b) + reach, last);
        /* The last whole number up to `high`, or the next one if that is as good as there. */
        const shd_vd nearest = (high + below + whole) - whole;
        outside |= (uint64_t)shd_md_bits(shd_md_and(crossing, shd_vd_gt(low, nearest))) << 8 * g;
    }
    for (unsigned i = 0; i < LANES; i++) rows[i] = rows_of_lane(~outside, i);
}
