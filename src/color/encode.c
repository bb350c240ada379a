#include <float.h>
#include <math.h>

#include "color/codes.h"

static uint64_t run_kernel(shd_isa isa, shd_color_task *task) {
    static const shd_color_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_color_kernel);
    float finite = FLT_MAX;
    for (int c = 0; c < 3; c++)
        finite = fminf(finite, fminf(-task->codes->finite_least[c], task->codes->finite_most[c]));
    task->finite = shd_bits_of(finite);
    return kernels[isa]->encode(task);
}

uint64_t shd_color_encode_planes(const shd_color_codes *codes, shd_isa isa,
                                 const float *const rgb[3], const float *alpha, size_t count,
                                 const int source[], int samples, size_t width, size_t pitch,
                                 void *out) {
    shd_color_task task = {.codes = codes,
                           .channel = {rgb[0], rgb[1], rgb[2], alpha},
                           .stride = 1,
                           .count = count,
                           .source = source,
                           .samples = samples,
                           .width = width,
                           .pitch = pitch,
                           .out = out};
    return run_kernel(isa, &task);
}

uint64_t shd_color_encode(const shd_color_codes *codes, shd_isa isa, const float *rgba,
                          size_t count, const int source[], int samples, void *out) {
    shd_color_task task = {.codes = codes,
                           .channel = {rgba, rgba + 1, rgba + 2, rgba + 3},
                           .stride = 4,
                           .count = count,
                           .source = source,
                           .samples = samples,
                           .width = count,
                           .pitch = count,
                           .out = out};
    return run_kernel(isa, &task);
}
