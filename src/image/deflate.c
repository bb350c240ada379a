#include "image/deflate.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum {
    LITERALS = 288, /* literals and lengths; the last two are in no stream */
    DISTANCES = 30,
    BLOCK_END = 256,
    LENGTH_CODES = 19,
    LONGEST_CODE = 12, /* four of them fit into what a flush leaves free */
    LEAST_RUN = 8,     /* shorter ones do not pay */
    MOST_RUN = 258,
    STORED = 65535 /* bytes of a stored block */
};

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "bits are stored by the word");

/* `length` bytes at `start` that repeat what is before them. */
typedef struct run {
    uint32_t start, length;
} run;

size_t shd_deflate_bound(size_t size) {
    return size + 5 * (size / STORED + 2) + 16; /* stored; a flush writes whole words */
}

size_t shd_deflate_scratch(size_t size) {
    return (size / LEAST_RUN + 1) * sizeof(run);
}

/* ---- Bits. ---- */

typedef struct writer {
    uint64_t hold;
    unsigned bits; /* in hold; below 8 after a flush */
    unsigned char *at;
} writer;

static inline void put(writer *w, uint32_t value, unsigned bits) {
    w->hold |= (uint64_t)value << w->bits;
    w->bits += bits;
}

static inline void flush(writer *w) {
    memcpy(w->at, &w->hold, 8);
    w->at += w->bits >> 3;
    w->hold >>= w->bits & ~7u;
    w->bits &= 7;
}

/* ---- Codes. A code is (bits, first one lowest) << 4 | number of bits. ---- */

