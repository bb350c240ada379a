#include "image/deflate.h"

#include <endian.h>
#include <stdint.h>
#include <string.h>

#include "image/prefix_code.h"

/* Symbols (RFC 1951, 3.2.5): bytes, the block's end and lengths; distances; and how sizes of codes
 * are told (3.2.7). */
enum { LITERALS = 286, END = 256, DISTANCES = 30, WAYS = 19, LONGEST_WAY = 7 };
enum { LONGEST = 258, FARTHEST = 32768 };

/* Matches that are taken. Shorter ones cost more than the numbers that they stand for: of 36
 * examples, these leave the fewest bytes for their time. */
enum { RUN = 8, REPEAT = 10 };

/* The same where samples are of two bytes, whose high ones hardly differ: runs of a pixel or of a
 * sample, repeats, and those of a grey pixel with colors, which a run stands for already. */
enum { WIDE_RUN = 3, WIDE_REPEAT = 6, WIDE_GREY = 8 };

/* Of a repeat or a short run, the first bytes are remembered. */
enum { HASH_BITS = 12, WIDE_BITS = 14, REMEMBERED = 4, SHORT_RUN = 16 };

/* After so many bytes in vain, repeats are looked for at one byte less often. */
enum { PATIENCE = 32, PATIENCE_MOST = 16 * PATIENCE };

/* Literals, and the match behind them. The last one has none. */
typedef struct sequence {
    uint16_t literals, length, distance;
} sequence;

typedef struct block {
    /* Where bytes of this hash were last seen: eight of them, or WIDE_REPEAT. */
    uint16_t seen[1 << WIDE_BITS];
    sequence sequences[SHD_DEFLATE_BLOCK / WIDE_RUN + 1];
    size_t count;
    uint32_t literals[4][LITERALS], distances[DISTANCES]; /* how often */
    uint32_t lengths[LONGEST + 1]; /* how often; then as pack_symbol has them */
    shd_prefix_code literal_code, distance_code;
} block;

size_t shd_deflate_room(void) {
    return sizeof(block);
}

/* ---- Matches ---- */

static inline uint64_t load(const unsigned char *at) {
    uint64_t v;
    memcpy(&v, at, sizeof v);
    return le64toh(v);
}

/* Fibonacci hashing: Knuth, The Art of Computer Programming 3, 6.4. */
static inline size_t hash(uint64_t v) {
    return v * 0x9E3779B97F4A7C15u >> (64 - HASH_BITS);
}

/* Whether 32 bytes are the same. */
static inline bool are_alike(const unsigned char *a, const unsigned char *b) {
    uint64_t differ = 0;
    for (int i = 0; i < 32; i += 8) differ |= load(a + i) ^ load(b + i);
    return !differ;
}

/* How many bytes from `at` are as those from `back`. The first eight are. Most matches are short,
 * or as long as they may be. */
static inline size_t measure(const unsigned char *at, const unsigned char *back,
                             const unsigned char *end) {
    enum { SHORT = 32 };
    const size_t most = end - at < LONGEST ? (size_t)(end - at) : LONGEST;
    size_t length = 8;
    for (; length + 8 <= most; length += 8) {
        const uint64_t differ = load(at + length) ^ load(back + length);
        if (differ) return length + (size_t)__builtin_ctzll(differ) / 8;
        if (length != SHORT) continue;
        while (length + 40 <= most && are_alike(at + length + 8, back + length + 8)) length += 32;
    }
    while (length < most && at[length] == back[length]) length++;
    return length;
}

static void add_sequence(block *b, const unsigned char *from, size_t literals, size_t length,
                         size_t distance) {
    b->sequences[b->count++] = (sequence){(uint16_t)literals, (uint16_t)length, (uint16_t)distance};
    size_t i = 0;
    for (; i + 4 <= literals; i += 4) /* into four, so that equal bytes do not wait */
        for (size_t k = 0; k < 4; k++) b->literals[k][from[i + k]]++;
    for (; i < literals; i++) b->literals[0][from[i]]++;
}

/* Where to look, and from where on bytes are literals. */
typedef struct cursor {
    const unsigned char *data, *end, *at, *from;
    const unsigned char *next; /* before it repeats are not looked for */
    size_t patience;
} cursor;

/* Remembers the first bytes of a match, the first of all excepted, and goes behind it. */
static inline void pass_match(block *b, cursor *c, size_t length) {
    const unsigned char *most = length < REMEMBERED ? c->at + length : c->at + REMEMBERED;
    if (most + 8 > c->end) most = c->end - 7;
    for (const unsigned char *at = c->at + 1; at < most; at++)
        b->seen[hash(load(at))] = (uint16_t)(at - c->data);
    c->from = c->at += length;
}

