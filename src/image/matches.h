/* Where the bytes of a block of deflate (RFC 1951) were before, as deflate.h tells. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "image/deflate.h"

/* By RFC 1951, 3.2.5; two symbols of distances are never used. */
enum { SHD_MATCH_LONGEST = 258, SHD_MATCH_FARTHEST = 32768, SHD_MATCH_DISTANCES = 32 };
enum { SHD_MATCH_SHORTEST = 3, SHD_MATCH_SEEN = 1 << 14 };

/* Zeros in a row that are counted by how many they are. */
enum { SHD_RUN_LONGEST = SHD_MATCH_LONGEST };

/* Literals, and the match behind them. The last one has none. */
typedef struct shd_sequence {
    uint16_t literals, length, distance;
} shd_sequence;

typedef struct shd_matches {
    uint16_t seen[SHD_MATCH_SEEN]; /* where bytes of a hash were last seen */
    union {
        shd_sequence sequences[SHD_DEFLATE_BLOCK / SHD_MATCH_SHORTEST + 1];
        uint16_t places[SHD_DEFLATE_BLOCK + 1]; /* of literals that are not zero */
    };
    size_t count;
    unsigned char literals[SHD_DEFLATE_BLOCK + 32]; /* all of them, one behind the other */
    size_t literal_count;
    /* How often there is each length, and each symbol of distances. The last sequence counts as a
     * length of 0. */
    uint32_t lengths[SHD_MATCH_LONGEST + 1], distances[SHD_MATCH_DISTANCES];
} shd_matches;

/* A symbol and the bits behind it. */
typedef struct shd_symbol {
    unsigned name, extra, value;
} shd_symbol;

static inline shd_symbol shd_distance_symbol(unsigned distance) {
    const unsigned d = distance - 1, extra = 30 - (unsigned)__builtin_clz(d | 2);
    return (shd_symbol){2 * extra + (d >> extra), extra, d & ((1u << extra) - 1)};
}

/* One variant's functions; all find the same. */
typedef struct shd_match_kernel {
    /* Fills `m` with what is found in data[0..size), see shd_deflate_block. */
    void (*find)(shd_matches *m, const unsigned char *data, size_t before, size_t size,
                 size_t pixel);
    void (*find_wide)(shd_matches *m, const unsigned char *data, size_t before, size_t size,
                      size_t pixel);
    /* Finds the literals and the places of bytes that are not zero. False: they are too many for
     * what is between them to be told as runs alone. */
    bool (*find_sparse)(shd_matches *m, const unsigned char *data, size_t size);
} shd_match_kernel;

extern const shd_match_kernel shd_match_kernel_portable, shd_match_kernel_avx2,
    shd_match_kernel_avx512;
