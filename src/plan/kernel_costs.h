/* What lights cost: `./dev bench --kernels` makes this file. Inside of plan/. */
#pragma once

#include "plan/cost.h"

static const shd_kernel_cost shd_kernel_costs[SHD_ISA_COUNT][SHD_EXACT + 1] = {
    [SHD_PORTABLE] = {[SHD_STANDARD] = {10.1, 10.9}, [SHD_EXACT] = {13.7, 11.6}},
    [SHD_AVX2] = {[SHD_STANDARD] = {2.3, 0.4}, [SHD_EXACT] = {6.0, 5.7}},
    [SHD_AVX512] = {[SHD_STANDARD] = {1.2, 0.2}, [SHD_EXACT] = {3.9, 4.4}},
};
