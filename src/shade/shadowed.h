/* Light sums behind shadows, by the kernels: points that lie beside each other, light by light.
 * What a light adds to each of them comes from the same kernel as where nothing stops light; then
 * it is multiplied by what arrives of it, channel by channel. Only for shade/. */
#pragma once

#include "shade/packed.h"

/* As shd_light_sums64, if lighting->shadows are set and shd_has_kernel. */
void shd_shadowed_sums(const shd_lighting *lighting, const shd_plan_material *material,
                       const uint32_t *which, size_t n, const shd_points64 *points,
                       double *const diffuse[3], double *const *specular);

/* Rows of a crowd. Row r of `width` begins at r * stride and is of channel r % 3. `count` is the
 * crowd's, or up to the next multiple of SHD_CROWD_STEP, as is the stride. */
enum { SHD_CROWD_STEP = SHD_LANES / 2 };
typedef struct shd_crowd_rows {
    size_t width, stride, count;
    double *sums, *added; /* [width][stride] */
    double *share;        /* [3][stride] */
} shd_crowd_rows;

/* Bit i: point i has an `added` that is not 0. */
typedef uint64_t shd_find_reached_function(const shd_crowd_rows *rows);
shd_find_reached_function shd_find_reached_portable, shd_find_reached_avx2, shd_find_reached_avx512;

/* sums += added share, where both are not 0: a share of 0 leaves nothing of what is infinite. */
typedef void shd_add_shares_function(const shd_crowd_rows *rows);
shd_add_shares_function shd_add_shares_portable, shd_add_shares_avx2, shd_add_shares_avx512;