static int by_key(const void *a, const void *b) {
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* Counts the codes of each length of a Huffman code for `n` >= 2 rising frequencies, by Moffat and
 * Katajainen, "In-place calculation of minimum-redundancy codes" (1995). */
static void count_lengths(const uint64_t *keys, int n, unsigned count[64]) {
    uint64_t a[LITERALS] = {keys[0] >> 16, keys[1] >> 16};
    for (int i = 2; i < n; i++) a[i] = keys[i] >> 16;
    int leaf = 2, root = 0;
    a[0] += a[1];
    for (int next = 1; next < n - 1; next++) {
        for (int part = 0; part < 2; part++) {
            uint64_t weight;
            if (leaf >= n || (root < next && a[root] < a[leaf])) {
                weight = a[root];
                a[root++] = (uint64_t)next;
            } else {
                weight = a[leaf++];
            }
            a[next] = part ? a[next] + weight : weight;
        }
    }
    /* Parents' places become depths; then what is not a parent at a depth is a leaf. */
    a[n - 2] = 0;
    for (int next = n - 3; next >= 0; next--) a[next] = a[a[next]] + 1;
    int open = 1, used = 0, depth = 0;
    root = n - 2;
    while (open > 0) {
        while (root >= 0 && a[root] == (uint64_t)depth) used++, root--;
        count[depth < 63 ? depth : 63] += (unsigned)(open - used);
        open = 2 * used;
        used = 0;
        depth++;
    }
}

/* Makes room for codes that are too long by lengthening the longest of the others. */
static void limit_lengths(unsigned count[64], int longest) {
    uint32_t total = 0;
    for (int length = longest + 1; length < 64; length++) count[longest] += count[length];
    for (int length = 1; length <= longest; length++) total += count[length] << (longest - length);
    for (; total > 1u << longest; total--) {
        int length = longest - 1;
        while (!count[length]) length--;
        count[longest]--;
        count[length]--;
        count[length + 1] += 2;
    }
}

/* A prefix code for what has a frequency, of up to `longest` bits. One symbol alone has one bit. */
static void make_codes(const uint32_t *frequency, int symbols, int longest, uint16_t *codes) {
    uint64_t keys[LITERALS];
    unsigned count[64] = {0};
    int n = 0;
    memset(codes, 0, (size_t)symbols * sizeof *codes);
    for (int s = 0; s < symbols; s++)
        if (frequency[s]) keys[n++] = (uint64_t)frequency[s] << 16 | (uint64_t)s;
    if (n > 1) {
        qsort(keys, (size_t)n, sizeof *keys, by_key);
        count_lengths(keys, n, count);
        limit_lengths(count, longest);
    } else {
        count[1] = 1;
    }

    /* The rarest have the longest; among equals the code rises with the symbol. */
    for (int i = 0, length = longest; i < n; i++) {
        while (!count[length]) length--;
        count[length]--;
        codes[keys[i] & 0xffff] = (uint16_t)length;
    }
    unsigned lengths[16] = {0}, next[16] = {0};
    for (int s = 0; s < symbols; s++) lengths[codes[s]]++;
    lengths[0] = 0;
    for (int length = 1; length < 16; length++)
        next[length] = (next[length - 1] + lengths[length - 1]) << 1;
    for (int s = 0; s < symbols; s++) {
        unsigned length = codes[s], code = length ? next[length]++ : 0, turned = 0;
        for (unsigned bit = 0; bit < length; bit++)
            turned |= (code >> bit & 1) << (length - 1 - bit);
        codes[s] = (uint16_t)(turned << 4 | length);
    }
}

static inline void put_code(writer *w, uint16_t code) {
    put(w, code >> 4, code & 15);
}

/* ---- Lengths and distances (RFC 1951, 3.2.5). ---- */

typedef struct symbol {
    unsigned code, extra, value; /* `extra` bits of `value` follow the code */
} symbol;

static inline symbol length_symbol(unsigned length) {
    unsigned l = length - 3;
    if (length == MOST_RUN) return (symbol){285, 0, 0};
    if (l < 8) return (symbol){257 + l, 0, 0};
    unsigned extra = 29 - (unsigned)__builtin_clz(l);
    return (symbol){257 + 4 * extra + (l >> extra), extra, l & ((1u << extra) - 1)};
}

static symbol distance_symbol(unsigned distance) {
    if (distance < 5) return (symbol){distance - 1, 0, 0};
    return (symbol){distance < 7 ? 4 : 5, 1, (distance - 5) & 1};
}

/* The next part of a run, which leaves nothing too short. */
static inline uint32_t part_of(uint32_t length) {
    if (length <= MOST_RUN) return length;
    return length < MOST_RUN + 3 ? MOST_RUN - 3 : MOST_RUN;
}

/* ---- What a piece is made of. ---- */

static inline uint64_t load(const unsigned char *at) {
    uint64_t word;
    memcpy(&word, at, 8);
    return word;
}

/* A run of 8 or more begins where a word equals the one before it. Where it does not, none begins
 * up to the word's last byte that differs. */
static size_t find_runs(const unsigned char *data, size_t size, unsigned distance, run *runs) {
    size_t count = 0, i = distance;
    while (i + 8 <= size) {
        uint64_t differ = load(data + i) ^ load(data + i - distance);
        if (differ) {
            i += 8 - (size_t)__builtin_clzll(differ) / 8;
            continue;
        }
        size_t start = i;
        for (i += 8; i + 8 <= size; i += 8)
            if ((differ = load(data + i) ^ load(data + i - distance))) break;
        if (i + 8 <= size)
            i += (size_t)__builtin_ctzll(differ) / 8;
        else
            while (i < size && data[i] == data[i - distance]) i++;
        runs[count++] = (run){(uint32_t)start, (uint32_t)(i - start)};
    }
    return count;
}

/* Four counters a byte: equal neighbors do not wait for each other. */
static void count_bytes(const unsigned char *data, size_t size, uint32_t (*counts)[256]) {
    size_t i = 0;
    for (; i + 4 <= size; i += 4)
        for (size_t k = 0; k < 4; k++) counts[k][data[i + k]]++;
    for (; i < size; i++) counts[0][data[i]]++;
}

static void count_symbols(const unsigned char *data, size_t size, const run *runs, size_t run_count,
                          uint32_t frequency[LITERALS]) {
    uint32_t counts[4][256] = {{0}};
    size_t done = 0;
    memset(frequency, 0, LITERALS * sizeof *frequency);
    for (size_t r = 0; r < run_count; r++) {
        count_bytes(data + done, runs[r].start - done, counts);
        for (uint32_t left = runs[r].length; left; left -= part_of(left))
            frequency[length_symbol(part_of(left)).code]++;
        done = runs[r].start + runs[r].length;
    }
    count_bytes(data + done, size - done, counts);
    for (int s = 0; s < 256; s++)
        frequency[s] = counts[0][s] + counts[1][s] + counts[2][s] + counts[3][s];
    frequency[BLOCK_END] = 1;
}

/* ---- The table of codes (RFC 1951, 3.2.7). ---- */

/* Code lengths as symbols: 0..15 themselves, 16 repeats the last 3..6 times, 17 and 18 repeat
 * zeros 3..10 and 11..138 times. */
typedef struct table {
    unsigned char symbol[LITERALS + DISTANCES], extra[LITERALS + DISTANCES];
    int count, literals, distances, orders;
    uint16_t codes[LENGTH_CODES];
} table;

static const unsigned char extra_bits[LENGTH_CODES] = {[16] = 2, [17] = 3, [18] = 7};
static const unsigned char order[LENGTH_CODES] = {16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                                  11, 4,  12, 3, 13, 2, 14, 1, 15};

static void add_length(table *t, int length, int extra) {
    t->symbol[t->count] = (unsigned char)length;
    t->extra[t->count++] = (unsigned char)extra;
}

static void make_table(const uint16_t *literals, unsigned distance_code, table *t) {
    unsigned char lengths[LITERALS + DISTANCES] = {0};
    uint32_t frequency[LENGTH_CODES] = {0};
    *t = (table){.literals = BLOCK_END + 1, .distances = (int)distance_code + 1};
    for (int s = 0; s < 286; s++) {
        lengths[s] = literals[s] & 15;
        if (lengths[s] && s >= t->literals) t->literals = s + 1;
    }
    const int total = t->literals + t->distances;
    memset(lengths + t->literals, 0, DISTANCES);
    lengths[total - 1] = 1;
    for (int i = 0; i < total;) {
        int same = 1;
        while (i + same < total && lengths[i + same] == lengths[i]) same++;
        if (!lengths[i] && same >= 3) {
            same = same > 138 ? 138 : same;
            add_length(t, same < 11 ? 17 : 18, same < 11 ? same - 3 : same - 11);
        } else if (i && lengths[i] == lengths[i - 1] && same >= 3) {
            same = same > 6 ? 6 : same;
            add_length(t, 16, same - 3);
        } else {
            same = 1;
            add_length(t, lengths[i], 0);
        }
        i += same;
    }
    for (int i = 0; i < t->count; i++) frequency[t->symbol[i]]++;
    make_codes(frequency, LENGTH_CODES, 7, t->codes);
    t->orders = LENGTH_CODES;
    while (t->orders > 4 && !(t->codes[order[t->orders - 1]] & 15)) t->orders--;
}

static uint64_t table_bits(const table *t) {
    uint64_t bits = 3 + 5 + 5 + 4 + 3 * (uint64_t)t->orders;
    for (int i = 0; i < t->count; i++)
        bits += (t->codes[t->symbol[i]] & 15) + extra_bits[t->symbol[i]];
    return bits;
}

static void put_table(writer *w, const table *t) {
    put(w, 2 << 1, 3); /* not the last block; codes of its own */
    put(w, (uint32_t)t->literals - 257, 5);
    put(w, (uint32_t)t->distances - 1, 5);
    put(w, (uint32_t)t->orders - 4, 4);
    flush(w);
    for (int i = 0; i < t->orders; i++) {
        put(w, t->codes[order[i]] & 15, 3);
        flush(w);
    }
    for (int i = 0; i < t->count; i++) {
        put_code(w, t->codes[t->symbol[i]]);
        put(w, t->extra[i], extra_bits[t->symbol[i]]);
        flush(w);
    }
}

/* ---- Blocks. ---- */

static uint64_t body_bits(const uint32_t *frequency, const uint16_t *codes, unsigned distance) {
    uint64_t bits = 0;
    for (int s = 0; s <= BLOCK_END; s++) bits += (uint64_t)frequency[s] * (codes[s] & 15);
    for (int s = BLOCK_END + 1; s < 286; s++) {
        int extra = s < 265 || s == 285 ? 0 : (s - 261) / 4;
        bits += (uint64_t)frequency[s] * ((codes[s] & 15u) + (unsigned)extra + 1 + (distance > 4));
    }
    return bits;
}

static void put_literals(writer *w, const uint16_t *codes, const unsigned char *data, size_t size) {
    writer now = *w; /* bytes that are stored may be anything, but not what is local */
    size_t i = 0;
    for (; i + 4 <= size; i += 4) {
        for (size_t k = 0; k < 4; k++) put_code(&now, codes[data[i + k]]);
        flush(&now);
    }
    for (; i < size; i++) put_code(&now, codes[data[i]]);
    flush(&now);
    *w = now;
}

static void put_run(writer *w, const uint16_t *codes, symbol distance, uint32_t length) {
    for (uint32_t part; length; length -= part) {
        part = part_of(length);
        symbol s = length_symbol(part);
        put_code(w, codes[s.code]);
        put(w, s.value, s.extra);
        put(w, distance.value << 1, 1 + distance.extra); /* its one code is 0 */
        flush(w);
    }
}

static unsigned char *put_stored(const unsigned char *data, size_t size, unsigned char *out) {
    for (size_t done = 0; done < size;) {
        size_t some = size - done < STORED ? size - done : STORED;
        const unsigned char head[5] = {0, (unsigned char)some, (unsigned char)(some >> 8),
                                       (unsigned char)~some, (unsigned char)(~some >> 8)};
        memcpy(out, head, 5);
        memcpy(out + 5, data + done, some);
        out += 5 + some;
        done += some;
    }
    return out;
}

size_t shd_deflate_piece(const unsigned char *data, size_t size, unsigned distance, void *scratch,
                         unsigned char *out) {
    run *runs = scratch;
    uint32_t frequency[LITERALS];
    uint16_t codes[LITERALS];
    table t;
    size_t run_count = find_runs(data, size, distance, runs);
    count_symbols(data, size, runs, run_count, frequency);
    make_codes(frequency, LITERALS, LONGEST_CODE, codes);
    symbol far = distance_symbol(distance);
    make_table(codes, far.code, &t);

    uint64_t bits = table_bits(&t) + body_bits(frequency, codes, distance);
    if (bits / 8 + 5 >= size + 5 * (size / STORED + 1))
        return (size_t)(put_stored(data, size, out) - out);

    writer w = {0, 0, out};
    put_table(&w, &t);
    size_t done = 0;
    for (size_t r = 0; r < run_count; r++) {
        put_literals(&w, codes, data + done, runs[r].start - done);
        put_run(&w, codes, far, runs[r].length);
        done = runs[r].start + runs[r].length;
    }
    put_literals(&w, codes, data + done, size - done);
    put_code(&w, codes[BLOCK_END]);
    put(&w, 0, 3); /* an empty stored block, which begins at the next byte */
    flush(&w);
    if (w.bits) w.at++;
    static const unsigned char empty[4] = {0, 0, 0xFF, 0xFF};
    memcpy(w.at, empty, 4);
    return (size_t)(w.at + 4 - out);
}

void shd_deflate_end(unsigned char out[SHD_DEFLATE_END]) {
    out[0] = 3; /* the last block, fixed codes; the end's is 7 bits of 0 */
    out[1] = 0;
}
