/* Colors to codes, BLOCK pixels at a time: inputs to buckets, buckets to codes, codes to samples,
 * samples to rows. Compiled once for each instruction set. */
#include <string.h>

#include "base/cpu.h"
#include "base/sample.h"
#include "base/simd.h"
#include "color/codes.h"
#if defined(__AVX2__)
#include <immintrin.h>
#endif

enum { BLOCK = 256, GROUP = 16 }; /* pixels, and as many as are stored together if possible */

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "a pixel's first sample is the lowest");

/* out[i] is entry index[i] of a table of 4-byte values. Compilers do not gather by themselves, and
 * one load at a time takes twice as long. */
static inline void gather_entries(const void *table, const uint32_t index[BLOCK],
                                  uint32_t out[BLOCK]) {
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

/* Holds inputs where codes change. The highest bits of `beyond` tell whether an input is negative
 * or its size beyond `plain`. That is rare, so the code that then looks closer may be slow. */
static inline void hold_inputs(const shd_color_codes *codes, int c, const float *restrict in,
                               uint32_t plain, float held[restrict BLOCK],
                               uint32_t beyond[restrict GROUP]) {
    const float low = codes->low, high = codes->high[c];
    for (int first = 0; first < BLOCK; first += GROUP)
        for (int i = 0; i < GROUP; i++) {
            float x = in[first + i];
            beyond[i] |= (plain - (shd_bits_of(x) & 0x7fffffff)) | shd_bits_of(x);
            x = x > low ? x : low;
            held[first + i] = x < high ? x : high;
        }
}

static inline bool is_any_beyond(const uint32_t beyond[GROUP]) {
    uint32_t any = 0;
    for (int i = 0; i < GROUP; i++) any |= beyond[i];
    return any >> 31;
}

/* A vector of entries. */
SHD_INLINE shd_vu gather_vector(const uint32_t *table, shd_vu index) {
#if SHD_W == 16
    return (shd_vu)_mm512_i32gather_epi32((__m512i)index, table, 4);
#elif SHD_W == 8
    return (shd_vu)_mm256_i32gather_epi32((const int *)table, (__m256i)index, 4);
#else
    return (shd_vu){table[index[0]], table[index[1]], table[index[2]], table[index[3]]};
#endif
}

/* Holds inputs and finds the codes of 8 bits that are wanted at once, so that what is between
 * stays in registers: the samples of a pixel side by side in a word, the first one lowest. */
SHD_INLINE void find_words_u8(const shd_color_task *task, const float *const in[3],
                              const bool wanted[4], const uint32_t alpha[BLOCK], int samples,
                              uint32_t out[BLOCK], uint32_t beyond[GROUP]) {
    const shd_color_codes *codes = task->codes;
    const shd_vu first = shd_vu_set(codes->first), rest = shd_vu_set((1u << codes->shift) - 1),
                 size = shd_vu_set(0x7fffffff), most = shd_vu_set(task->plain);
    const shd_vf low = shd_vf_set(codes->low);
    const int shift = codes->shift;
    shd_vu far = shd_vu_set(0), code[4];
    for (int i = 0; i < BLOCK; i += SHD_W) {
        for (int c = 0; c < 3; c++) {
            const shd_vf x = shd_vf_load(in[c] + i), high = shd_vf_set(codes->high[c]);
            far |= (most - ((shd_vu)x & size)) | (shd_vu)x;
            if (!wanted[c]) continue;
            const shd_vu off = (shd_vu)shd_vf_min(shd_vf_max(x, low), high) - first;
            code[c] = (gather_vector(codes->steps[c], off >> shift) + (off & rest)) >> shift;
        }
        if (wanted[3]) memcpy(&code[3], alpha + i, sizeof code[3]);
        shd_vu word = code[task->source[0]];
        for (int s = 1; s < samples; s++) word |= code[task->source[s]] << 8 * s;
        memcpy(out + i, &word, sizeof word);
    }
    memcpy(beyond, &far, sizeof far);
}

static inline void find_u16(const shd_color_codes *codes, int c, const float held[restrict BLOCK],
                            uint32_t out[restrict BLOCK]) {
    const uint32_t first = codes->first;
    const int shift = codes->shift;
    uint32_t index[BLOCK], add[BLOCK], slope[BLOCK], next[BLOCK];
    for (int i = 0; i < BLOCK; i++) index[i] = (shd_bits_of(held[i]) - first) >> shift << 1;
    gather_entries(&codes->lines[c]->add, index, add);
    gather_entries(&codes->lines[c]->slope, index, slope);
    for (int i = 0; i < BLOCK; i++)
        out[i] = (uint32_t)(int32_t)(shd_float_of(add[i]) + shd_float_of(slope[i]) * held[i]);
    gather_entries(codes->threshold[c] + 1, out, next);
    for (int i = 0; i < BLOCK; i++) out[i] += held[i] >= shd_float_of(next[i]);
}

static inline void find_alpha(double max, const float *restrict alpha,
                              uint32_t out[restrict BLOCK]) {
    for (int i = 0; i < BLOCK; i++) out[i] = (uint32_t)shd_code((double)alpha[i] * max, max);
}

static void count_held(const shd_color_task *task, const float *const in[3], size_t count,
                       shd_encoded *counts) {
    const shd_color_codes *codes = task->codes;
    for (size_t c = 0; c < 3; c++)
        for (size_t i = 0; i < count; i++)
            counts->beyond +=
                !(in[c][i] >= codes->finite_least[c] && in[c][i] <= codes->finite_most[c]);
    for (int s = 0; s < task->samples; s++) {
        const int c = task->source[s];
        for (size_t i = 0; c < 3 && i < count; i++)
            counts->clipped += in[c][i] <= codes->clip_least[c] || in[c][i] >= codes->clip_most[c];
    }
}

/* ---- Samples and rows. ---- */

/* A pixel's samples side by side, the first one lowest. */
static inline void pack_u16(uint32_t (*const code[4])[BLOCK], int samples,
                            uint64_t out[restrict BLOCK]) {
    for (int i = 0; i < BLOCK; i++) out[i] = (*code[0])[i];
    for (int s = 1; s < samples; s++)
        for (int i = 0; i < BLOCK; i++) out[i] |= (uint64_t)(*code[s])[i] << 16 * s;
}

/* Where the next pixel begins. */
typedef struct place {
    unsigned char *row;
    size_t column;
} place;

/* Stores the lowest three bytes of GROUP words of four, and nothing behind them. */
static inline void store_threes(const unsigned char *words, unsigned char *to) {
#if defined(__AVX2__)
    const __m256i pick = _mm256_setr_epi8(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1, 0,
                                          1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, -1, -1, -1, -1);
    const __m256i join = _mm256_setr_epi32(0, 1, 2, 4, 5, 6, 7, 7);
    for (int half = 0; half < 2; half++, words += 32, to += 24) {
        __m256i picked = _mm256_shuffle_epi8(_mm256_loadu_si256((const void *)words), pick);
        __m256i joined = _mm256_permutevar8x32_epi32(picked, join);
        _mm_storeu_si128((void *)to, _mm256_castsi256_si128(joined));
        _mm_storel_epi64((void *)(to + 16), _mm256_extracti128_si256(joined, 1));
    }
#else
    /* Stores a fourth byte with each word but the last, which the next word overwrites. */
    for (size_t i = 0; i < GROUP - 1; i++) memcpy(to + 3 * i, words + 4 * i, 4);
    memcpy(to + 3 * (GROUP - 1), words + 4 * (GROUP - 1), 3);
#endif
}

/* Stores the lowest `bytes` of words that are `wide` bytes apart. */
static inline void store_words(const unsigned char *words, size_t wide, size_t bytes, size_t count,
                               const shd_color_task *task, place *at) {
    for (size_t done = 0; done < count;) {
        const size_t left = task->width - at->column;
        size_t some = count - done < GROUP ? count - done : GROUP;
        some = some < left ? some : left;
        const unsigned char *from = words + done * wide;
        unsigned char *to = at->row + at->column * bytes;
        if (some == GROUP && wide == 4 && bytes == 3)
            store_threes(from, to);
        else
            for (size_t i = 0; i < some; i++) memcpy(to + i * bytes, from + i * wide, bytes);
        done += some;
        at->column += some;
        if (at->column == task->width) *at = (place){at->row + task->pitch * bytes, 0};
    }
}

/* Words of four samples of `bytes` bytes each: constants turn copies into a few instructions. */
static inline void store_samples(const void *words, size_t bytes, int samples, size_t count,
                                 const shd_color_task *task, place *at) {
    if (samples == 1)
        store_words(words, 4 * bytes, bytes, count, task, at);
    else if (samples == 2)
        store_words(words, 4 * bytes, 2 * bytes, count, task, at);
    else if (samples == 3)
        store_words(words, 4 * bytes, 3 * bytes, count, task, at);
    else
        store_words(words, 4 * bytes, 4 * bytes, count, task, at);
}

/* ---- Blocks. ---- */

/* A channel of a block. If the block has fewer pixels, zeros fill its end. */
static inline const float *take_channel(const float *from, size_t stride, size_t count,
                                        float room[BLOCK]) {
    if (stride == 1 && count == BLOCK) return from;
    if (stride == 4 && count == BLOCK) {
        for (int i = 0; i < BLOCK; i++) room[i] = from[4 * i];
        return room;
    }
    for (size_t i = 0; i < BLOCK; i++) room[i] = i < count ? from[i * stride] : 0;
    return room;
}

static shd_encoded encode_pixels(const shd_color_task *task) {
    const shd_color_codes *codes = task->codes;
    uint32_t code[4][BLOCK] = {{0}};
    uint32_t(*code_of[4])[BLOCK] = {code, code, code, code}; /* by sample */
    bool wanted[4] = {false};
    for (int s = 0; s < task->samples; s++) {
        wanted[task->source[s]] = true;
        code_of[s] = &code[task->source[s]];
    }
    place next = {task->out, 0};
    shd_encoded counts = {0, 0};
    for (size_t first = 0; first < task->count; first += BLOCK) {
        const size_t count = task->count - first < BLOCK ? task->count - first : BLOCK;
        const size_t at = first * task->stride;
        float room[4][BLOCK], held[BLOCK];
        const float *in[3];
        uint32_t look_closer[GROUP] = {0};
        for (int c = 0; c < 3; c++) {
            in[c] = take_channel(task->channel[c] + at, task->stride, count, room[c]);
            if (codes->max == 255) continue;
            hold_inputs(codes, c, in[c], task->plain, held, look_closer);
            if (wanted[c]) find_u16(codes, c, held, code[c]);
        }
        if (wanted[3] && task->channel[3])
            find_alpha(codes->max,
                       take_channel(task->channel[3] + at, task->stride, count, room[3]), code[3]);
        else if (wanted[3])
            for (int i = 0; i < BLOCK; i++) code[3][i] = codes->max;

        if (codes->max == 255) {
            uint32_t words[BLOCK];
            if (task->samples == 3)
                find_words_u8(task, in, wanted, code[3], 3, words, look_closer);
            else
                find_words_u8(task, in, wanted, code[3], task->samples, words, look_closer);
            store_samples(words, 1, task->samples, count, task, &next);
        } else {
            uint64_t words[BLOCK];
            pack_u16(code_of, task->samples, words);
            store_samples(words, 2, task->samples, count, task, &next);
        }
        if (is_any_beyond(look_closer)) count_held(task, in, count, &counts);
    }
    return counts;
}

const shd_color_kernel SHD_VARIANT(shd_color_kernel) = {encode_pixels};
