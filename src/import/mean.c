#include "import/mean.h"

#include <stdint.h>
#include <stdlib.h>

#include "base/transfer.h"

enum { PIXELS_MOST = 1 << 26 };

static bool admit_any(void *context, const shd_decoded *picture) {
    (void)context;
    (void)picture;
    return true;
}

/* Codes of 16 bits count by their upper half. */
static void count_codes(const shd_decoded *p, const void *samples, size_t seen[4][256]) {
    const size_t count = (size_t)p->count, colors = count - (size_t)p->alpha,
                 pixels = (size_t)p->width * (size_t)p->height;
    for (size_t i = 0; i < pixels * count; i++) {
        const size_t c = i % count;
        const int code = p->depth == SHD_U8 ? ((const uint8_t *)samples)[i]
                                            : ((const uint16_t *)samples)[i] >> 8;
        seen[c < colors ? c : 3][code]++;
    }
}

static void take_mean(const size_t seen[256], float *mean, float *linear) {
    double count = 0, codes = 0, light = 0;
    for (int k = 0; k < 256; k++) {
        count += (double)seen[k];
        codes += (double)seen[k] * k / 255;
        light += (double)seen[k] * shd_curve_decode(SHD_TRANSFER_SRGB, k / 255.0);
    }
    *mean = (float)(codes / count);
    if (linear) *linear = (float)(light / count);
}

void *shd_decode_codes(const void *bytes, size_t size, shd_decoded *picture) {
    const shd_decoder decoder = {.most = PIXELS_MOST, .admit = admit_any};
    void *samples = NULL;
    shd_error error;
    if (shd_decode(&decoder, bytes, size, picture, &samples, &error) != SHD_OK) return NULL;
    if (picture->depth != SHD_FLOAT) return samples;
    free(samples);
    return NULL;
}

bool shd_measure_picture(const void *bytes, size_t size, float mean[4], float linear[3]) {
    size_t seen[4][256] = {{0}};
    shd_decoded p = {0};
    void *samples = shd_decode_codes(bytes, size, &p);
    if (!samples) return false;
    count_codes(&p, samples, seen);
    free(samples);
    mean[3] = 1;
    for (int c = 0; c < 3; c++)
        take_mean(seen[p.count - p.alpha < 3 ? 0 : c], &mean[c], &linear[c]);
    if (p.alpha) take_mean(seen[3], &mean[3], NULL);
    return true;
}
