#include "image/deflate.h"

#include <endian.h>
#include <stdint.h>
#include <string.h>

#include "image/matches.h"
#include "image/prefix_code.h"

/* Symbols (RFC 1951, 3.2.5): bytes, the block's end and lengths; distances; and how sizes of codes
 * are told (3.2.7). */
enum { LITERALS = 286, END = 256, DISTANCES = 30, WAYS = 19, LONGEST_WAY = 7 };

/* The longest code where four of them are put at once. */
enum { SPARSE_LONGEST = 14 };

typedef struct block {
    shd_matches matches;
    uint32_t literals[4][LITERALS], distances[DISTANCES]; /* how often */
    uint32_t lengths[SHD_MATCH_LONGEST + 1];              /* as pack_symbol has them */
    uint32_t runs[SHD_RUN_LONGEST + 1];                   /* how often each is, if it is sparse */
    shd_prefix_code literal_code, distance_code;
} block;

size_t shd_deflate_room(void) {
    return sizeof(block);
}

/* ---- Symbols ---- */

static inline shd_symbol length_symbol(unsigned length) {
    const unsigned l = length - 3;
    if (length == SHD_MATCH_LONGEST) return (shd_symbol){285, 0, 0};
    if (l < 8) return (shd_symbol){257 + l, 0, 0};
    const unsigned extra = 29 - (unsigned)__builtin_clz(l);
    return (shd_symbol){257 + 4 * extra + (l >> extra), extra, l & ((1u << extra) - 1)};
}

/* A symbol's code and the bits behind it, above 8 bits of their number: 28 at most. */
static inline uint64_t pack_symbol(const shd_prefix_code *code, shd_symbol y) {
    const unsigned size = code->sizes[y.name];
    return (code->bits[y.name] | (uint64_t)y.value << size) << 8 | (size + y.extra);
}

static void count_literals(block *b) {
    const shd_matches *const m = &b->matches;
    memset(b->literals, 0, sizeof b->literals);
    size_t i = 0;
    for (; i + 4 <= m->literal_count; i += 4) /* into four, so that equal bytes do not wait */
        for (size_t k = 0; k < 4; k++) b->literals[k][m->literals[i + k]]++;
    for (; i < m->literal_count; i++) b->literals[0][m->literals[i]]++;
    for (i = 0; i < END; i++)
        b->literals[0][i] += b->literals[1][i] + b->literals[2][i] + b->literals[3][i];
}

/* What is longer than the longest run becomes one and matches that are as long. Returns these. */
static inline size_t cut_run(size_t *run) {
    const size_t matches = *run > SHD_RUN_LONGEST ? (*run - 1) / SHD_MATCH_LONGEST : 0;
    *run -= matches * SHD_MATCH_LONGEST;
    return matches;
}

/* Few zeros are literals, more are one and a match with it. Returns the match's length, or 0. */
static inline unsigned match_of_run(size_t run) {
    return run > SHD_MATCH_SHORTEST ? (unsigned)run - 1 : 0;
}

/* Counts the zeros of a block that is sparse, whose literals are counted. */
static void count_runs(block *b, size_t size) {
    shd_matches *const m = &b->matches;
    memset(m->lengths, 0, sizeof m->lengths);
    memset(m->distances, 0, sizeof m->distances);
    memset(b->runs, 0, sizeof b->runs);
    size_t behind = 0, matches = 0;
    for (size_t i = 0; i <= m->count; i++) {
        const size_t place = i < m->count ? m->places[i] : size;
        size_t run = place - behind;
        matches += cut_run(&run);
        b->runs[run]++;
        behind = place + 1;
    }
    m->lengths[SHD_MATCH_LONGEST] = (uint32_t)matches;
    for (size_t run = 1; run <= SHD_RUN_LONGEST; run++) {
        const unsigned match = match_of_run(run);
        b->literals[0][0] += b->runs[run] * (match ? 1 : (uint32_t)run);
        m->lengths[match] += b->runs[run];
        if (match) matches += b->runs[run];
    }
    m->distances[0] = (uint32_t)matches;
}

static void make_codes(block *b, unsigned longest) {
    uint32_t *const literals = b->literals[0];
    literals[END] = 1;
    for (unsigned l = SHD_MATCH_SHORTEST; l <= SHD_MATCH_LONGEST; l++)
        if (b->matches.lengths[l]) literals[length_symbol(l).name] += b->matches.lengths[l];
    memcpy(b->distances, b->matches.distances, sizeof b->distances);
    shd_prefix_code_make(literals, LITERALS, longest, &b->literal_code);
    shd_prefix_code_make(b->distances, DISTANCES, SHD_PREFIX_LONGEST, &b->distance_code);
    for (unsigned l = SHD_MATCH_SHORTEST; l <= SHD_MATCH_LONGEST; l++)
        if (b->matches.lengths[l])
            b->lengths[l] = (uint32_t)pack_symbol(&b->literal_code, length_symbol(l));
}

