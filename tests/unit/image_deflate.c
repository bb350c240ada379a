/* Blocks of deflate, read back by two libraries that know nothing of each other: what is written
 * fits, is read back, and may look at what was before and at nothing else. */
#include "unit/image/fixture.h"

#include <libdeflate.h>
#include <zlib.h>

#include "image/deflate.h"
#include "image/prefix_code.h"

/* Reads a stream, both ways, and compares. In memory of just their size, so that a sanitizer sees
 * what goes beyond. */
static void check_stream(const unsigned char *stream, size_t length, const unsigned char *data,
                         size_t size) {
    unsigned char *back = malloc(size + 1);
    size_t used, made;
    struct libdeflate_decompressor *d = libdeflate_alloc_decompressor();
    assert_int_equal(libdeflate_deflate_decompress_ex(d, stream, length, back, size, &used, &made),
                     LIBDEFLATE_SUCCESS);
    assert_true(used == length && made == size);
    assert_memory_equal(back, data, size);
    libdeflate_free_decompressor(d);

    z_stream z = {.next_in = (unsigned char *)(size_t)stream, .avail_in = (unsigned)length};
    memset(back, 0, size + 1);
    z.next_out = back;
    z.avail_out = (unsigned)size + 1;
    assert_int_equal(inflateInit2(&z, -15), Z_OK);
    assert_int_equal(inflate(&z, Z_FINISH), Z_STREAM_END);
    assert_true(z.total_in == length && z.total_out == size);
    assert_memory_equal(back, data, size);
    inflateEnd(&z);
    free(back);
}

/* Compresses in blocks of `step`. Returns the stream's bytes. */
static size_t check_as(const unsigned char *data, size_t size, size_t pixel, bool wide,
                       size_t step) {
    const size_t count = size ? (size + step - 1) / step : 1;
    unsigned char *exact = malloc(size ? size : 1), *room = malloc(shd_deflate_room());
    unsigned char *stream = malloc(count * shd_deflate_bound(step));
    memcpy(exact, data, size);
    memset(room, 0xA5, shd_deflate_room());
    size_t length = 0;
    for (size_t i = 0; i < count; i++) {
        const bool last = i + 1 == count;
        const size_t first = i * step, some = last ? size - first : step;
        unsigned char *out = malloc(shd_deflate_bound(some));
        size_t made = 0;
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) { /* all write the same */
            if (!shd_cpu_has(isa)) continue;
            const size_t some_made =
                shd_deflate_block(isa, room, exact + first, first, some, pixel, wide, last, out);
            assert_true(some_made <= shd_deflate_bound(some));
            if (made) assert_true(some_made == made && !memcmp(stream + length, out, made));
            made = some_made;
            memcpy(stream + length, out, made);
        }
        length += made;
        free(out);
    }
    check_stream(stream, length, exact, size);
    free(stream);
    free(room);
    free(exact);
    return length;
}

/* Also as samples of two bytes, if it may be. */
static size_t check(const unsigned char *data, size_t size, size_t pixel, size_t step) {
    if (pixel % 2 == 0) check_as(data, size, pixel, true, step);
    return check_as(data, size, pixel, false, step);
}

static uint32_t next(uint32_t *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return *seed >> 8;
}

/* Stretches of noise of some bits, runs of a pixel, copies from anywhere before, and zeros. */
static void fill(unsigned char *data, size_t size, uint32_t seed) {
    for (size_t i = 0; i < size;) {
        const uint32_t kind = next(&seed) % 5, bits = next(&seed) % 9;
        size_t some = 1 + next(&seed) % (next(&seed) % 8 ? 40 : 3000);
        const size_t back = 1 + next(&seed) % (kind == 1 ? 8 : 40000);
        for (; some && i < size; some--, i++) {
            const uint32_t noise = next(&seed) & ((1u << bits) - 1);
            data[i] = (unsigned char)(kind == 0               ? 0
                                      : kind < 3 && i >= back ? data[i - back]
                                                              : noise);
        }
    }
}

static void what_is_written_is_read(void **state) {
    (void)state;
    enum { MOST = 200000 };
    unsigned char *data = malloc(MOST);
    uint32_t seed = 7;
    for (int i = 0; i < 300; i++) {
        const size_t size = next(&seed) % (i % 10 ? 3000 : MOST);
        const size_t step = 1 + next(&seed) % (i % 3 ? SHD_DEFLATE_BLOCK : 1000);
        fill(data, size, seed);
        check(data, size, 1 + next(&seed) % 8, step);
    }
    free(data);
}

static void the_smallest_and_the_largest_are_read(void **state) {
    (void)state;
    unsigned char *data = malloc(SHD_DEFLATE_BLOCK);
    for (int value = 0; value < 256; value += 51) {
        memset(data, value, SHD_DEFLATE_BLOCK);
        for (size_t size = 0; size < 40; size++) check(data, size, 1 + size % 8, 40);
        assert_true(check(data, SHD_DEFLATE_BLOCK, 3, SHD_DEFLATE_BLOCK) < 200);
    }
    for (size_t i = 0; i < SHD_DEFLATE_BLOCK; i++) data[i] = (unsigned char)(i * 7 ^ i >> 8);
    check(data, SHD_DEFLATE_BLOCK, 8, SHD_DEFLATE_BLOCK);
    free(data);
}

