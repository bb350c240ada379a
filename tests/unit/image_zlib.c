/* zlib streams in pieces: what goes in comes out, in the same bytes whoever compresses, and whoever
 * waits for a long one can leave. */
#include "unit/image/fixture.h"

#include <libdeflate.h>

#include "base/pool.h"
#include "image/blocks.h"
#include "image/deflate.h"
#include "image/zlib.h"

/* Of `small` and of the usual one. */
enum { SMALL_PIECE = 200 << 10, PIECE = SHD_DEFLATE_BLOCK, LONG = 9 * SMALL_PIECE + 12345 };

/* Noise, sparse bytes, repeats and nothing, in stretches of several thousand bytes. */
static unsigned char *make_data(size_t size, uint32_t seed) {
    unsigned char *data = malloc(size + 1);
    assert_non_null(data);
    for (size_t i = 0; i < size; i++) {
        seed = seed * 1664525u + 1013904223u;
        const unsigned r = seed >> 24, kind = (unsigned)(i / 7000 + seed / (1u << 30) / 4) % 4;
        data[i] = (unsigned char)(kind == 0 ? r : kind == 1 ? r & 3 : kind == 2 ? i % 97 : 0);
    }
    return data;
}

/* ---- Where a stream's last block is. ---- */

static void check_last_block(struct libdeflate_compressor *compressor, const unsigned char *data,
                             size_t size) {
    const size_t bound = libdeflate_deflate_compress_bound(compressor, size);
    unsigned char *stream = malloc(bound + 8), *back = malloc(size + 1);
    const size_t length = libdeflate_deflate_compress(compressor, data, size, stream, bound);
    memset(stream + length, 0xA5, 8); /* is not looked at */
    size_t last, end, other_last, other_end, used, made;
    assert_true(shd_find_last_block(stream, length, &last, &end));
    assert_int_equal((end + 7) / 8, length);
    assert_true(last + 3 <= end);
    assert_true(shd_find_last_block(stream, length + 8, &other_last, &other_end));
    assert_true(other_last == last && other_end == end);

    struct libdeflate_decompressor *d = libdeflate_alloc_decompressor();
    assert_int_equal(libdeflate_deflate_decompress_ex(d, stream, length, back, size, &used, &made),
                     LIBDEFLATE_SUCCESS);
    assert_true(used == length && made == size);
    /* It is the bit: a reader that does not see it wants more. */
    assert_true(stream[last / 8] >> last % 8 & 1);
    stream[last / 8] ^= (unsigned char)(1u << last % 8);
    assert_int_equal(libdeflate_deflate_decompress_ex(d, stream, length, back, size, &used, &made),
                     LIBDEFLATE_BAD_DATA);
    assert_false(shd_find_last_block(stream, length, &last, &end));
    libdeflate_free_decompressor(d);
    free(back);
    free(stream);
}

static void the_last_block_is_found(void **state) {
    (void)state;
    static const size_t sizes[] = {0, 1, 2, 60, 1000, 70000, 400000};
    unsigned char *data = make_data(400000, 1);
    for (int level = 0; level <= 12; level += 2) {
        struct libdeflate_compressor *compressor = libdeflate_alloc_compressor(level);
        for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++)
            check_last_block(compressor, data, sizes[i]);
        libdeflate_free_compressor(compressor);
    }
    free(data);
}

/* In memory of just their size, so that a sanitizer sees what reads on. */
static bool is_stream(const unsigned char *data, size_t size) {
    unsigned char *exact = malloc(size ? size : 1);
    size_t last, end;
    memcpy(exact, data, size);
    const bool is = shd_find_last_block(exact, size, &last, &end);
    if (is) assert_true(last < end && end <= 8 * size);
    free(exact);
    return is;
}

static void what_is_no_stream_is_none(void **state) {
    (void)state;
    enum { SIZE = 30000 };
    unsigned char *data = make_data(SIZE, 2);
    for (int level = 0; level <= 2; level += 2) {
        struct libdeflate_compressor *compressor = libdeflate_alloc_compressor(level);
        const size_t bound = libdeflate_deflate_compress_bound(compressor, SIZE);
        unsigned char *stream = malloc(bound);
        const size_t length = libdeflate_deflate_compress(compressor, data, SIZE, stream, bound);
        for (size_t size = 0; size < length; size += 1 + size / 50)
            assert_false(is_stream(stream, size));
        assert_false(is_stream(stream, length - 1));
        for (size_t bit = 0; bit < 8 * length; bit += 1 + bit / 100) {
            stream[bit / 8] ^= (unsigned char)(1u << bit % 8);
            is_stream(stream, length); /* it may be another one */
            stream[bit / 8] ^= (unsigned char)(1u << bit % 8);
        }
        assert_true(is_stream(stream, length));
        libdeflate_free_compressor(compressor);
        free(stream);
    }
    for (unsigned head = 0; head < 256; head++) {
        memset(data, 0xFF, 64);
        data[0] = (unsigned char)head;
        is_stream(data, 64);
        memset(data + 1, 0, 63);
        is_stream(data, 64);
    }
    free(data);
}

/* ---- Streams. ---- */