/* Bits of all sequences. */
static size_t find_bits(const block *b) {
    size_t bits = 0;
    for (unsigned i = 0; i < LITERALS; i++) {
        const unsigned extra = i < 265 || i == 285 ? 0 : (i - 261) / 4;
        bits += b->literals[0][i] * (b->literal_code.sizes[i] + extra);
    }
    for (unsigned i = 0; i < DISTANCES; i++)
        bits += b->distances[i] * (b->distance_code.sizes[i] + (i < 4 ? 0 : i / 2 - 1));
    return bits;
}

/* ---- Bits ---- */

typedef struct stream {
    unsigned char *at;
    uint64_t bits;
    unsigned count; /* of bits that wait, under 8 behind flush */
} stream;

static inline void put(stream *s, uint64_t bits, unsigned count) {
    s->bits |= bits << s->count;
    s->count += count;
}

/* Writes eight bytes, of which the whole ones stay: 56 bits may be put between two of these. */
static inline void flush(stream *s) {
    const uint64_t bits = htole64(s->bits);
    memcpy(s->at, &bits, sizeof bits);
    s->at += s->count / 8;
    s->bits >>= s->count & ~7u;
    s->count &= 7;
}

/* A size, or a run of them, and the number that says how long it is. */
typedef struct way {
    unsigned char name, value;
} way;

/* Tells sizes by runs of at most 138 zeros and 6 repeats (3.2.7). Returns the number of ways. */
static size_t tell_sizes(const unsigned char *sizes, size_t size, way *ways) {
    size_t count = 0;
    for (size_t i = 0, run; i < size; i += run) {
        for (run = 1; i + run < size && sizes[i + run] == sizes[i];) run++;
        if (!sizes[i] && run > 10) {
            if (run > 138) run = 138;
            ways[count++] = (way){18, (unsigned char)(run - 11)};
        } else if (!sizes[i] && run > 2) {
            ways[count++] = (way){17, (unsigned char)(run - 3)};
        } else {
            ways[count++] = (way){sizes[i], 0};
            if (run > 7) run = 7;
            if (run < 4)
                run = 1;
            else
                ways[count++] = (way){16, (unsigned char)(run - 4)};
        }
    }
    return count;
}

static void put_codes(const block *b, stream *s) {
    static const unsigned char order[WAYS] = {16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                              11, 4,  12, 3, 13, 2, 14, 1, 15};
    static const unsigned char extra[WAYS] = {[16] = 2, [17] = 3, [18] = 7};
    unsigned char sizes[LITERALS + DISTANCES];
    way ways[LITERALS + DISTANCES];
    shd_prefix_code code;
    memcpy(sizes, b->literal_code.sizes, LITERALS);
    memcpy(sizes + LITERALS, b->distance_code.sizes, DISTANCES);
    const size_t count = tell_sizes(sizes, sizeof sizes, ways);
    uint32_t counts[WAYS] = {0};
    for (size_t i = 0; i < count; i++) counts[ways[i].name]++;
    shd_prefix_code_make(counts, WAYS, LONGEST_WAY, &code);
    unsigned told = WAYS;
    while (!code.sizes[order[told - 1]]) told--;
    put(s, LITERALS - 257, 5);
    put(s, DISTANCES - 1, 5);
    put(s, told - 4, 4);
    for (unsigned i = 0; i < told; i++) {
        flush(s);
        put(s, code.sizes[order[i]], 3);
    }
    for (size_t i = 0; i < count; i++) {
        flush(s);
        put(s, code.bits[ways[i].name], code.sizes[ways[i].name]);
        put(s, ways[i].value, extra[ways[i].name]);
    }
    flush(s);
}

/* The codes of bytes and of the end, as pack_symbol has them. */
static void pack_literals(const block *b, uint32_t *packed) {
    for (unsigned i = 0; i <= END; i++)
        packed[i] = (uint32_t)b->literal_code.bits[i] << 8 | b->literal_code.sizes[i];
}

/* Seven bits that wait, a length of 20 and a distance of 28 are put at once. */
static void put_sequences(const block *b, const unsigned char *data, stream *out) {
    stream s = *out;
    uint32_t packed[END + 1];
    pack_literals(b, packed);
    for (size_t i = 0; i < b->matches.count; i++) {
        const shd_sequence q = b->matches.sequences[i];
        if (q.literals) {
            const unsigned char *const end = data + q.literals;
            for (; end - data >= 3; data += 3) {
                for (int k = 0; k < 3; k++) put(&s, packed[data[k]] >> 8, packed[data[k]] & 255);
                flush(&s);
            }
            for (; data < end; data++) put(&s, packed[*data] >> 8, packed[*data] & 255);
            flush(&s);
        }
        if (!q.length) continue;
        const uint64_t length = b->lengths[q.length],
                       back = pack_symbol(&b->distance_code, shd_distance_symbol(q.distance));
        put(&s, length >> 8 | back >> 8 << (length & 255), (unsigned)(length & 255) + (back & 255));
        flush(&s);
        data += q.length;
    }
    put(&s, b->literal_code.bits[END], b->literal_code.sizes[END]);
    flush(&s);
    *out = s;
}

