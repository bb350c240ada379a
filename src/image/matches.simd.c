#include "image/matches.h"

#include <endian.h>
#include <string.h>

#include "base/cpu.h"
#include "base/simd.h"

/* Matches that are taken. Shorter ones cost more than the numbers that they stand for: of 36
 * examples, these leave the fewest bytes for their time. */
enum { REPEAT = 10 };

/* The same where samples are of two bytes, whose high ones hardly differ: runs of a pixel or of a
 * sample, repeats, and those of a grey pixel with colors, which a run stands for already. */
enum { WIDE_RUN = SHD_MATCH_SHORTEST, WIDE_REPEAT = 6, WIDE_GREY = 8 };

/* Of a match, the first bytes are remembered. */
enum { HASH_BITS = 12, WIDE_BITS = 14, REMEMBERED = 4 };

/* After so many bytes in vain, matches are looked for at one byte less often. */
enum { PATIENCE = 32, PATIENCE_MOST = 16 * PATIENCE };

enum { WORD = 8, VECTOR = 64 };

static inline uint64_t load(const unsigned char *at) {
    uint64_t v;
    memcpy(&v, at, sizeof v);
    return le64toh(v);
}

/* Fibonacci hashing: Knuth, The Art of Computer Programming 3, 6.4. */
static inline size_t hash(uint64_t v) {
    return v * 0x9E3779B97F4A7C15u >> (64 - HASH_BITS);
}

static inline size_t least(size_t a, size_t b) {
    return a < b ? a : b;
}

/* How many of VECTOR bytes are the same before one differs. */
static inline size_t count_same(const unsigned char *a, const unsigned char *b) {
#if SHD_W > 4 /* masks of 64 bytes take longer to be looked at than two of 32 */
    uint64_t same = 0;
    for (int i = 0; i < VECTOR; i += 32) {
        const __m256i x = _mm256_loadu_si256((const __m256i *)(const void *)(a + i)),
                      y = _mm256_loadu_si256((const __m256i *)(const void *)(b + i));
        same |= (uint64_t)(uint32_t)_mm256_movemask_epi8(_mm256_cmpeq_epi8(x, y)) << i;
    }
    return ~same ? (size_t)__builtin_ctzll(~same) : VECTOR;
#else
    for (size_t i = 0; i < VECTOR; i += WORD) {
        const uint64_t differ = load(a + i) ^ load(b + i);
        if (differ) return i + (size_t)__builtin_ctzll(differ) / 8;
    }
    return VECTOR;
#endif
}

/* How many bytes from `at` are as those from `back`, `most` at most. */
static inline size_t measure(const unsigned char *at, const unsigned char *back, size_t most) {
    size_t length = 0;
    if (most < VECTOR) { /* near the block's end */
        while (length < most && at[length] == back[length]) length++;
        return length;
    }
    for (size_t same; length + VECTOR <= most; length += VECTOR)
        if ((same = count_same(at + length, back + length)) < VECTOR) return length + same;
    const size_t rest = most - VECTOR; /* some of these are known to be the same */
    return length < most ? rest + count_same(at + rest, back + rest) : most;
}

static inline void add_sequence(shd_matches *m, const unsigned char *from, const unsigned char *end,
                                size_t literals, size_t length, size_t distance) {
    enum { FEW = 16 }; /* mostly there are no more; what is copied too much is overwritten */
    m->sequences[m->count++] =
        (shd_sequence){(uint16_t)literals, (uint16_t)length, (uint16_t)distance};
    unsigned char *const to = m->literals + m->literal_count;
    if (literals <= FEW && end - from >= FEW)
        memcpy(to, from, FEW);
    else
        memcpy(to, from, literals);
    m->literal_count += literals;
    m->lengths[length]++;
    if (length) m->distances[shd_distance_symbol((unsigned)distance).name]++;
}

static void clear(shd_matches *m, size_t seen) {
    m->count = m->literal_count = 0;
    memset(m->seen, 0, seen * sizeof *m->seen);
    memset(m->lengths, 0, sizeof m->lengths);
    memset(m->distances, 0, sizeof m->distances);
}

/* How many bytes before `at` and `back` are the same, of WORD. */
static inline size_t count_before(const unsigned char *at, const unsigned char *back) {
    const uint64_t differ = load(at - WORD) ^ load(back - WORD);
    return differ ? (size_t)__builtin_clzll(differ) / 8 : WORD;
}

