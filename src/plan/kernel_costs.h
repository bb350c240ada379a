/* What lights cost on one processor, AMD EPYC: `./dev bench --kernels` makes this file. Inside of
 * plan/. */
#pragma once

#include "plan/cost.h"

static const shd_kernel_cost shd_kernel_costs[SHD_ISA_COUNT][SHD_EXACT + 1] = {
    [SHD_PORTABLE] = {[SHD_STANDARD] = {2.6, 0.4}, [SHD_EXACT] = {5.4, 5.8}},
    [SHD_AVX2] = {[SHD_STANDARD] = {0.8, 0.2}, [SHD_EXACT] = {2.3, 3.0}},
    [SHD_AVX512] = {[SHD_STANDARD] = {0.4, 0.1}, [SHD_EXACT] = {1.1, 1.6}},
};