/* Matches of each length, at the nearest and the farthest distance, and one farther. */
static void each_length_and_distance_is_read(void **state) {
    (void)state;
    enum { FARTHEST = 32768, SIZE = FARTHEST + 2000 };
    unsigned char *data = malloc(SIZE);
    uint32_t seed = 11;
    for (size_t length = 1; length <= 300; length += length < 40 ? 1 : 7)
        for (int over = -1; over <= 1; over++) {
            const size_t distance = (size_t)(FARTHEST + over);
            for (size_t i = 0; i < SIZE; i++) data[i] = (unsigned char)next(&seed);
            memcpy(data + 500 + distance, data + 500, length);
            check(data, SIZE, 4, SIZE);
        }
    for (size_t distance = 1; distance < 20000; distance += 1 + distance / 9) {
        for (size_t i = 0; i < SIZE; i++)
            data[i] = (unsigned char)(i < distance ? next(&seed) : data[i - distance]);
        check(data, SIZE, 3, SIZE);
    }
    free(data);
}

/* Differences of a grey that is told three times, of two bytes: the lower one is noise. */
static void samples_of_two_bytes_are_not_told_thrice(void **state) {
    (void)state;
    enum { PIXELS = 10000, SIZE = 6 * PIXELS };
    unsigned char *data = calloc(SIZE, 1);
    uint32_t seed = 13;
    for (size_t i = 0; i < PIXELS; i++) {
        const unsigned char value = (unsigned char)(next(&seed) & 127);
        for (size_t k = 1; k < 6; k += 2) data[6 * i + k] = value;
    }
    /* 7 bits of noise, and a match of the rest. */
    const size_t length = check_as(data, SIZE, 6, true, SIZE);
    assert_true(length * 8 < PIXELS * 12);
    assert_true(2 * length < check_as(data, SIZE, 6, false, SIZE));
    free(data);
}

/* Zeros with bytes in between: runs of each length, and of far more than a match has. */
static void each_run_of_zeros_is_read(void **state) {
    (void)state;
    unsigned char *data = calloc(SHD_DEFLATE_BLOCK, 1);
    uint32_t seed = 17;
    for (size_t most = 8; most <= SHD_DEFLATE_BLOCK; most *= 2) {
        memset(data, 0, SHD_DEFLATE_BLOCK);
        for (size_t at = next(&seed) % most, run = 0; at < SHD_DEFLATE_BLOCK; run++) {
            data[at] = (unsigned char)next(&seed);
            at += 1 + (run & 1 ? run / 2 % 800 : 8 + next(&seed) % most);
        }
        for (size_t size = SHD_DEFLATE_BLOCK - 70; size < SHD_DEFLATE_BLOCK; size += 23)
            check(data, size, 3, SHD_DEFLATE_BLOCK);
    }
    free(data);
}

/* Every byte is there, each twice as often as the next, so that codes would be as long as may be;
 * some runs are of three zeros, which are literals. */
static void rare_bytes_among_zeros_are_read(void **state) {
    (void)state;
    unsigned char *data = calloc(SHD_DEFLATE_BLOCK, 1);
    uint32_t seed = 19;
    for (size_t at = 0; at < SHD_DEFLATE_BLOCK; at += 10 + next(&seed) % (at % 64 ? 8 : 1)) {
        data[at] = (unsigned char)(1 + __builtin_ctz(next(&seed) | 1u << 20) * 12);
        if (next(&seed) % 4000 == 0 && at > 4) data[at - 4] = 255;
    }
    check(data, SHD_DEFLATE_BLOCK, 3, SHD_DEFLATE_BLOCK);
    free(data);
}

/* Few bytes among zeros that are the same again and again: matches say them all at once, where runs
 * would take eleven times what the first ones do. */
static void what_repeats_among_zeros_is_matched(void **state) {
    (void)state;
    enum { PERIOD = 6000 };
    unsigned char *data = calloc(SHD_DEFLATE_BLOCK, 1);
    uint32_t seed = 23;
    for (size_t at = 5; at < PERIOD; at += 9 + next(&seed) % 16)
        data[at] = (unsigned char)next(&seed);
    const size_t once = check(data, PERIOD, 3, SHD_DEFLATE_BLOCK);
    for (size_t at = PERIOD; at < SHD_DEFLATE_BLOCK; at++) data[at] = data[at - PERIOD];
    assert_true(check(data, SHD_DEFLATE_BLOCK, 3, SHD_DEFLATE_BLOCK) < 3 * once);
    for (size_t at = 0; at < SHD_DEFLATE_BLOCK; at++) data[at] = at % 12 ? 0 : 7;
    assert_true(check(data, SHD_DEFLATE_BLOCK, 3, SHD_DEFLATE_BLOCK) < 500);
    free(data);
}

