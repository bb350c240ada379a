/* Prefix codes of deflate (RFC 1951, 3.2.2). Pure, any thread. */
#pragma once

#include <stddef.h>
#include <stdint.h>

enum { SHD_PREFIX_SYMBOLS = 288, SHD_PREFIX_LONGEST = 15 };

/* The bits of each symbol, the first one lowest, and how many they are: 0 if it has no code. */
typedef struct shd_prefix_code {
    uint16_t bits[SHD_PREFIX_SYMBOLS];
    unsigned char sizes[SHD_PREFIX_SYMBOLS];
} shd_prefix_code;

/* Makes the code that tells symbols which are counted so often in the fewest bits, none longer than
 * `longest`. size <= SHD_PREFIX_SYMBOLS <= 2^longest; counts are under 2^18. A symbol that is the
 * only one gets one bit. */
void shd_prefix_code_make(const uint32_t *counts, size_t size, unsigned longest,
                          shd_prefix_code *code);