static void find_matches(shd_matches *m, const unsigned char *data, size_t before, size_t size,
                         size_t pixel) {
    const unsigned char *const end = data + size, *at = data, *from = data;
    size_t patience = 0;
    clear(m, 1 << HASH_BITS);
    if (before < WORD) at += least(WORD, size); /* so many bytes are looked back at */
    while (end - at >= WORD) {
        const size_t most = least((size_t)(end - at), SHD_MATCH_LONGEST);
        const uint64_t here = load(at);
        uint16_t *const seen = &m->seen[hash(here)];
        const unsigned char *const old = data + *seen, *back = at - pixel;
        *seen = (uint16_t)(at - data);
        size_t length = 0;
        if (here == load(back)) {
            length = measure(at, back, most);
        } else if (here == load(old) && old < at && at - old <= SHD_MATCH_FARTHEST) {
            back = old;
            length = measure(at, back, most);
        }
        if (length < (back == old ? REPEAT : WORD)) {
            at += least(1 + patience / PATIENCE, (size_t)(end - at));
            if (patience < PATIENCE_MOST) patience++;
            continue;
        }
        /* Bytes before may belong to the match. */
        size_t more = 0;
        if (back - data >= WORD)
            more = least(count_before(at, back),
                         least((size_t)(at - from), SHD_MATCH_LONGEST - length));
        add_sequence(m, from, end, (size_t)(at - from) - more, length + more, (size_t)(at - back));
        if (end - at >= WORD + REMEMBERED)
            for (size_t i = 1; i < REMEMBERED; i++)
                m->seen[hash(load(at + i))] = (uint16_t)(at + i - data);
        from = at += length;
        patience = 0;
    }
    add_sequence(m, from, end, (size_t)(end - from), 0, 0);
}

/* ---- Samples of two bytes ---- */

static inline size_t hash_wide(uint64_t v) {
    return (v << (64 - 8 * WIDE_REPEAT)) * 0x9E3779B97F4A7C15u >> (64 - WIDE_BITS);
}

/* How many bytes from `at`, which begin with `here`, are as those from `back`. */
static inline size_t count_alike(uint64_t here, const unsigned char *at, const unsigned char *back,
                                 const unsigned char *end) {
    const uint64_t differ = here ^ load(back);
    return differ ? (size_t)__builtin_ctzll(differ) / 8
                  : measure(at, back, least((size_t)(end - at), SHD_MATCH_LONGEST));
}

/* The longest match at `at` of those that are tried. Its length is 0 if there is none. */
static inline shd_sequence find_wide(shd_matches *m, const unsigned char *data,
                                     const unsigned char *at, const unsigned char *end,
                                     size_t pixel) {
    enum { SAMPLE = 2, ENOUGH = 16 };
    const uint64_t here = load(at);
    size_t length = count_alike(here, at, at - pixel, end), distance = pixel;
    if (pixel > SAMPLE) {
        const size_t other = count_alike(here, at, at - SAMPLE, end);
        if (other > length) length = other, distance = SAMPLE;
    }
    if (length < WIDE_RUN) length = 0;
    uint16_t *const seen = &m->seen[hash_wide(here)];
    const unsigned char *const back = data + *seen;
    *seen = (uint16_t)(at - data);
    if (length < ENOUGH && back < at && at - back <= SHD_MATCH_FARTHEST) {
        const uint64_t differ = here ^ here >> 8 * SAMPLE;
        /* Two samples are like the ones before them; that of alpha may be the first of all. */
        const bool grey =
            pixel > SAMPLE && (!(uint32_t)differ || !(uint32_t)(differ >> 8 * SAMPLE));
        const size_t other = count_alike(here, at, back, end);
        if (other >= (grey ? WIDE_GREY : WIDE_REPEAT) && other > length + 1)
            length = other, distance = (size_t)(at - back);
    }
    return (shd_sequence){.length = (uint16_t)length, .distance = (uint16_t)distance};
}

static void find_wide_matches(shd_matches *m, const unsigned char *data, size_t before, size_t size,
                              size_t pixel) {
    const unsigned char *const end = data + size, *at = data, *from = data;
    clear(m, 1 << WIDE_BITS);
    if (before < pixel) at += least(pixel, size);
    while (end - at >= WORD) {
        const shd_sequence q = find_wide(m, data, at, end, pixel);
        const unsigned char *const behind = at + (q.length ? q.length : 1);
        if (q.length) {
            add_sequence(m, from, end, (size_t)(at - from), q.length, q.distance);
            from = behind;
        }
        for (at++; at < behind && end - at >= WORD; at++)
            m->seen[hash_wide(load(at))] = (uint16_t)(at - data);
        at = behind;
    }
    add_sequence(m, from, end, (size_t)(end - from), 0, 0);
}

