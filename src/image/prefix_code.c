#include "image/prefix_code.h"

#include <string.h>

/* A count and its symbol in one number, which is what is sorted by. */
enum { SYMBOL_BITS = 9, SYMBOL_MASK = (1 << SYMBOL_BITS) - 1, DIGIT_BITS = 8 };

/* Keys of what is counted, by count, then symbol. Returns how many there are. */
static size_t sort_counts(const uint32_t *counts, size_t size, uint32_t *keys) {
    enum { DIGITS = 1 << DIGIT_BITS, FEW = 32 };
    uint32_t other[SHD_PREFIX_SYMBOLS], all = 0;
    size_t used = 0;
    for (uint32_t i = 0; i < size; i++) {
        keys[used] = counts[i] << SYMBOL_BITS | i;
        used += counts[i] > 0;
        all |= counts[i];
    }
    if (used < FEW) { /* by insertion */
        for (size_t i = 1; i < used; i++) {
            const uint32_t key = keys[i];
            size_t at = i;
            for (; at > 0 && keys[at - 1] > key; at--) keys[at] = keys[at - 1];
            keys[at] = key;
        }
        return used;
    }
    for (int shift = SYMBOL_BITS; all; shift += DIGIT_BITS, all >>= DIGIT_BITS) {
        uint32_t starts[DIGITS + 1] = {0};
        for (size_t i = 0; i < used; i++) starts[(keys[i] >> shift & (DIGITS - 1)) + 1]++;
        for (size_t i = 0; i < DIGITS; i++) starts[i + 1] += starts[i];
        for (size_t i = 0; i < used; i++)
            other[starts[keys[i] >> shift & (DIGITS - 1)]++] = keys[i];
        memcpy(keys, other, used * sizeof *keys);
    }
    return used;
}

/* Ascending counts become the sizes of their codes, in place, n >= 2: Moffat and Katajainen,
 * "In-place calculation of minimum-redundancy codes", 1995. Three sweeps find each node's parent,
 * the depths of inner nodes, and how many leaves are at each depth. */
static void find_sizes(uint32_t *a, size_t n) {
    size_t root = 0, leaf = 0;
    for (size_t next = 0; next < n - 1; next++) {
        uint32_t sum = 0;
        for (int k = 0; k < 2; k++) {
            if (leaf >= n || (root < next && a[root] < a[leaf])) {
                sum += a[root];
                a[root++] = (uint32_t)next;
            } else
                sum += a[leaf++];
        }
        a[next] = sum;
    }
    a[n - 2] = 0;
    for (size_t i = n - 2; i-- > 0;) a[i] = a[a[i]] + 1;
    size_t inner = n - 1, at = n; /* inner nodes and leaves that are left, of n - 1 and n */
    uint32_t depth = 0;
    for (size_t nodes = 1; nodes; depth++) {
        size_t parents = 0;
        for (; inner && a[inner - 1] == depth; inner--) parents++;
        for (size_t i = parents; i < nodes; i++) a[--at] = depth;
        nodes = 2 * parents;
    }
}

/* Cuts codes to `longest` bits, sizes descending, and lengthens others until all fit, the rarest
 * first. What is then free goes to the most frequent. */
static void limit_sizes(uint32_t *sizes, size_t n, unsigned longest) {
    const uint32_t whole = 1u << longest;
    uint32_t taken = 0;
    for (size_t i = 0; i < n; i++) {
        if (sizes[i] > longest) sizes[i] = longest;
        taken += whole >> sizes[i];
    }
    for (size_t i = 0; taken > whole; taken -= whole >> ++sizes[i])
        for (i = 0; sizes[i] == longest; i++) {
        }
    for (size_t i = n; i-- > 0;)
        while (taken + (whole >> sizes[i]) <= whole) taken += whole >> sizes[i]--;
}

/* The first bit of a code is the first that is written. */
static inline uint16_t reverse(uint32_t number, unsigned size) {
    number = (number & 0x5555) << 1 | (number >> 1 & 0x5555);
    number = (number & 0x3333) << 2 | (number >> 2 & 0x3333);
    number = (number & 0x0F0F) << 4 | (number >> 4 & 0x0F0F);
    return (uint16_t)(((number & 0xFF) << 8 | number >> 8) >> (16 - size));
}

/* Codes of a size are numbers in a row, in the order of their symbols. */
static void number_codes(size_t size, shd_prefix_code *code) {
    uint32_t next[SHD_PREFIX_LONGEST + 2] = {0};
    for (size_t i = 0; i < size; i++)
        if (code->sizes[i]) next[code->sizes[i] + 1]++;
    for (int i = 1; i <= SHD_PREFIX_LONGEST; i++) next[i + 1] = (next[i] + next[i + 1]) << 1;
    for (size_t i = 0; i < size; i++)
        code->bits[i] = code->sizes[i] ? reverse(next[code->sizes[i]]++, code->sizes[i]) : 0;
}

void shd_prefix_code_make(const uint32_t *counts, size_t size, unsigned longest,
                          shd_prefix_code *code) {
    uint32_t keys[SHD_PREFIX_SYMBOLS], sizes[SHD_PREFIX_SYMBOLS];
    const size_t used = sort_counts(counts, size, keys);
    for (size_t i = 0; i < used; i++) sizes[i] = keys[i] >> SYMBOL_BITS;
    if (used > 1) {
        find_sizes(sizes, used);
        limit_sizes(sizes, used, longest);
    } else
        sizes[0] = 1;
    memset(code->sizes, 0, sizeof code->sizes);
    for (size_t i = 0; i < used; i++) code->sizes[keys[i] & SYMBOL_MASK] = (unsigned char)sizes[i];
    number_codes(size, code);
}