/* What is put for a run of zeros, as pack_symbol has it: three codes at most. */
static uint64_t pack_run(const block *b, size_t run) {
    const unsigned match = match_of_run(run), size = b->literal_code.sizes[0];
    uint64_t bits = 0, count = 0;
    for (size_t i = match ? run - 1 : 0; i < run; i++, count += size)
        bits |= (uint64_t)b->literal_code.bits[0] << count;
    if (match) {
        bits |= (uint64_t)(b->lengths[match] >> 8) << count;
        count += (b->lengths[match] & 255) + 1; /* the only distance is a 0 */
    }
    return bits << 8 | count;
}

/* Seven bits that wait and four codes are put at once. Behind the last zeros is the end, as if it
 * were a byte. */
static void put_runs(const block *b, size_t size, stream *out) {
    const shd_matches *const m = &b->matches;
    stream s = *out;
    uint32_t packed[END + 1];
    uint64_t runs[SHD_RUN_LONGEST + 1];
    pack_literals(b, packed);
    for (size_t run = 0; run <= SHD_RUN_LONGEST; run++)
        runs[run] = b->runs[run] ? pack_run(b, run) : 0;
    size_t behind = 0;
    for (size_t i = 0; i <= m->count; i++) {
        const size_t place = i < m->count ? m->places[i] : size;
        const uint32_t byte = packed[i < m->count ? m->literals[i] : END];
        size_t run = place - behind, matches = cut_run(&run);
        uint64_t bits = runs[run] >> 8;
        unsigned count = runs[run] & 255;
        for (; matches; matches--) {
            put(&s, bits, count);
            flush(&s);
            bits = b->lengths[SHD_MATCH_LONGEST] >> 8;
            count = (b->lengths[SHD_MATCH_LONGEST] & 255) + 1;
        }
        put(&s, bits | (uint64_t)(byte >> 8) << count, count + (byte & 255));
        flush(&s);
        behind = place + 1;
    }
    *out = s;
}

/* ---- The block ---- */

/* Three bits of a stored block's head, and its size twice. */
static unsigned char *put_stored(stream *s, const unsigned char *data, size_t size, bool last) {
    put(s, last, 3);
    flush(s);
    unsigned char *out = s->at;
    if (s->count) *out++ = (unsigned char)s->bits;
    for (unsigned i = 0; i < 4; i++)
        *out++ = (unsigned char)((i < 2 ? size : ~size) >> 8 * (i & 1));
    if (size) memcpy(out, data, size);
    return out + size;
}

/* To tell the sizes of 316 codes takes 7 bits for each at most, and 20 bytes. What would take more
 * than its data behind them is stored. */
enum { CODES = 300, SEAM = 6, SLACK = 8 };
size_t shd_deflate_bound(size_t size) {
    return size + CODES + 2 * SEAM + SLACK;
}

size_t shd_deflate_block(shd_isa isa, void *room, const unsigned char *data, size_t before,
                         size_t size, size_t pixel, bool wide, bool last, unsigned char *out) {
    static const shd_match_kernel *const kernels[SHD_ISA_COUNT] = SHD_VARIANTS(shd_match_kernel);
    block *const b = room;
    stream s = {.at = out};
    const shd_match_kernel *const kernel = kernels[isa];
    /* Without their matches, samples of two bytes make files up to a third longer. */
    const bool sparse = !wide && kernel->find_sparse(&b->matches, data, size);
    if (!sparse) (wide ? kernel->find_wide : kernel->find)(&b->matches, data, before, size, pixel);
    count_literals(b);
    if (sparse) count_runs(b, size);
    make_codes(b, sparse ? SPARSE_LONGEST : SHD_PREFIX_LONGEST);
    if (find_bits(b) / 8 >= size) return (size_t)(put_stored(&s, data, size, last) - out);
    put(&s, last | 2 << 1, 3); /* with codes of its own */
    put_codes(b, &s);
    if (sparse)
        put_runs(b, size, &s);
    else
        put_sequences(b, data, &s);
    if (!last) return (size_t)(put_stored(&s, NULL, 0, false) - out);
    if (s.count) *s.at++ = (unsigned char)s.bits;
    return (size_t)(s.at - out);
}