/* ---- Rows that are nearly all zeros ---- */

/* Which of VECTOR bytes are not zero, the first one lowest. */
static inline uint64_t find_others(const unsigned char *at) {
    uint64_t others = 0;
#if SHD_W > 8
    others = _mm512_test_epi8_mask(_mm512_loadu_si512(at), _mm512_set1_epi8(-1));
#elif SHD_W > 4
    for (int i = 0; i < VECTOR; i += 32) {
        const __m256i x = _mm256_loadu_si256((const __m256i *)(const void *)(at + i)),
                      zeros = _mm256_cmpeq_epi8(x, _mm256_setzero_si256());
        others |= (uint64_t)(uint32_t)~_mm256_movemask_epi8(zeros) << i;
    }
#elif defined(__SSE2__)
    for (int i = 0; i < VECTOR; i += 16) {
        const __m128i x = _mm_loadu_si128((const __m128i *)(const void *)(at + i)),
                      zeros = _mm_cmpeq_epi8(x, _mm_setzero_si128());
        others |= (uint64_t)(uint16_t)~_mm_movemask_epi8(zeros) << i;
    }
#else
    const uint64_t low = 0x7F7F7F7F7F7F7F7F, gather = 0x0102040810204080;
    for (int i = 0; i < VECTOR; i += WORD) { /* a byte's highest bit, then eight of these */
        const uint64_t x = load(at + i), high = (((x & low) + low) | x) & ~low;
        others |= ((high >> 7) * gather >> 56) << i;
    }
#endif
    return others;
}

/* How far the places of literals from `at` on are from the next, GAPS of them in two words: they
 * ascend, so that no difference borrows from its neighbor. */
enum { GAPS = 8 };
typedef struct gaps {
    uint64_t first, second;
} gaps;

static inline gaps find_gaps(const uint16_t *at) {
    const unsigned char *const from = (const unsigned char *)at, *const next =
                                                                     (const unsigned char *)(at +
                                                                                             1);
    return (gaps){load(next) - load(from), load(next + WORD) - load(from + WORD)};
}

/* Whether many literals are where ones were before, whose matches are worth more than runs. What is
 * asked about is chosen by how far GAPS are together, so that what repeats is chosen again. If that
 * is hardly any, few distances repeat all the time. */
static bool repeat_often(shd_matches *m) {
    enum { SEEN_BITS = 8, CHOSEN = 16, OFTEN = 4, FEW = 256 };
    const unsigned odd = 40503; /* Fibonacci hashing, as above */
    size_t asked = 0, found = 0;
    if (m->count < FEW) return false;
    memset(m->seen, 0, sizeof *m->seen << SEEN_BITS);
    for (size_t i = 1; i + GAPS < m->count; i++) {
        const uint16_t span = (uint16_t)(m->places[i + GAPS] - m->places[i]);
        if ((uint16_t)(span * odd) >= (UINT16_MAX + 1) / CHOSEN) continue;
        const gaps here = find_gaps(m->places + i);
        uint16_t *const seen =
            &m->seen[(here.first + 3 * here.second) * 0x9E3779B97F4A7C15u >> (64 - SEEN_BITS)];
        const gaps old = find_gaps(m->places + *seen);
        *seen = (uint16_t)i;
        asked++;
        found += here.first == old.first && here.second == old.second;
    }
    return OFTEN * found > asked || 2 * CHOSEN * asked < m->count;
}

static bool find_sparse(shd_matches *m, const unsigned char *data, size_t size) {
    enum { SPARSE = 8, AT_ONCE = 8 };
    const size_t most = size / SPARSE;
    size_t count = 0, i = 0;
    for (; i + VECTOR <= size; i += VECTOR) {
        uint64_t others = find_others(data + i);
        if (!others) continue;
        size_t at = count;
        count += (size_t)__builtin_popcountll(others);
        if (count > most) return false;
        for (; others; at += AT_ONCE) /* what is written too much is overwritten */
            for (size_t k = 0; k < AT_ONCE; k++, others &= others - 1) {
                const size_t place = i + (size_t)__builtin_ctzll(others | UINT64_C(1) << 63);
                m->places[at + k] = (uint16_t)place;
                m->literals[at + k] = data[place];
            }
    }
    for (; i < size; i++) {
        m->places[count] = (uint16_t)i;
        m->literals[count] = data[i];
        count += data[i] != 0;
    }
    m->count = m->literal_count = count;
    return count <= most && !repeat_often(m);
}

const shd_match_kernel SHD_VARIANT(shd_match_kernel) = {find_matches, find_wide_matches,
                                                        find_sparse};
