/* Colors to codes, BLOCK pixels at a time: inputs to buckets, buckets to codes, codes to samples,
 * samples to their places. Compiled once an instruction set. */
#include <string.h>

#include "base/cpu.h"
#include "base/sample.h"
#include "color/codes.h"
#if defined(__AVX2__)
#include <immintrin.h>
#endif

enum { BLOCK = 64, GROUP = 16 }; /* pixels, and those that are stored together where they can */

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "a pixel's first sample is the lowest");

/* out[i] is entry index[i] of a table of 4-byte values. Compilers do not gather by themselves;
 * one load at a time takes twice as long. */
static inline void gather(const void *table, const uint32_t index[BLOCK], uint32_t out[BLOCK]) {
#if defined(__AVX512F__)
    for (int i = 0; i < BLOCK; i += 16)
        _mm512_storeu_si512(out + i,
                            _mm512_i32gather_epi32(_mm512_loadu_si512(index + i), table, 4));
#elif defined(__AVX2__)
    for (int i = 0; i < BLOCK; i += 8) {
        __m256i at = _mm256_loadu_si256((const void *)(index + i));
        _mm256_storeu_si256((void *)(out + i), _mm256_i32gather_epi32(table, at, 4));
    }
#else
    const unsigned char *bytes = table;
    for (int i = 0; i < BLOCK; i++) memcpy(out + i, bytes + 4 * (size_t)index[i], 4);
#endif
}

/* Inputs held where codes change. Returns, in the highest bit, whether one is beyond `finite`, by
 * size, which is rare: who looks closer may take his time. */
static inline uint32_t hold(const shd_color_codes *codes, int c, const float *restrict in,
                            uint32_t finite, float held[restrict BLOCK]) {
    const float low = codes->low, high = codes->high[c];
    uint32_t beyond = 0;
    for (int i = 0; i < BLOCK; i++) {
        float x = in[i];
        beyond |= finite - (shd_bits_of(x) & 0x7fffffff);
        x = x > low ? x : low;
        held[i] = x < high ? x : high;
    }
    return beyond;
}

static inline void find_u8(const shd_color_codes *codes, int c, const float held[restrict BLOCK],
                           uint32_t out[restrict BLOCK]) {
    const uint32_t first = codes->first, rest = (1u << codes->shift) - 1;
    const int shift = codes->shift;
    uint32_t index[BLOCK], steps[BLOCK];
    for (int i = 0; i < BLOCK; i++) index[i] = (shd_bits_of(held[i]) - first) >> shift;
    gather(codes->steps[c], index, steps);
    for (int i = 0; i < BLOCK; i++)
        out[i] = (steps[i] + ((shd_bits_of(held[i]) - first) & rest)) >> shift;
}

static inline void find_u16(const shd_color_codes *codes, int c, const float held[restrict BLOCK],
                            uint32_t out[restrict BLOCK]) {
    const uint32_t first = codes->first;
    const int shift = codes->shift;
    uint32_t index[BLOCK], add[BLOCK], slope[BLOCK], next[BLOCK];
    for (int i = 0; i < BLOCK; i++) index[i] = (shd_bits_of(held[i]) - first) >> shift << 1;
    gather(&codes->lines[c]->add, index, add);
    gather(&codes->lines[c]->slope, index, slope);
    for (int i = 0; i < BLOCK; i++)
        out[i] = (uint32_t)(int32_t)(shd_float_of(add[i]) + shd_float_of(slope[i]) * held[i]);
    gather(codes->threshold[c] + 1, out, next);
    for (int i = 0; i < BLOCK; i++) out[i] += held[i] >= shd_float_of(next[i]);
}

static inline void find_alpha(double max, const float *restrict alpha,
                              uint32_t out[restrict BLOCK]) {
    for (int i = 0; i < BLOCK; i++) out[i] = (uint32_t)shd_code((double)alpha[i] * max, max);
}

static uint64_t count_beyond(const shd_color_codes *codes, const float *const in[3], size_t count) {
    uint64_t beyond = 0;
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < count; i++)
            beyond += !(in[c][i] >= codes->finite_least[c] && in[c][i] <= codes->finite_most[c]);
    return beyond;
}

/* ---- Samples and places. ---- */

/* A pixel's samples side by side in a word, the first one lowest. */
static inline void pack_u8(uint32_t (*const code[4])[BLOCK], int samples,
                           uint32_t out[restrict BLOCK]) {
    memcpy(out, *code[0], sizeof *code[0]);
    for (int s = 1; s < samples; s++)
        for (int i = 0; i < BLOCK; i++) out[i] |= (*code[s])[i] << 8 * s;
}

static inline void pack_u16(uint32_t (*const code[4])[BLOCK], int samples,
                            uint64_t out[restrict BLOCK]) {
    for (int i = 0; i < BLOCK; i++) out[i] = (*code[0])[i];
    for (int s = 1; s < samples; s++)
        for (int i = 0; i < BLOCK; i++) out[i] |= (uint64_t)(*code[s])[i] << 16 * s;
}

