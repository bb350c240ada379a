#include "render/refine.h"

#include <string.h>

#include "base/simd.h"

SHD_INLINE shd_vf size_of(shd_vf x) {
    return shd_vf_max(x, -x);
}

SHD_INLINE shd_vi load_objects(const int32_t *from) {
    shd_vi v;
    memcpy(&v, from, sizeof v);
    return v;
}

/* Lanes whose eight neighbors see what they see, and that is an object. */
SHD_INLINE shd_mf see_alike(const int32_t *object) {
    static const int around[8] = {-SHD_GRID - 1, -SHD_GRID, -SHD_GRID + 1, -1, 1,
                                  SHD_GRID - 1,  SHD_GRID,  SHD_GRID + 1};
    const shd_vi here = load_objects(object);
    shd_vi differ = shd_vi_set(0);
    for (int k = 0; k < 8; k++) differ |= here ^ load_objects(object + around[k]);
    return shd_mf_and(shd_vu_ge(shd_vu_set(0), (shd_vu)differ),
                      shd_vu_ge(shd_vu_set(INT32_MAX), (shd_vu)here));
}

/* Squared steps from pixel to pixel: half of the sum of both axes' is no less than any
 * direction's. */
SHD_INLINE shd_vf step_of(const float *const values[3], int at) {
    shd_vf sum = shd_vf_set(0);
    for (int c = 0; c < 3; c++) {
        const float *v = values[c] + at;
        const shd_vf across = shd_vf_load(v + 1) - shd_vf_load(v - 1),
                     down = shd_vf_load(v + SHD_GRID) - shd_vf_load(v - SHD_GRID);
        sum += across * across + down * down;
    }
    return sum * shd_vf_set(0.5f);
}

/* The largest second difference of four directions. */
SHD_INLINE shd_vf bend_of(const float *v, shd_vf value) {
    const shd_vf twice = value + value;
    const shd_vf across = shd_vf_load(v - 1) + shd_vf_load(v + 1) - twice,
                 down = shd_vf_load(v - SHD_GRID) + shd_vf_load(v + SHD_GRID) - twice,
                 falling = shd_vf_load(v - SHD_GRID - 1) + shd_vf_load(v + SHD_GRID + 1) - twice,
                 rising = shd_vf_load(v - SHD_GRID + 1) + shd_vf_load(v + SHD_GRID - 1) - twice;
    return shd_vf_max(shd_vf_max(size_of(across), size_of(down)),
                      shd_vf_max(size_of(falling), size_of(rising)));
}

static void judge(const shd_centres *centres, int first, int count, int32_t *settled) {
    const shd_vf reach = shd_vf_set(centres->reach * centres->reach),
                 footprint = shd_vf_set(centres->footprint * centres->footprint),
                 shininess = shd_vf_set(2 * centres->shininess), one = shd_vf_set(1),
                 relative = shd_vf_set(centres->relative);
    for (int i = 0; i < count; i += SHD_W) {
        const int at = first + i;
        shd_mf good = see_alike(centres->object + at);
        if (shd_mf_any(good)) {
            const shd_vf place = step_of(centres->place, at), normal = step_of(centres->normal, at),
                         mirror = step_of(centres->mirror, at);
            /* (a + b)^2 <= 2 (a^2 + b^2) */
            good = shd_vf_gt_in(good, one, (mirror + place * reach) * shininess);
            good = shd_vf_gt_in(good, shd_vf_set(0.1f), normal);
            good = shd_vf_gt_in(good, one, place * footprint);
            for (int k = 0; k < centres->sum_count && shd_mf_any(good); k++) {
                const shd_vf value = shd_vf_load(centres->sums[k] + at);
                const shd_vf most = shd_vf_set(centres->absolute[k]) + relative * value;
                good = shd_vf_gt_in(good, most, bend_of(centres->sums[k] + at, value));
            }
        }
        const unsigned bits = shd_mf_bits(good);
        for (int k = 0; k < SHD_W && i + k < count; k++) settled[i + k] = (int32_t)(bits >> k & 1);
    }
}

static void predict(const float *values, const float weights[9], int first, int count, float *out) {
    for (int i = 0; i < count; i += SHD_W) {
        const float *v = values + first + i;
        shd_vf rows[3];
        for (int r = 0; r < 3; r++) {
            const float *row = v + (r - 1) * SHD_GRID;
            rows[r] = shd_vf_set(weights[3 * r]) * shd_vf_load(row - 1) +
                      shd_vf_set(weights[3 * r + 1]) * shd_vf_load(row) +
                      shd_vf_set(weights[3 * r + 2]) * shd_vf_load(row + 1);
        }
        shd_vf_store(out + i, rows[0] + rows[1] + rows[2]);
    }
}

const shd_refine_kernel SHD_VARIANT(shd_refine_kernel) = {judge, predict};
