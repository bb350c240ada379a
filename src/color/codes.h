/* Baked transforms: from f32 to integer codes without a float pixel between. color.h has the part
 * that other rooms use.
 *
 * If the channels of a transform do not mix and its curves only rise, the inputs of each code k are
 * one interval: from threshold[k] to below threshold[k + 1]. The thresholds are found by search on
 * the transform itself, so that the codes are its own and not an approximation's. */
#pragma once

#include "color/tables.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Pixels to encode: what shd_color_encode and shd_color_encode_planes have in common. */
typedef struct shd_color_task {
    const shd_color_codes *codes;
    const float *channel[4]; /* red, green, blue and alpha of pixel i at [i * stride]; alpha may be
                                NULL */
    size_t stride, count;
    const int *source; /* [samples] */
    int samples;
    size_t width, pitch; /* pixels of a row in `out`, and from one row to the next */
    uint32_t plain;      /* bits of the largest size up to which positive inputs are finite and not
                            clipped */
    void *out;
} shd_color_task;

/* The functions of one variant. */
typedef struct shd_color_kernel {
    shd_encoded (*encode)(const shd_color_task *task);
} shd_color_kernel;

extern const shd_color_kernel shd_color_kernel_portable, shd_color_kernel_avx2,
    shd_color_kernel_avx512;

/* The transform's codes from 0 to `max`, which the caller owns. NULL if memory is short or the
 * transform does not qualify: channels depend on each other or on alpha, a curve falls, codes
 * change below 0, or a bucket would need more than one threshold or guess. NULL, too, once
 * go_on(context) is false, which is asked all along; a NULL function never is. */
shd_color_codes *shd_color_codes_bake(const shd_color_transform *transform, unsigned max,
                                      shd_color_go_on *go_on, const void *context);
void shd_color_codes_drop(shd_color_codes *codes);         /* NULL is fine */
size_t shd_color_codes_size(const shd_color_codes *codes); /* bytes that they take */

#ifdef __cplusplus
}
#endif
