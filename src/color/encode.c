#include <float.h>
#include <math.h>

#include "color/codes.h"

/* Channels are as in shd_color_task. */
static shd_encoded encode(const shd_color_codes *codes, shd_isa isa, const float *const channel[4],
                          size_t stride, size_t count, const int source[], int samples,
                          size_t width, size_t pitch, void *out) {
    static const shd_color_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_color_kernel);
    float finite = FLT_MAX;
    for (int c = 0; c < 3; c++)
        finite = fminf(finite, fminf(-codes->finite_least[c], codes->finite_most[c]));
    uint32_t plain = shd_bits_of(finite);
    for (int c = 0; c < 3; c++) {
        const uint32_t clipped = shd_bits_of(codes->clip_most[c]);
        if (clipped <= plain) plain = clipped - 1;
    }
    const shd_color_task task = {.codes = codes,
                                 .channel = {channel[0], channel[1], channel[2], channel[3]},
                                 .stride = stride,
                                 .count = count,
                                 .source = source,
                                 .samples = samples,
                                 .width = width,
                                 .pitch = pitch,
                                 .plain = plain,
                                 .out = out};
    return kernels[isa]->encode(&task);
}

shd_encoded shd_color_encode_planes(const shd_color_codes *codes, shd_isa isa,
                                    const float *const rgb[3], const float *alpha, size_t count,
                                    const int source[], int samples, size_t width, size_t pitch,
                                    void *out) {
    const float *const channel[4] = {rgb[0], rgb[1], rgb[2], alpha};
    return encode(codes, isa, channel, 1, count, source, samples, width, pitch, out);
}

shd_encoded shd_color_encode(const shd_color_codes *codes, shd_isa isa, const float *rgba,
                             size_t count, const int source[], int samples, void *out) {
    const float *const channel[4] = {rgba, rgba + 1, rgba + 2, rgba + 3};
    return encode(codes, isa, channel, 4, count, source, samples, count, count, out);
}
