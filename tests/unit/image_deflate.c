/* Pieces of deflate streams: what libdeflate makes of them is what went in, and no larger than
 * said. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <libdeflate.h>

#include "image/deflate.h"

static uint32_t next_random(uint32_t *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return *seed >> 8;
}

/* Compresses pieces of `piece` bytes, inflates the stream, compares; returns its size. */
static size_t round_trip(const unsigned char *data, size_t size, size_t piece, unsigned distance) {
    const size_t bound = shd_deflate_bound(piece), pieces = (size + piece - 1) / piece;
    unsigned char *stream = malloc(pieces * bound + SHD_DEFLATE_END), *room = malloc(bound);
    void *scratch = malloc(shd_deflate_scratch(piece));
    size_t length = 0, got = 0;
    for (size_t done = 0; done < size; done += piece) {
        size_t some = size - done < piece ? size - done : piece;
        size_t bytes = shd_deflate_piece(data + done, some, distance, scratch, room);
        assert_true(bytes <= shd_deflate_bound(some));
        memcpy(stream + length, room, bytes);
        length += bytes;
    }
    shd_deflate_end(stream + length);
    length += SHD_DEFLATE_END;

    unsigned char *back = malloc(size);
    struct libdeflate_decompressor *d = libdeflate_alloc_decompressor();
    assert_int_equal(libdeflate_deflate_decompress(d, stream, length, back, size, &got), 0);
    assert_int_equal(got, size);
    assert_memory_equal(back, data, size);
    libdeflate_free_decompressor(d);
    free(back);
    free(room);
    free(scratch);
    free(stream);
    return length;
}

static void every_small_size_comes_back(void **state) {
    (void)state;
    unsigned char data[700];
    uint32_t seed = 1;
    for (int kind = 0; kind < 5; kind++)
        for (size_t size = 1; size <= sizeof data; size += size < 40 ? 1 : 13)
            for (unsigned distance = 1; distance <= 8; distance++) {
                for (size_t i = 0; i < size; i++) {
                    uint32_t r = next_random(&seed);
                    data[i] = (unsigned char)(kind == 0   ? 0
                                              : kind == 1 ? r
                                              : kind == 2 ? r % 2
                                              : kind == 3 ? i % distance
                                                          : (r % 9 ? 0 : r));
                }
                round_trip(data, size, size, distance);
                round_trip(data, size, 1 + size / 3, distance);
            }
}

/* Around the lengths that need several matches. */
static void runs_of_every_length_come_back(void **state) {
    (void)state;
    unsigned char data[1700];
    for (unsigned distance = 1; distance <= 8; distance++)
        for (size_t length = 1; length < 1600; length += length < 800 ? 1 : 37) {
            memset(data, 1, 50);
            for (size_t i = 0; i < length; i++) data[50 + i] = (unsigned char)(7 + i % distance);
            memset(data + 50 + length, 2, 50);
            round_trip(data, length + 100, length + 100, distance);
            round_trip(data + 50, length, length, distance);
        }
}

/* Frequencies as Fibonacci's numbers ask for codes as long as there are symbols. */
static void codes_of_any_steepness_fit_their_limit(void **state) {
    (void)state;
    enum { MOST = 1 << 22 };
    unsigned char *data = malloc(MOST);
    for (int symbols = 2; symbols < 31; symbols++) {
        size_t size = 0, a = 1, b = 1;
        for (int s = 0; s < symbols; s++) {
            for (size_t i = 0; i < a && size < MOST; i++) data[size++] = (unsigned char)(s * 7);
            size_t sum = a + b;
            a = b;
            b = sum;
        }
        /* Neighbors differ, so that there are no runs. */
        uint32_t seed = (uint32_t)symbols;
        for (size_t i = size; i-- > 1;) {
            size_t j = (size_t)next_random(&seed) * 256 % (i + 1);
            unsigned char swapped = data[i];
            data[i] = data[j];
            data[j] = swapped;
        }
        round_trip(data, size, size, 3);
    }
    free(data);
}

static void noise_is_stored(void **state) {
    (void)state;
    enum { SIZE = 200000 };
    unsigned char *data = malloc(SIZE);
    uint32_t seed = 5;
    for (size_t i = 0; i < SIZE; i++) data[i] = (unsigned char)next_random(&seed);
    size_t length = round_trip(data, SIZE, SIZE, 3);
    assert_true(length <= SIZE + 5 * (SIZE / 65535 + 1) + SHD_DEFLATE_END);
    for (size_t size = 65530; size < 65541; size++) round_trip(data, size, size, 4);
    free(data);
}

static void nothing_takes_nearly_nothing(void **state) {
    (void)state;
    enum { SIZE = 1 << 20 };
    unsigned char *data = calloc(SIZE, 1);
    assert_true(round_trip(data, SIZE, SIZE, 3) < SIZE / 800);
    assert_true(round_trip(data, 4, 4, 3) < 30);
    free(data);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_small_size_comes_back),
        cmocka_unit_test(runs_of_every_length_come_back),
        cmocka_unit_test(codes_of_any_steepness_fit_their_limit),
        cmocka_unit_test(noise_is_stored),
        cmocka_unit_test(nothing_takes_nearly_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
