/* Thin triangles against a bundle's rows, a vector of triangles at a time. Only for mesh.simd.c.
 *
 * Needles that lie alike cross every row of a bundle, mostly between its rays. Two of a needle's
 * edges run along it, in opposite directions: along a row, rays pass both on the same side only
 * from where one edge crosses the row to where the other one does. */
#pragma once

#include "sight/mesh_bundle_simd.h"
#include "sight/tree.h"

enum { LANES = SHD_W, ALL_GROUPS = (1 << GROUPS) - 1 };

static_assert(GROUPS == 8 && LANES <= 16, "a row's lanes are two bytes, and a lane's rows one");

/* Bit i of byte g becomes bit g of the result. */
static inline unsigned rows_of_lane(uint64_t bits, unsigned lane) {
    return (unsigned)((bits >> lane & 0x0101010101010101u) * 0x0102040810204080u >> 56);
}

/* Finds in which of the bundle's rows rays may meet the slivers from `first` on: bit g of the
 * result for lane i, by rows_of_lane, is row g. Returns the lanes of which there are any. */
SHD_INLINE unsigned find_thin_rows(const bundle *k, const shd_slivers *s, size_t first,
                                   uint64_t rows[2]) {
    /* Whatever is added to `whole` rounds to whole numbers. */
    const shd_vf steps = shd_vf_set(k->steps), whole = shd_vf_set(0x1.8p23f),
                 below = shd_vf_set(0x1p-20f - 0.5f), zero = shd_vf_set(0),
                 last = shd_vf_set(GROUP - 1), reach = shd_vf_load(s->error + first) * steps;
    const shd_vf at[2] = {shd_vf_load(s->at[0] + first), shd_vf_load(s->at[1] + first)},
                 slope[2] = {shd_vf_load(s->slope[0] + first), shd_vf_load(s->slope[1] + first)};
    unsigned any = 0;
    rows[0] = rows[1] = 0;
    for (int g = 0; g < GROUPS; g++) {
        const shd_vf p = shd_vf_set(k->across[g]), q = shd_vf_set(k->up[g]);
        const shd_vf a = (at[0] - p + slope[0] * q) * steps, b = (at[1] - p + slope[1] * q) * steps;
        const shd_vf low = shd_vf_max(shd_vf_min(a, b) - reach, zero),
                     high = shd_vf_min(shd_vf_max(a, b) + reach, last);
        /* The last whole number up to `high`, or the next one if that is as good as there. */
        const shd_vf nearest = (high + below + whole) - whole;
        const unsigned in = ~shd_mf_bits(shd_vf_gt(low, nearest)) & ((1u << LANES) - 1);
        rows[0] |= (uint64_t)(in & 255) << 8 * g;
        rows[1] |= (uint64_t)(in >> 8) << 8 * g;
        any |= in;
    }
    return any;
}
