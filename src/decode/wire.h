/* What the library and the program shaded-decode say to each other, over a socket that is the
 * program's standard input. Both are of one build.
 *
 *     library: shd_decode_ask, then the `size` bytes of a file
 *     program: shd_decode_told: what the file's head says, or what is wrong with it
 *     library: shd_decode_go: how much memory it may take from here on
 *     program: shd_decode_told again, and if its status is SHD_OK the samples behind it
 *
 * The program works on what strangers have sent: nothing that it says is believed unchecked. */
#pragma once

#include <stdint.h>

#include "base/format.h"

typedef struct shd_decode_ask {
    uint64_t abi; /* sizeof(shd_decode_told) */
    uint64_t size;
    uint64_t most;   /* pixels */
    uint64_t memory; /* bytes that it may take beside its libraries, until it is told to go on */
} shd_decode_ask;

typedef struct shd_decode_go {
    uint64_t memory;
} shd_decode_go;

/* Samples are [height][width][count] in native byte order: grey, or red, green and blue; then
 * alpha. */
typedef struct shd_decoded {
    int32_t width, height, count; /* count: 1 to 4 */
    int32_t alpha;                /* 1: the last sample of a pixel is alpha */
    int32_t associated;           /* 1: colors are multiplied by it */
    int32_t depth;                /* an shd_depth: SHD_U8, SHD_U16 or SHD_FLOAT */
} shd_decoded;

typedef struct shd_decode_told {
    uint64_t abi;
    int32_t status; /* SHD_OK; SHD_SCENE, SHD_LIMIT or SHD_EXHAUSTED with a text */
    shd_decoded picture;
    char text[256];
    int32_t confined; /* 1: the kernel holds the program to decode/confine.h */
} shd_decode_told;

/* Bytes of a sample of a depth that pictures are decoded to. */
static inline size_t shd_decoded_sample(int32_t depth) {
    return depth == SHD_U8 ? 1 : depth == SHD_U16 ? 2 : 4;
}