static shd_status compress(const shd_image *image, const unsigned char *data, size_t size,
                           shd_bytes *out) {
    shd_arena *scratch = shd_arena_new(1 << 26);
    shd_bytes stream = {NULL, 0};
    shd_error error;
    const shd_status status = shd_zlib_compress(image, (shd_bytes){(void *)(size_t)data, size}, 3,
                                                false, scratch, &stream, &error);
    *out = (shd_bytes){NULL, 0};
    if (status == SHD_OK) {
        *out = (shd_bytes){malloc(stream.size), stream.size};
        memcpy(out->data, stream.data, stream.size);
    }
    shd_arena_drop(scratch);
    return status;
}

static void what_goes_in_comes_out(void **state) {
    (void)state;
    static const size_t sizes[] = {0,         1,           5000,     PIECE - 1,       PIECE,
                                   PIECE + 1, SMALL_PIECE, LONG / 2, 2 * PIECE + 100, LONG};
    static const char *const compressions[] = {NULL, "fast", "small"};
    unsigned char *data = make_data(LONG, 3), *back = malloc(LONG);
    shd_image image = picture(NULL, 1, 1);
    struct libdeflate_decompressor *d = libdeflate_alloc_decompressor();
    for (size_t n = 0; n < 3 * sizeof sizes / sizeof sizes[0]; n++) {
        const size_t i = n / 3;
        image.compression = compressions[n % 3];
        shd_bytes stream;
        size_t used, made;
        assert_int_equal(compress(&image, data, sizes[i], &stream), SHD_OK);
        assert_int_equal(libdeflate_zlib_decompress_ex(d, stream.data, stream.size, back, sizes[i],
                                                       &used, &made),
                         LIBDEFLATE_SUCCESS);
        assert_true(used == stream.size && made == sizes[i]);
        assert_memory_equal(back, data, made);
        free(stream.data);
    }
    libdeflate_free_decompressor(d);
    free(back);
    free(data);
}

static void one_small_piece_is_what_libdeflate_makes_of_it(void **state) {
    (void)state;
    unsigned char *data = make_data(SMALL_PIECE, 4);
    shd_image image = picture(NULL, 1, 1);
    image.compression = "small";
    struct libdeflate_compressor *compressor = libdeflate_alloc_compressor(10);
    const size_t bound = libdeflate_zlib_compress_bound(compressor, SMALL_PIECE);
    unsigned char *whole = malloc(bound);
    for (size_t size = 0; size <= SMALL_PIECE; size = 2 * size + 1) {
        shd_bytes stream;
        assert_int_equal(compress(&image, data, size, &stream), SHD_OK);
        assert_int_equal(stream.size,
                         libdeflate_zlib_compress(compressor, data, size, whole, bound));
        assert_memory_equal(stream.data, whole, stream.size);
        free(stream.data);
    }
    libdeflate_free_compressor(compressor);
    free(whole);
    free(data);
}

static void spread(void *context, size_t count,
                   void (*run)(void *work, size_t index, unsigned slot), void *work) {
    shd_pool_for(context, count, run, work);
}

static void check_threads(const char *compression) {
    unsigned char *data = make_data(LONG, 5);
    shd_image image = picture(NULL, 1, 1);
    shd_bytes wanted, got;
    image.compression = compression;
    assert_int_equal(compress(&image, data, LONG, &wanted), SHD_OK);
    shd_pool *pool;
    shd_error error;
    assert_int_equal(shd_pool_new(4, 4, &pool, &error), SHD_OK);
    image.spread = spread;
    image.slots = shd_pool_slots(pool);
    image.context = pool;
    for (int i = 0; i < 5; i++) {
        assert_int_equal(compress(&image, data, LONG, &got), SHD_OK);
        assert_int_equal(got.size, wanted.size);
        assert_memory_equal(got.data, wanted.data, got.size);
        free(got.data);
    }
    shd_pool_drop(pool);
    free(wanted.data);
    free(data);
}

static void threads_make_the_same_bytes(void **state) {
    (void)state;
    check_threads(NULL);
    check_threads("small");
}

typedef struct asking {
    int calls, until;
} asking;

static bool go_on_until(void *context) {
    asking *a = context;
    return ++a->calls < a->until;
}

/* Before each piece, and before each is joined. */
static void it_is_left_between_any_two_pieces(void **state) {
    (void)state;
    const int pieces = (LONG + PIECE - 1) / PIECE;
    unsigned char *data = make_data(LONG, 6);
    shd_image image = picture(NULL, 1, 1);
    image.go_on = go_on_until;
    for (int until = 1; until <= 2 * pieces + 1; until++) {
        asking a = {0, until};
        shd_bytes stream;
        image.context = &a;
        const shd_status status = compress(&image, data, LONG, &stream);
        assert_int_equal(status, until <= 2 * pieces ? SHD_CANCELLED : SHD_OK);
        assert_int_equal(a.calls, until <= 2 * pieces ? until : 2 * pieces);
        free(stream.data);
    }
    free(data);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_last_block_is_found),
        cmocka_unit_test(what_is_no_stream_is_none),
        cmocka_unit_test(what_goes_in_comes_out),
        cmocka_unit_test(one_small_piece_is_what_libdeflate_makes_of_it),
        cmocka_unit_test(threads_make_the_same_bytes),
        cmocka_unit_test(it_is_left_between_any_two_pieces),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
