#include "image/blocks.h"

#include <endian.h>
#include <stdint.h>
#include <string.h>

enum { LONGEST = 15, LENGTH_CODES = 19, LITERALS = 288, DISTANCES = 30, END_OF_BLOCK = 256 };

/* The bits that are not read yet; behind the last one are zeros. */
typedef struct reader {
    const unsigned char *at, *end;
    uint64_t bits; /* the next `count`, the least one first */
    unsigned count;
    size_t invented; /* bytes of zeros */
} reader;

/* So that there are 56 bits or more. What bits hold above `count` is what comes next again. */
static inline void refill_bits(reader *r) {
    if (r->end - r->at >= 8) {
        uint64_t next;
        memcpy(&next, r->at, sizeof next);
        r->bits |= le64toh(next) << r->count;
        r->at += (63 - r->count) / 8;
        r->count |= 56;
    }
    for (; r->count < 56; r->count += 8) {
        if (r->at < r->end)
            r->bits |= (uint64_t)*r->at++ << r->count;
        else
            r->invented++;
    }
}

static inline void skip_bits(reader *r, unsigned count) {
    r->bits >>= count;
    r->count -= count;
}

/* At most 16. */
static unsigned take_bits(reader *r, unsigned count) {
    refill_bits(r);
    const unsigned value = (unsigned)(r->bits & ((1u << count) - 1));
    skip_bits(r, count);
    return value;
}

/* Bits that were taken of [begin, at). */
static size_t place_of(const reader *r, const unsigned char *begin) {
    return 8 * ((size_t)(r->at - begin) + r->invented) - r->count;
}

static bool went_beyond(const reader *r) {
    return 8 * r->invented > r->count;
}

/* What a code's bits say, by the next `longest` bits: how many to skip, of the code and of the
 * number that follows it, and what it is. 0: there is no such code. */
typedef struct codes {
    unsigned longest;
    unsigned char of[1 << LONGEST];
} codes;

enum { SKIP = 31, MATCH = 32, END = 64 };

static unsigned reverse_bits(unsigned code, unsigned length) {
    unsigned out = 0;
    for (unsigned i = 0; i < length; i++) out |= (code >> i & 1) << (length - 1 - i);
    return out;
}

/* Makes codes from their lengths in bits (RFC 1951, 3.2.2). Length 0: the symbol has no code.
 * `more` goes into each symbol's entry, too. False: there are too many codes. */
static bool make_codes(const unsigned char *lengths, const unsigned char *more, size_t count,
                       codes *out) {
    unsigned of_length[LONGEST + 1] = {0}, next[LONGEST + 2] = {0};
    for (size_t i = 0; i < count; i++) of_length[lengths[i]]++;
    of_length[0] = 0;
    out->longest = 1;
    for (unsigned l = 1; l <= LONGEST; l++) {
        next[l + 1] = (next[l] + of_length[l]) << 1;
        if (next[l] + of_length[l] > 1u << l) return false;
        if (of_length[l]) out->longest = l;
    }
    memset(out->of, 0, (size_t)1 << out->longest);
    for (size_t i = 0; i < count; i++) {
        const unsigned length = lengths[i];
        if (!length) continue;
        for (unsigned at = reverse_bits(next[length]++, length); at < 1u << out->longest;
             at += 1u << length)
            out->of[at] = (unsigned char)(length + more[i]);
    }
    return true;
}

/* The tables of 3.2.5, as bits that follow a code. */
static bool make_literals(const unsigned char *lengths, size_t count, codes *out) {
    unsigned char more[LITERALS] = {[END_OF_BLOCK] = END};
    for (unsigned i = END_OF_BLOCK + 1; i < 286; i++)
        more[i] = (unsigned char)(MATCH + (i < 265 || i == 285 ? 0 : (i - 261) / 4));
    return make_codes(lengths, more, count, out);
}

static bool make_distances(const unsigned char *lengths, size_t count, codes *out) {
    unsigned char more[DISTANCES + 2];
    for (unsigned i = 0; i < sizeof more; i++) more[i] = (unsigned char)(i < 4 ? 0 : i / 2 - 1);
    return make_codes(lengths, more, count, out);
}

typedef struct walker {
    reader in;
    codes literals, distances;
} walker;

