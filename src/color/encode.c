#include <float.h>
#include <math.h>

#include "base/sample.h"
#include "color/codes.h"

enum { BLOCK = 64 }; /* pixels whose offsets are at hand */

/* Offsets of a block's inputs into the buckets; with an alpha lane that nobody reads. False where
 * an input is beyond `finite`, by size, which is rare: who looks closer may take his time. */
static bool find_offsets(const shd_color_codes *codes, const float *restrict rgba, size_t pixels,
                         float finite, uint32_t *restrict offsets) {
    const uint32_t first = codes->first, size = shd_bits_of(finite);
    const float low = codes->low;
    const float high[4] = {codes->high[0], codes->high[1], codes->high[2], codes->high[2]};
    uint32_t beyond = 0;
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 4; c++) {
            float x = rgba[4 * i + c];
            beyond |= size - (shd_bits_of(x) & 0x7fffffff);
            x = x > low ? x : low;
            x = x < high[c] ? x : high[c];
            offsets[4 * i + c] = shd_bits_of(x) - first;
        }
    return !(beyond >> 31);
}

static uint64_t count_beyond(const shd_color_codes *codes, const float *rgba, size_t pixels) {
    uint64_t beyond = 0;
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++) {
            float x = rgba[4 * i + c];
            beyond += !(x >= codes->finite_least[c] && x <= codes->finite_most[c]);
        }
    return beyond;
}

static inline uint8_t look_up_u8(const uint32_t *steps, uint32_t offset, int shift) {
    return (uint8_t)((steps[offset >> shift] + (offset & ((1u << shift) - 1))) >> shift);
}

static inline uint16_t look_up_u16(const shd_color_codes *codes, int c, uint32_t offset) {
    float x = shd_float_of(codes->first + offset);
    int32_t code = (int32_t)shd_color_guess(codes, c, x);
    return (uint16_t)(code + (x >= codes->threshold[c][code + 1]));
}

/* Tables' places are copied: a store of bytes may change anything that is not local, as far as a
 * compiler knows. */
static void store_u8(const shd_color_codes *codes, const float *rgba, const uint32_t *offsets,
                     size_t pixels, const int source[], int samples, uint8_t *out) {
    const int shift = codes->shift;
    if (samples == 3 && source[0] == 0 && source[1] == 1 && source[2] == 2) {
        const uint32_t *red = codes->steps[0], *green = codes->steps[1], *blue = codes->steps[2];
        for (size_t i = 0; i < pixels; i++) {
            out[3 * i] = look_up_u8(red, offsets[4 * i], shift);
            out[3 * i + 1] = look_up_u8(green, offsets[4 * i + 1], shift);
            out[3 * i + 2] = look_up_u8(blue, offsets[4 * i + 2], shift);
        }
        return;
    }
    for (int s = 0; s < samples; s++) {
        const int c = source[s];
        uint8_t *at = out + s;
        const uint32_t *steps = c < 3 ? codes->steps[c] : NULL;
        for (size_t i = 0; i < pixels; i++, at += samples)
            *at = steps ? look_up_u8(steps, offsets[4 * i + (size_t)c], shift)
                        : (uint8_t)shd_code((double)rgba[4 * i + 3] * 255, 255);
    }
}

static void store_u16(const shd_color_codes *codes, const float *rgba, const uint32_t *offsets,
                      size_t pixels, const int source[], int samples, uint16_t *out) {
    for (int s = 0; s < samples; s++) {
        const int c = source[s];
        uint16_t *at = out + s;
        for (size_t i = 0; i < pixels; i++, at += samples)
            *at = c < 3 ? look_up_u16(codes, c, offsets[4 * i + (size_t)c])
                        : (uint16_t)shd_code((double)rgba[4 * i + 3] * 65535, 65535);
    }
}

uint64_t shd_color_encode(const shd_color_codes *codes, const float *rgba, size_t count,
                          const int source[], int samples, void *out) {
    float finite = FLT_MAX;
    for (int c = 0; c < 3; c++)
        finite = fminf(finite, fminf(-codes->finite_least[c], codes->finite_most[c]));
    uint64_t beyond = 0;
    uint32_t offsets[4 * BLOCK];
    for (size_t done = 0; done < count; done += BLOCK, rgba += 4 * BLOCK) {
        size_t pixels = count - done < BLOCK ? count - done : BLOCK;
        size_t at = done * (size_t)samples;
        if (!find_offsets(codes, rgba, pixels, finite, offsets))
            beyond += count_beyond(codes, rgba, pixels);
        if (codes->max == 255)
            store_u8(codes, rgba, offsets, pixels, source, samples, (uint8_t *)out + at);
        else
            store_u16(codes, rgba, offsets, pixels, source, samples, (uint16_t *)out + at);
    }
    return beyond;
}
