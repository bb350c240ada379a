/* What a light adds to a crowd, and what arrives of it. Compiled once for each instruction set. */
#include "shade/shadowed.h"

#include "base/cpu.h"
#include "base/simd.h"

enum { VW = SHD_W / 2 };

/* Lanes that have a bit set: the two halves of each as one whole number, which is more than 0. */
SHD_INLINE shd_md has_bits(shd_vul x) {
    const shd_vul low = (shd_vul)shd_vl_set(0xffffffff), two52 = (shd_vul)shd_vl_set(0x433LL << 52);
    return shd_vd_gt((shd_vd)(((x & low) | (x >> 32)) | two52), shd_vd_set(0x1p52));
}

uint64_t SHD_VARIANT(shd_find_reached)(const shd_crowd_rows *rows) {
    uint64_t reached = 0;
    for (size_t i = 0; i < rows->count; i += VW) {
        shd_vul any = (shd_vul)shd_vl_set(0);
        for (size_t r = 0; r < rows->width; r++)
            any |= (shd_vul)shd_vd_load(rows->added + r * rows->stride + i);
        any &= (shd_vul)shd_vl_set(INT64_MAX); /* -0 is 0 */
        reached |= (uint64_t)(shd_md_bits(has_bits(any)) & ((1u << VW) - 1)) << i;
    }
    return reached;
}

void SHD_VARIANT(shd_add_shares)(const shd_crowd_rows *rows) {
    const size_t stride = rows->stride;
    const shd_vd zero = shd_vd_set(0);
    for (size_t i = 0; i < rows->count; i += VW) {
        shd_vd share[3];
        shd_md some[3];
        for (size_t c = 0; c < 3; c++) {
            share[c] = shd_vd_load(rows->share + c * stride + i);
            some[c] = shd_vd_gt(share[c], zero);
        }
        for (size_t r = 0; r < rows->width; r += 3)
            for (size_t c = 0; c < 3; c++) {
                double *sum = rows->sums + (r + c) * stride + i;
                const shd_vd added = shd_vd_load(rows->added + (r + c) * stride + i);
                shd_vd_store(sum, shd_vd_load(sum) + shd_vd_mul_in(some[c], added, share[c]));
            }
    }
}