/* At bytes that are not as the pixel before. They may belong to the end of a longer match. */
static inline void try_repeat(block *b, cursor *c, uint64_t here) {
    uint16_t *const seen = &b->seen[hash(here)];
    const unsigned char *const back = c->data + *seen;
    *seen = (uint16_t)(c->at - c->data);
    size_t length = 0, more = 0;
    if (back < c->at && c->at - back <= FARTHEST && load(back) == here)
        length = measure(c->at, back, c->end);
    if (length < REPEAT) {
        c->next = ++c->at + c->patience / PATIENCE;
        if (c->patience < PATIENCE_MOST) c->patience++;
        return;
    }
    while (length + more < LONGEST && c->at - more > c->from && back - more > c->data &&
           c->at[-1 - (ptrdiff_t)more] == back[-1 - (ptrdiff_t)more])
        more++;
    add_sequence(b, c->from, (size_t)(c->at - c->from) - more, length + more,
                 (size_t)(c->at - back));
    pass_match(b, c, length);
    c->patience = 0;
}

static void find_matches(block *b, const unsigned char *data, size_t before, size_t size,
                         size_t pixel) {
    cursor c = {.data = data, .end = data + size, .at = data, .from = data, .next = data};
    memset(b->seen, 0, sizeof *b->seen << HASH_BITS);
    if (before < pixel) c.at += pixel; /* nothing is before the first pixel */
    while (c.at + 8 <= c.end) {
        const uint64_t here = load(c.at), differ = here ^ load(c.at - pixel);
        if (!differ) {
            const size_t length = measure(c.at, c.at - pixel, c.end);
            add_sequence(b, c.from, (size_t)(c.at - c.from), length, pixel);
            if (length <= SHORT_RUN)
                pass_match(b, &c, length);
            else
                c.from = c.at += length;
        } else if (c.at >= c.next) {
            try_repeat(b, &c, here);
        } else { /* no run of eight begins before the last byte that differs, or at it */
            const size_t step = 8 - (size_t)__builtin_clzll(differ) / 8,
                         left = (size_t)(c.next - c.at);
            c.at += step < left ? step : left;
        }
    }
    add_sequence(b, c.from, (size_t)(c.end - c.from), 0, 0);
}

/* ---- Matches of samples of two bytes ---- */

static inline size_t hash_wide(uint64_t v) {
    return (v << (64 - 8 * WIDE_REPEAT)) * 0x9E3779B97F4A7C15u >> (64 - WIDE_BITS);
}

/* How many bytes from `at`, which begin with `here`, are as those from `back`. */
static inline size_t count_alike(uint64_t here, const unsigned char *at, const unsigned char *back,
                                 const unsigned char *end) {
    const uint64_t differ = here ^ load(back);
    return differ ? (size_t)__builtin_ctzll(differ) / 8 : measure(at, back, end);
}

/* The longest match of those that are tried. Its length is 0 if there is none. */
static inline sequence find_wide(block *b, const cursor *c, size_t pixel) {
    enum { SAMPLE = 2, ENOUGH = 16 };
    const uint64_t here = load(c->at);
    size_t length = count_alike(here, c->at, c->at - pixel, c->end), distance = pixel;
    if (pixel > SAMPLE) {
        const size_t other = count_alike(here, c->at, c->at - SAMPLE, c->end);
        if (other > length) length = other, distance = SAMPLE;
    }
    if (length < WIDE_RUN) length = 0;
    uint16_t *const seen = &b->seen[hash_wide(here)];
    const unsigned char *const back = c->data + *seen;
    *seen = (uint16_t)(c->at - c->data);
    if (length < ENOUGH && back < c->at && c->at - back <= FARTHEST) {
        const uint64_t differ = here ^ here >> 8 * SAMPLE;
        /* Two samples are like the ones before them; that of alpha may be the first of all. */
        const bool grey =
            pixel > SAMPLE && (!(uint32_t)differ || !(uint32_t)(differ >> 8 * SAMPLE));
        const size_t other = count_alike(here, c->at, back, c->end);
        if (other >= (grey ? WIDE_GREY : WIDE_REPEAT) && other > length + 1)
            length = other, distance = (size_t)(c->at - back);
    }
    return (sequence){.length = (uint16_t)length, .distance = (uint16_t)distance};
}

static void find_wide_matches(block *b, const unsigned char *data, size_t before, size_t size,
                              size_t pixel) {
    cursor c = {.data = data, .end = data + size, .at = data, .from = data};
    memset(b->seen, 0, sizeof b->seen);
    if (before < pixel) c.at += pixel;
    while (c.at + 8 <= c.end) {
        const sequence q = find_wide(b, &c, pixel);
        const unsigned char *const behind = c.at + (q.length ? q.length : 1);
        if (q.length) {
            add_sequence(b, c.from, (size_t)(c.at - c.from), q.length, q.distance);
            c.from = behind;
        }
        for (c.at++; c.at < behind && c.at + 8 <= c.end; c.at++)
            b->seen[hash_wide(load(c.at))] = (uint16_t)(c.at - c.data);
        c.at = behind;
    }
    add_sequence(b, c.from, (size_t)(c.end - c.from), 0, 0);
}

