/* Copies the lanes of a stage that hit something. Compiled once an instruction set. */
#include <assert.h>
#include <stddef.h>

#include "sight/batch.h"

static_assert(offsetof(shd_stage, position32) % 64 == 0 &&
                  offsetof(shd_stage, position) % 64 == 0 &&
                  offsetof(shd_stage, triangle) % 64 == 0 && offsetof(shd_stage, u) % 64 == 0,
              "a stage's arrays are loaded as whole vectors");

/* The lanes that hit: a mask if there are instructions for it; how fours of lanes are packed, and
 * where these go; else one after the other. */
typedef struct hit_lanes {
    size_t count;
    uint64_t mask;
    uint8_t lane[SHD_RAYS];
    int fours; /* up to the last one that has a hit */
    uint8_t order[SHD_RAYS / 4], at[SHD_RAYS / 4];
} hit_lanes;

#if defined(__AVX2__) && !defined(__AVX512F__)
/* Moves the lanes of a mask's bits to the front. */
static const int32_t PACKED[16][4] = {{0},    {0},       {1},       {0, 1},      {2},    {0, 2},
                                      {1, 2}, {0, 1, 2}, {3},       {0, 3},      {1, 3}, {0, 1, 3},
                                      {2, 3}, {0, 2, 3}, {1, 2, 3}, {0, 1, 2, 3}};
#endif

SHD_INLINE void find_lanes(const double *restrict object, size_t hits, hit_lanes *restrict out) {
    out->count = hits;
    out->mask = 0;
    out->fours = 0;
    if (hits == SHD_RAYS) return;
#if defined(__AVX512F__)
    for (int i = 0; i < SHD_RAYS; i += 8) {
        const __m512d some = _mm512_load_pd(object + i);
        const uint64_t mask = _mm512_cmp_pd_mask(some, _mm512_set1_pd(SHD_NOTHING), _CMP_NEQ_OQ);
        out->mask |= mask << i;
    }
#elif defined(__AVX2__)
    size_t n = 0;
    for (int i = 0; i < SHD_RAYS / 4; i++) {
        const __m256d some = _mm256_load_pd(object + 4 * i),
                      hit = _mm256_cmp_pd(some, _mm256_set1_pd(SHD_NOTHING), _CMP_NEQ_OQ);
        const unsigned mask = (unsigned)_mm256_movemask_pd(hit);
        out->mask |= (uint64_t)mask << 4 * i;
        out->order[i] = (uint8_t)mask;
        out->at[i] = (uint8_t)n;
        if (mask) out->fours = i + 1;
        n += (size_t)__builtin_popcount(mask);
    }
#else
    size_t n = 0;
    for (int i = 0; n < hits; i++) {
        out->lane[n] = (uint8_t)i; /* it stays if it hit: there is no branch to mispredict */
        n += object[i] != SHD_NOTHING;
    }
#endif
}

/* Appends an array's elements of the lanes that hit. What follows may be written, too, but nothing
 * that would be behind the hits if all rays up to the last one that did had hit. */
SHD_INLINE void append_lanes(void *to, const void *from, size_t size, size_t at,
                             const hit_lanes *lanes) {
    if (lanes->count == SHD_RAYS) {
        memcpy((char *)to + at * size, from, SHD_RAYS * size);
        return;
    }
    char *out = (char *)to + at * size;
    const char *in = from;
#if defined(__AVX512F__)
    const int step = 64 / (int)size;
    for (int i = 0; i < SHD_RAYS; i += step) {
        const __m512i some = _mm512_load_si512(in + (size_t)i * size);
        const unsigned mask = (unsigned)(lanes->mask >> i) & ((1u << step) - 1);
        const int count = __builtin_popcount(mask);
        const unsigned first = (1u << count) - 1;
        if (size == sizeof(uint32_t))
            _mm512_mask_storeu_epi32(out, (__mmask16)first,
                                     _mm512_maskz_compress_epi32((__mmask16)mask, some));
        else
            _mm512_mask_storeu_epi64(out, (__mmask8)first,
                                     _mm512_maskz_compress_epi64((__mmask8)mask, some));
        out += (size_t)count * size;
    }
#elif defined(__AVX2__)
    if (size == sizeof(float)) {
        for (int i = 0; i < lanes->fours; i++) {
            const __m128i order = _mm_loadu_si128((const __m128i *)PACKED[lanes->order[i]]);
            const __m128 some = _mm_load_ps((const float *)from + 4 * i);
            _mm_storeu_ps((float *)to + at + lanes->at[i], _mm_permutevar_ps(some, order));
        }
        return;
    }
    for (uint64_t mask = lanes->mask; mask; mask &= mask - 1, out += size)
        memcpy(out, in + size * (size_t)__builtin_ctzll(mask), size);
#else
    for (size_t k = 0; k < lanes->count; k++)
        memcpy(out + size * k, in + size * lanes->lane[k], size);
#endif
}

void SHD_VARIANT(shd_append_hits)(const shd_stage *s, size_t hits, size_t first, shd_hits *out) {
    const size_t at = out->count;
    assert(at + hits <= out->capacity);
    SHD_ALIGNED uint32_t shot[SHD_RAYS];
    SHD_ALIGNED int32_t object[SHD_RAYS];
    hit_lanes lanes;
    SHD_EACH_LANE(i) {
        shot[i] = (uint32_t)first + (uint32_t)i;
        object[i] = (int32_t)s->object[i];
    }
    find_lanes(s->object, hits, &lanes);
#define APPEND(to, from) append_lanes(to, from, sizeof *(from), at, &lanes)
    APPEND(out->shot, shot);
    APPEND(out->object, object);
    for (int c = 0; c < 3; c++) {
        if (out->position32[c]) {
            APPEND(out->position32[c], s->position32[c]);
            APPEND(out->normal32[c], s->normal32[c]);
            APPEND(out->mirror32[c], s->mirror32[c]);
        } else {
            APPEND(out->position[c], s->position[c]);
            APPEND(out->normal[c], s->normal[c]);
            APPEND(out->view[c], s->view[c]);
        }
        if (out->low32[c]) APPEND(out->low32[c], s->low32[c]);
        if (out->world32[c]) APPEND(out->world32[c], s->world32[c]);
    }
    if (out->depth) APPEND(out->depth, s->depth);
    if (out->triangle) {
        APPEND(out->triangle, s->triangle);
        APPEND(out->u, s->u);
        APPEND(out->v, s->v);
    }
    out->count = at + hits;
}
