/* What lossy formats lose, under a budget that counts it.
 *
 * The picture is encoded, decoded again, and compared with the samples that were encoded, in the
 * budget's metric. What the plan's bound leaves of the budget is the format's. Decoders are
 * libjpeg-turbo's and libwebp's own. Where alpha is 0 no color counts, for none is seen. */
#pragma once

#include "image/image.h"
#include "render/rendering.h"

/* What measures one output, on several threads. */
typedef struct shd_codec shd_codec;

/* What a format has lost, in the budget's metric: the largest error, and what 99 % of samples (of
 * pixels in CIEDE2000) do not exceed. The whole of the budget is at least the plan's bound and
 * `most`. */
typedef struct shd_lost {
    int quality; /* 0: nothing was measured */
    double most, p99, room;
} shd_lost;

/* Has `image`, which is of the scene's output `index`, be decoded where that output is measured.
 * *out is NULL if it is not. SHD_SCENE: the budget's metric is not known of its samples. */
shd_status shd_codec_new(shd_rendering *r, size_t index, const shd_color_info *info,
                         shd_image *image, shd_codec **out, shd_error *error);

/* Encodes the image at its own quality, or at the least that is found by bisection to meet the
 * budget; WebP without loss, at 100, if 99 does not. SHD_SCENE: it is not met. All that it takes of
 * r->arena stays there. */
shd_status shd_codec_encode(shd_rendering *r, shd_codec *codec, shd_image *image, shd_bytes *out,
                            shd_lost *lost, shd_error *error);

/* Adds what was lost in output `index` to r->codec, the text of Shaded-Codec. False: memory. */
bool shd_codec_tell(shd_rendering *r, size_t index, const shd_lost *lost);