static inline bool follow_each_other(const uint32_t *place, size_t count) {
    uint32_t other = 0;
    for (size_t i = 0; i < count; i++) other |= place[i] - place[0] - (uint32_t)i;
    return !other;
}

/* Stores the lowest `bytes` of words of `wide` bytes. Neighbors are stored with what is too much
 * where the next one overwrites it, but the last. */
static inline void store(const unsigned char *words, size_t wide, size_t bytes, size_t count,
                         const uint32_t *place, size_t first, unsigned char *out) {
    for (size_t done = 0; done < count; done += GROUP) {
        size_t some = count - done < GROUP ? count - done : GROUP;
        const unsigned char *from = words + done * wide;
        if (place && !follow_each_other(place + done, some)) {
            for (size_t i = 0; i < some; i++)
                memcpy(out + place[done + i] * bytes, from + i * wide, bytes);
            continue;
        }
        unsigned char *to = out + (place ? place[done] : first + done) * bytes;
        if (some == GROUP && bytes < wide && wide <= 2 * bytes)
            for (size_t i = 0; i < GROUP - 1; i++) memcpy(to + i * bytes, from + i * wide, wide);
        else
            for (size_t i = 0; i < some - 1; i++) memcpy(to + i * bytes, from + i * wide, bytes);
        memcpy(to + (some - 1) * bytes, from + (some - 1) * wide, bytes);
    }
}

/* Constants make copies of a few instructions. */
static void store_u8(const uint32_t *words, int samples, size_t count, const uint32_t *place,
                     size_t first, unsigned char *out) {
    const unsigned char *from = (const void *)words;
    switch (samples) {
    case 1:
        store(from, 4, 1, count, place, first, out);
        break;
    case 2:
        store(from, 4, 2, count, place, first, out);
        break;
    case 3:
        store(from, 4, 3, count, place, first, out);
        break;
    default:
        store(from, 4, 4, count, place, first, out);
    }
}

static void store_u16(const uint64_t *words, int samples, size_t count, const uint32_t *place,
                      size_t first, unsigned char *out) {
    const unsigned char *from = (const void *)words;
    switch (samples) {
    case 1:
        store(from, 8, 2, count, place, first, out);
        break;
    case 2:
        store(from, 8, 4, count, place, first, out);
        break;
    case 3:
        store(from, 8, 6, count, place, first, out);
        break;
    default:
        store(from, 8, 8, count, place, first, out);
    }
}

/* ---- Blocks. ---- */

/* A channel of a block, with what is missing at its end as 0. */
static inline const float *take(const float *from, size_t stride, size_t count, float room[BLOCK]) {
    if (stride == 1 && count == BLOCK) return from;
    if (stride == 4 && count == BLOCK) {
        for (int i = 0; i < BLOCK; i++) room[i] = from[4 * i];
        return room;
    }
    for (size_t i = 0; i < BLOCK; i++) room[i] = i < count ? from[i * stride] : 0;
    return room;
}

static uint64_t encode(const shd_color_task *task) {
    const shd_color_codes *codes = task->codes;
    uint32_t code[4][BLOCK] = {{0}};
    uint32_t(*code_of[4])[BLOCK] = {code, code, code, code}; /* by sample */
    bool wanted[4] = {false};
    for (int s = 0; s < task->samples; s++) {
        wanted[task->source[s]] = true;
        code_of[s] = &code[task->source[s]];
    }
    uint64_t beyond = 0;
    for (size_t first = 0; first < task->count; first += BLOCK) {
        const size_t count = task->count - first < BLOCK ? task->count - first : BLOCK;
        const size_t at = first * task->stride;
        float room[4][BLOCK], held[BLOCK];
        const float *in[3];
        uint32_t look_closer = 0;
        for (int c = 0; c < 3; c++) {
            in[c] = take(task->channel[c] + at, task->stride, count, room[c]);
            look_closer |= hold(codes, c, in[c], task->finite, held);
            if (!wanted[c]) continue;
            if (codes->max == 255)
                find_u8(codes, c, held, code[c]);
            else
                find_u16(codes, c, held, code[c]);
        }
        if (look_closer >> 31) beyond += count_beyond(codes, in, count);
        if (wanted[3] && task->channel[3])
            find_alpha(codes->max, take(task->channel[3] + at, task->stride, count, room[3]),
                       code[3]);
        else if (wanted[3])
            for (int i = 0; i < BLOCK; i++) code[3][i] = codes->max;

        const uint32_t *place = task->place ? task->place + first : NULL;
        if (codes->max == 255) {
            uint32_t words[BLOCK];
            pack_u8(code_of, task->samples, words);
            store_u8(words, task->samples, count, place, first, task->out);
        } else {
            uint64_t words[BLOCK];
            pack_u16(code_of, task->samples, words);
            store_u16(words, task->samples, count, place, first, task->out);
        }
    }
    return beyond;
}

const shd_color_kernel SHD_VARIANT(shd_color_kernel) = {encode};