static bool read_fixed_codes(walker *w) {
    unsigned char lengths[LITERALS], fives[DISTANCES];
    memset(lengths, 8, sizeof lengths);
    memset(lengths + 144, 9, 112);
    memset(lengths + 256, 7, 24);
    memset(fives, 5, sizeof fives);
    return make_literals(lengths, LITERALS, &w->literals) &&
           make_distances(fives, DISTANCES, &w->distances);
}

/* 3.2.7: the codes' lengths are in a code of their own, in which 16 to 18 repeat. */
static bool read_lengths(reader *in, const codes *by, unsigned char *lengths, size_t count) {
    for (size_t i = 0; i < count;) {
        refill_bits(in);
        const unsigned entry = by->of[in->bits & ((1u << by->longest) - 1)], symbol = entry >> 3;
        if (!entry) return false;
        skip_bits(in, entry & 7);
        if (symbol < 16) {
            lengths[i++] = (unsigned char)symbol;
            continue;
        }
        const size_t times = symbol == 16   ? 3 + take_bits(in, 2)
                             : symbol == 17 ? 3 + take_bits(in, 3)
                                            : 11 + take_bits(in, 7);
        if (times > count - i || (symbol == 16 && !i)) return false;
        memset(lengths + i, symbol == 16 ? lengths[i - 1] : 0, times);
        i += times;
    }
    return true;
}

static bool read_dynamic_codes(walker *w) {
    static const unsigned char order[LENGTH_CODES] = {16, 17, 18, 0, 8,  7, 9,  6, 10, 5,
                                                      11, 4,  12, 3, 13, 2, 14, 1, 15};
    unsigned char lengths[LITERALS + DISTANCES], given[LENGTH_CODES] = {0}, more[LENGTH_CODES];
    const size_t literals = 257 + take_bits(&w->in, 5), distances = 1 + take_bits(&w->in, 5);
    const unsigned count = 4 + take_bits(&w->in, 4);
    for (unsigned i = 0; i < count; i++) given[order[i]] = (unsigned char)take_bits(&w->in, 3);
    for (unsigned i = 0; i < LENGTH_CODES; i++) more[i] = (unsigned char)(i << 3);
    return literals <= 286 && distances <= DISTANCES &&
           make_codes(given, more, LENGTH_CODES, &w->distances) &&
           read_lengths(&w->in, &w->distances, lengths, literals + distances) &&
           make_literals(lengths, literals, &w->literals) &&
           make_distances(lengths + literals, distances, &w->distances);
}

/* 3.2.4. */
static bool skip_stored(reader *in) {
    skip_bits(in, in->count % 8);
    const unsigned length = take_bits(in, 16), complement = take_bits(in, 16);
    if (length + complement != 0xFFFF) return false;
    /* What was read ahead goes back. */
    const size_t ahead = in->count / 8;
    if (ahead < in->invented) return false;
    in->at -= ahead - in->invented;
    in->bits = in->count = 0;
    in->invented = 0;
    if (length > (size_t)(in->end - in->at)) return false;
    in->at += length;
    return true;
}

/* A length's code with its bits, and a distance's, are 20 and 28 bits at most. */
static bool skip_symbols(walker *w) {
    reader in = w->in;
    const uint64_t literals = (1u << w->literals.longest) - 1;
    const uint64_t distances = (1u << w->distances.longest) - 1;
    unsigned entry;
    do {
        refill_bits(&in);
        entry = w->literals.of[in.bits & literals];
        skip_bits(&in, entry & SKIP);
        if (entry & MATCH) {
            entry = w->distances.of[in.bits & distances];
            skip_bits(&in, entry);
        }
        if (!entry || went_beyond(&in)) return false;
    } while (!(entry & END));
    w->in = in;
    return true;
}

static bool skip_block(walker *w, unsigned kind) {
    if (kind == 0) return skip_stored(&w->in);
    if (kind == 3) return false;
    return (kind == 1 ? read_fixed_codes(w) : read_dynamic_codes(w)) && skip_symbols(w);
}

bool shd_find_last_block(const unsigned char *data, size_t size, size_t *last, size_t *end) {
    walker w;
    w.in = (reader){.at = data, .end = data + size};
    for (bool is_last = false; !is_last;) {
        *last = place_of(&w.in, data);
        is_last = take_bits(&w.in, 1);
        if (!skip_block(&w, take_bits(&w.in, 2)) || went_beyond(&w.in)) return false;
    }
    *end = place_of(&w.in, data);
    return true;
}