/* ---- Symbols ---- */

/* A symbol and the bits behind it. */
typedef struct symbol {
    unsigned name, extra, value;
} symbol;

static inline symbol length_symbol(unsigned length) {
    const unsigned l = length - 3;
    if (length == LONGEST) return (symbol){285, 0, 0};
    if (l < 8) return (symbol){257 + l, 0, 0};
    const unsigned extra = 29 - (unsigned)__builtin_clz(l);
    return (symbol){257 + 4 * extra + (l >> extra), extra, l & ((1u << extra) - 1)};
}

static inline symbol distance_symbol(unsigned distance) {
    const unsigned d = distance - 1;
    if (d < 4) return (symbol){d, 0, 0};
    const unsigned extra = 30 - (unsigned)__builtin_clz(d);
    return (symbol){2 * extra + (d >> extra), extra, d & ((1u << extra) - 1)};
}

static void make_codes(block *b) {
    uint32_t *const literals = b->literals[0];
    for (size_t i = 0; i < LITERALS; i++)
        literals[i] += b->literals[1][i] + b->literals[2][i] + b->literals[3][i];
    literals[END] = 1;
    unsigned distance = 0, name = 0; /* mostly the same */
    for (size_t i = 0; i + 1 < b->count; i++) {
        const sequence *q = &b->sequences[i];
        b->lengths[q->length]++;
        if (q->distance != distance) name = distance_symbol(distance = q->distance).name;
        b->distances[name]++;
    }
    for (unsigned l = 3; l <= LONGEST; l++)
        if (b->lengths[l]) literals[length_symbol(l).name] += b->lengths[l];
    shd_prefix_code_make(literals, LITERALS, SHD_PREFIX_LONGEST, &b->literal_code);
    shd_prefix_code_make(b->distances, DISTANCES, SHD_PREFIX_LONGEST, &b->distance_code);
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

/* A symbol's code and the bits behind it, above 8 bits of their number: 28 at most. */
static inline uint64_t pack_symbol(const shd_prefix_code *code, symbol y) {
    const unsigned size = code->sizes[y.name];
    return (code->bits[y.name] | (uint64_t)y.value << size) << 8 | (size + y.extra);
}

static inline void put_packed(stream *s, uint64_t packed) {
    put(s, packed >> 8, packed & 255);
}

static void put_sequences(block *b, const unsigned char *data, stream *out) {
    stream s = *out;
    uint32_t packed[256];
    for (unsigned i = 0; i < 256; i++)
        packed[i] = (uint32_t)b->literal_code.bits[i] << 8 | b->literal_code.sizes[i];
    for (unsigned l = 3; l <= LONGEST; l++)
        if (b->lengths[l])
            b->lengths[l] = (uint32_t)pack_symbol(&b->literal_code, length_symbol(l));
    unsigned distance = 0;
    uint64_t back = 0;
    for (size_t i = 0; i < b->count; i++) {
        const sequence q = b->sequences[i];
        const unsigned char *const end = data + q.literals;
        for (; end - data >= 3; data += 3) {
            for (int k = 0; k < 3; k++) put(&s, packed[data[k]] >> 8, packed[data[k]] & 255);
            flush(&s);
        }
        for (; data < end; data++) put(&s, packed[*data] >> 8, packed[*data] & 255);
        flush(&s);
        if (!q.length) continue;
        if (q.distance != distance)
            back = pack_symbol(&b->distance_code, distance_symbol(distance = q.distance));
        put_packed(&s, b->lengths[q.length]);
        put_packed(&s, back);
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

size_t shd_deflate_block(void *room, const unsigned char *data, size_t before, size_t size,
                         size_t pixel, bool wide, bool last, unsigned char *out) {
    block *const b = room;
    stream s = {.at = out};
    b->count = 0;
    memset(b->literals, 0, sizeof b->literals);
    memset(b->distances, 0, sizeof b->distances);
    memset(b->lengths, 0, sizeof b->lengths);
    (wide ? find_wide_matches : find_matches)(b, data, before, size, pixel);
    make_codes(b);
    if (find_bits(b) / 8 >= size) return (size_t)(put_stored(&s, data, size, last) - out);
    put(&s, last | 2 << 1, 3); /* with codes of its own */
    put_codes(b, &s);
    put_sequences(b, data, &s);
    if (!last) return (size_t)(put_stored(&s, NULL, 0, false) - out);
    if (s.count) *s.at++ = (unsigned char)s.bits;
    return (size_t)(s.at - out);
}
