#include "image/deflate.h"

#include <endian.h>
#include <stdint.h>
#include <string.h>

#include "image/matches.h"
#include "image/prefix_code.h"

/* Symbols (RFC 1951, 3.2.5): bytes, the block's end and lengths; distances; and how sizes of codes
 * are told (3.2.7). */
enum { LITERALS = 286, END = 256, DISTANCES = 30, WAYS = 19, LONGEST_WAY = 7 };

typedef struct block {
    shd_matches matches;
    uint32_t literals[4][LITERALS], distances[DISTANCES]; /* how often */
    uint32_t lengths[SHD_MATCH_LONGEST + 1];              /* as pack_symbol has them */
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

static void make_codes(block *b) {
    uint32_t *const literals = b->literals[0];
    count_literals(b);
    literals[END] = 1;
    for (unsigned l = SHD_MATCH_SHORTEST; l <= SHD_MATCH_LONGEST; l++)
        if (b->matches.lengths[l]) literals[length_symbol(l).name] += b->matches.lengths[l];
    memcpy(b->distances, b->matches.distances, sizeof b->distances);
    shd_prefix_code_make(literals, LITERALS, SHD_PREFIX_LONGEST, &b->literal_code);
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

/* Seven bits that wait, a length of 20 and a distance of 28 are put at once. */
static void put_sequences(const block *b, const unsigned char *data, stream *out) {
    stream s = *out;
    uint32_t packed[256];
    for (unsigned i = 0; i < 256; i++)
        packed[i] = (uint32_t)b->literal_code.bits[i] << 8 | b->literal_code.sizes[i];
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
    (wide ? kernels[isa]->find_wide : kernels[isa]->find)(&b->matches, data, before, size, pixel);
    make_codes(b);
    if (find_bits(b) / 8 >= size) return (size_t)(put_stored(&s, data, size, last) - out);
    put(&s, last | 2 << 1, 3); /* with codes of its own */
    put_codes(b, &s);
    put_sequences(b, data, &s);
    if (!last) return (size_t)(put_stored(&s, NULL, 0, false) - out);
    if (s.count) *s.at++ = (unsigned char)s.bits;
    return (size_t)(s.at - out);
}