/* Noise cannot be made smaller, and gets hardly longer. */
static void noise_is_stored(void **state) {
    (void)state;
    unsigned char *data = malloc(SHD_DEFLATE_BLOCK);
    uint32_t seed = 3;
    for (size_t i = 0; i < SHD_DEFLATE_BLOCK; i++) data[i] = (unsigned char)next(&seed);
    assert_int_equal(check(data, SHD_DEFLATE_BLOCK, 3, SHD_DEFLATE_BLOCK), SHD_DEFLATE_BLOCK + 5);
    free(data);
}

/* ---- Prefix codes ---- */

/* The least that any prefix code takes: two rarest become one, until one is left. */
static uint64_t least_bits(const uint32_t *counts, size_t size) {
    uint64_t weights[SHD_PREFIX_SYMBOLS], bits = 0;
    size_t n = 0;
    for (size_t i = 0; i < size; i++)
        if (counts[i]) weights[n++] = counts[i];
    if (n == 1) return weights[0];
    while (n > 1) {
        for (size_t k = 0; k < 2; k++) /* the two least to the end */
            for (size_t i = 0; i + 1 < n - k; i++)
                if (weights[i] < weights[n - 1 - k]) {
                    const uint64_t w = weights[i];
                    weights[i] = weights[n - 1 - k];
                    weights[n - 1 - k] = w;
                }
        weights[n - 2] += weights[n - 1];
        bits += weights[--n - 1];
    }
    return bits;
}

static void check_code(const uint32_t *counts, size_t size, unsigned longest, bool best) {
    shd_prefix_code code;
    memset(&code, 0xA5, sizeof code);
    shd_prefix_code_make(counts, size, longest, &code);
    uint64_t bits = 0, taken = 0;
    size_t used = 0;
    for (size_t i = 0; i < size; i++) {
        assert_int_equal(code.sizes[i] > 0, counts[i] > 0);
        if (!counts[i]) continue;
        assert_true(code.sizes[i] <= longest);
        used++;
        bits += (uint64_t)counts[i] * code.sizes[i];
        taken += UINT64_C(1) << (longest - code.sizes[i]);
        for (size_t k = 0; k < i; k++) { /* none begins as another does */
            if (!counts[k]) continue;
            const unsigned both = code.sizes[i] < code.sizes[k] ? code.sizes[i] : code.sizes[k];
            assert_true(((code.bits[i] ^ code.bits[k]) & ((1u << both) - 1)) != 0);
        }
    }
    if (used > 1) assert_true(taken == UINT64_C(1) << longest); /* readers want no gap */
    if (best) assert_true(bits == least_bits(counts, size));
}

static void codes_are_the_shortest(void **state) {
    (void)state;
    uint32_t counts[286], seed = 5;
    for (int round = 0; round < 200; round++) {
        const size_t size = 1 + next(&seed) % 286;
        for (size_t i = 0; i < size; i++)
            counts[i] = next(&seed) % 3 ? 1 + next(&seed) % (1u << next(&seed) % 8) : 0;
        check_code(counts, size, 15, true);
    }
    memset(counts, 0, sizeof counts);
    check_code(counts, 286, 15, false);
    counts[200] = 17;
    check_code(counts, 286, 15, true);
}

/* Fibonacci's numbers make the longest codes; they are cut to what is allowed, and stay whole. */
static void long_codes_are_cut(void **state) {
    (void)state;
    uint32_t counts[286] = {0}, a = 1, b = 1, seed = 9;
    for (size_t n = 2; n < 26; n++) {
        for (size_t i = 0, x = a = b = 1; i < n; i++, x = a + b, a = b, b = (uint32_t)x)
            counts[(i * 11) % 286] = (uint32_t)x;
        check_code(counts, 286, 15, n <= 16);
        check_code(counts, 286, 9, n <= 10);
    }
    for (int round = 0; round < 100; round++) {
        for (size_t i = 0; i < 19; i++) counts[i] = 1u << next(&seed) % 18;
        check_code(counts, 19, 7, false);
        for (size_t i = 0; i < 286; i++) counts[i] = i < 280 ? 1 : 1u << next(&seed) % 18;
        check_code(counts, 286, 9 + (unsigned)round % 7, false);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_written_is_read),
        cmocka_unit_test(the_smallest_and_the_largest_are_read),
        cmocka_unit_test(each_length_and_distance_is_read),
        cmocka_unit_test(samples_of_two_bytes_are_not_told_thrice),
        cmocka_unit_test(each_run_of_zeros_is_read),
        cmocka_unit_test(rare_bytes_among_zeros_are_read),
        cmocka_unit_test(what_repeats_among_zeros_is_matched),
        cmocka_unit_test(noise_is_stored),
        cmocka_unit_test(codes_are_the_shortest),
        cmocka_unit_test(long_codes_are_cut),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
