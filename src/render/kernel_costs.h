/* What lights cost: `./dev bench --kernels` makes this file. Inside of render/. */
#ifndef SHD_RENDER_KERNEL_COSTS_H
#define SHD_RENDER_KERNEL_COSTS_H

#include "base/cpu.h"
#include "scene/scene.h"

/* Nanoseconds of a light at a hit, and what each specular lobe of it adds: of shininess 1e5,
 * where few points see the lobe, and at 50. */
static const struct {
    double light, lobe;
} shd_kernel_costs[SHD_ISA_COUNT][SHD_EXACT + 1] = {
    [SHD_PORTABLE] = {[SHD_STANDARD] = {12.2, 12.1}, [SHD_EXACT] = {12.2, 11.1}},
    [SHD_AVX2] = {[SHD_STANDARD] = {2.1, 0.3}, [SHD_EXACT] = {5.3, 5.5}},
    [SHD_AVX512] = {[SHD_STANDARD] = {1.1, 0.2}, [SHD_EXACT] = {3.4, 3.8}},
};

#endif
