/* Bodies in gzip and zstd, links in deflate: what they stand for, and what is none. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <zlib.h>
#include <zstd.h>

#include <cmocka.h>

#include "server/conn/inflate.h"

enum { MB = 1 << 20 };

/* Bytes that are owned, in a block of exactly their size, so that a sanitizer sees who reads on. */
typedef struct bytes {
    unsigned char *data;
    size_t size;
} bytes;

static bytes copy_of(const void *data, size_t size) {
    bytes b = {malloc(size ? size : 1), size};
    assert_non_null(b.data);
    if (size) memcpy(b.data, data, size);
    return b;
}

static bytes join(bytes a, bytes b) {
    bytes all = {malloc(a.size + b.size), a.size + b.size};
    assert_non_null(all.data);
    memcpy(all.data, a.data, a.size);
    memcpy(all.data + a.size, b.data, b.size);
    free(a.data);
    free(b.data);
    return all;
}

static bytes pack_zlib(const void *data, size_t size, int window_bits) {
    z_stream z = {0};
    assert_int_equal(deflateInit2(&z, 6, Z_DEFLATED, window_bits, 8, Z_DEFAULT_STRATEGY), Z_OK);
    bytes b = {malloc(deflateBound(&z, size)), 0};
    assert_non_null(b.data);
    z.next_in = (unsigned char *)(size_t)data;
    z.avail_in = (unsigned)size;
    z.next_out = b.data;
    z.avail_out = (unsigned)deflateBound(&z, size);
    assert_int_equal(deflate(&z, Z_FINISH), Z_STREAM_END);
    b.size = z.total_out;
    deflateEnd(&z);
    bytes fit = copy_of(b.data, b.size);
    free(b.data);
    return fit;
}

static bytes pack_gzip(const void *data, size_t size) {
    return pack_zlib(data, size, 15 + 16);
}

/* With a checksum; `streamed`: its head does not tell its size. */
static bytes pack_frame(const void *data, size_t size, int level, bool streamed) {
    ZSTD_CCtx *context = ZSTD_createCCtx();
    bytes b = {malloc(ZSTD_compressBound(size)), 0};
    assert_true(context && b.data);
    ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, level);
    ZSTD_CCtx_setParameter(context, ZSTD_c_checksumFlag, 1);
    ZSTD_CCtx_setParameter(context, ZSTD_c_contentSizeFlag, !streamed);
    b.size = ZSTD_compress2(context, b.data, ZSTD_compressBound(size), data, size);
    assert_false(ZSTD_isError(b.size));
    ZSTD_freeCCtx(context);
    bytes fit = copy_of(b.data, b.size);
    free(b.data);
    return fit;
}

static bytes pack_zstd(const void *data, size_t size) {
    return pack_frame(data, size, 3, false);
}

static const struct {
    shd_coding coding;
    bytes (*pack)(const void *data, size_t size);
} packers[] = {{SHD_CODING_GZIP, pack_gzip}, {SHD_CODING_ZSTD, pack_zstd}};

enum { PACKERS = sizeof packers / sizeof packers[0] };

/* What a body comes to: `*got` where it is SHD_OK. Whatever it is, all memory is given back. */
static shd_status unpack(shd_coding coding, bytes body, uint64_t most, uint64_t budget_size,
                         bytes *got, char *text) {
    shd_budget *budget = shd_budget_new(budget_size);
    const shd_inflation how = {.most = most, .keep = most, .budget = budget, .room = UINT64_MAX};
    size_t taken = 0;
    shd_error error = {0};
    assert_true(budget && shd_inflate_open(coding));
    const shd_status status =
        shd_inflate(coding, body.data, body.size, &how, &got->data, &got->size, &taken, &error);
    assert_int_equal(shd_budget_load_of(budget).used, status == SHD_OK ? taken : 0);
    assert_true(status != SHD_OK || taken >= got->size);
    if (text) snprintf(text, sizeof error.text, "%s", error.text);
    shd_budget_drop(budget);
    return status;
}

static void assert_comes_to(shd_coding coding, bytes body, const void *data, size_t size) {
    bytes got;
    assert_int_equal(unpack(coding, body, size, 64 * MB, &got, NULL), SHD_OK);
    assert_int_equal(got.size, size);
    assert_memory_equal(got.data, data, size);
    free(got.data);
    if (!size) return;
    assert_int_equal(unpack(coding, body, size - 1, 64 * MB, &got, NULL), SHD_LIMIT);
}

static void assert_wrong(shd_coding coding, bytes body, const char *word) {
    char text[512] = "";
    bytes got;
    assert_int_equal(unpack(coding, body, MB, 64 * MB, &got, text), SHD_SYNTAX);
    if (!strstr(text, word)) fail_msg("\"%s\" is not in \"%s\"", word, text);
}

/* Half of it repeats. */
static bytes make_text(size_t size) {
    bytes text = {malloc(size ? size : 1), size};
    assert_non_null(text.data);
    uint32_t state = 1;
    for (size_t i = 0; i < size; i++) {
        state = state * 1664525u + 1013904223u;
        text.data[i] = i / 1000 % 2 ? (unsigned char)(state >> 24) : "{\"a\": 1}, "[i % 10];
    }
    return text;
}

/* ---- ---- */

static void bodies_come_to_what_was_packed(void **state) {
    (void)state;
    static const size_t sizes[] = {0, 1, 2, 4095, 4096, 4097, 70000, 262144, 262145, 5000000};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        bytes text = make_text(sizes[s]);
        for (size_t p = 0; p < PACKERS; p++) {
            bytes body = packers[p].pack(text.data, text.size);
            assert_comes_to(packers[p].coding, body, text.data, text.size);
            free(body.data);
        }
        for (int streamed = 0; streamed < 2; streamed++) {
            bytes body = pack_frame(text.data, text.size, 19, streamed);
            assert_comes_to(SHD_CODING_ZSTD, body, text.data, text.size);
            free(body.data);
        }
        free(text.data);
    }
}

static void members_follow_each_other(void **state) {
    (void)state;
    static const unsigned char skipped[] = {0x53, 0x2a, 0x4d, 0x18, 3, 0, 0, 0, 'a', 'b', 'c'};
    bytes text = make_text(9000);
    for (size_t p = 0; p < PACKERS; p++) {
        bytes body = packers[p].pack(text.data, 4000);
        body = join(body, packers[p].pack("", 0));
        if (packers[p].coding == SHD_CODING_ZSTD)
            body = join(body, copy_of(skipped, sizeof skipped));
        body = join(body, packers[p].pack(text.data + 4000, 5000));
        assert_comes_to(packers[p].coding, body, text.data, 9000);
        /* Nothing else may stand behind them, nor between. */
        body = join(body, copy_of("\0\0\0\0\0\0\0\0\0\0", 10));
        assert_wrong(packers[p].coding, body, "byte");
        free(body.data);
    }
    bytes two = join(pack_gzip("a", 1), pack_zstd("b", 1));
    assert_wrong(SHD_CODING_GZIP, two, "incorrect header check");
    free(two.data);
    free(text.data);
}

static void a_link_is_one_stream_of_deflate(void **state) {
    (void)state;
    static const size_t sizes[] = {0, 1, 4096, 4097, 70000, 262145};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        bytes text = make_text(sizes[s]), body = pack_zlib(text.data, text.size, -15);
        assert_comes_to(SHD_CODING_DEFLATE, body, text.data, text.size);
        for (size_t size = 0; size < body.size && sizes[s] < 5000; size++) {
            bytes part = copy_of(body.data, size);
            assert_wrong(SHD_CODING_DEFLATE, part, "the link's");
            free(part.data);
        }
        body = join(body, pack_zlib("", 0, -15));
        assert_wrong(SHD_CODING_DEFLATE, body, "bytes follow its end");
        free(body.data);
        free(text.data);
    }
    bytes others[] = {pack_gzip("a", 1), pack_zlib("a", 1, 15), pack_zstd("a", 1)};
    for (size_t i = 0; i < sizeof others / sizeof others[0]; i++) {
        assert_wrong(SHD_CODING_DEFLATE, others[i], "the link");
        free(others[i].data);
    }
}

static void whatever_is_cut_is_told(void **state) {
    (void)state;
    bytes text = make_text(3000);
    for (size_t p = 0; p < PACKERS; p++) {
        bytes body = packers[p].pack(text.data, text.size);
        for (size_t size = 0; size < body.size; size++) {
            bytes part = copy_of(body.data, size);
            assert_wrong(packers[p].coding, part, "end before their");
            free(part.data);
        }
        free(body.data);
    }
    free(text.data);
}

/* Checksums are there and are held to: no other text comes of a body in which a bit is another. */
static void whatever_is_spoilt_is_told_or_means_nothing(void **state) {
    (void)state;
    bytes text = make_text(1500);
    for (size_t p = 0; p < PACKERS; p++) {
        bytes body = packers[p].pack(text.data, text.size);
        size_t told = 0;
        for (size_t bit = 0; bit < 8 * body.size; bit++) {
            bytes got;
            body.data[bit / 8] ^= (unsigned char)(1 << bit % 8);
            const shd_status status =
                unpack(packers[p].coding, body, text.size, 64 * MB, &got, NULL);
            body.data[bit / 8] ^= (unsigned char)(1 << bit % 8);
            told += status != SHD_OK;
            if (status != SHD_OK) {
                assert_true(status == SHD_SYNTAX || status == SHD_LIMIT);
                continue;
            }
            assert_int_equal(got.size, text.size);
            assert_memory_equal(got.data, text.data, text.size);
            free(got.data);
        }
        /* gzip's head has 7 bytes, and 5 bits of flags, of which this needs nothing. */
        assert_true(told >= 8 * body.size - 8 * 8);
        free(body.data);
    }
    free(text.data);
}

static void what_is_not_of_its_coding_is_told(void **state) {
    (void)state;
    static const unsigned char window[] = {0x28, 0xb5, 0x2f, 0xfd, 0, 13 << 3, 9, 0, 0, 'a'},
                               wider[] = {0x28, 0xb5, 0x2f, 0xfd, 0, 13 << 3 | 1, 9, 0, 0, 'a'},
                               dictionary[] = {0x28, 0xb5, 0x2f, 0xfd, 1, 0, 7, 9, 0, 0, 'a'},
                               older[] = {0x27, 0xb5, 0x2f, 0xfd, 0, 13 << 3, 9, 0, 0, 'a'},
                               zlib[] = {0x78, 0x9c, 0x4b, 0x04, 0, 0, 0x62, 0, 0x62},
                               json[] = {'{', '}', ' ', ' ', ' '};
    /* RFC 9659: windows of up to 8 MB. */
    assert_comes_to(SHD_CODING_ZSTD, (bytes){(unsigned char *)(size_t)window, sizeof window}, "a",
                    1);
    const struct {
        shd_coding coding;
        const unsigned char *data;
        size_t size;
        const char *word;
    } cases[] = {{SHD_CODING_ZSTD, wider, sizeof wider, "memory"},
                 {SHD_CODING_ZSTD, dictionary, sizeof dictionary, "Dictionary"},
                 {SHD_CODING_ZSTD, older, sizeof older, "no frame begins here"},
                 {SHD_CODING_ZSTD, json, sizeof json, "no frame begins here"},
                 {SHD_CODING_GZIP, zlib, sizeof zlib, "incorrect header check"},
                 {SHD_CODING_GZIP, window, sizeof window, "incorrect header check"},
                 {SHD_CODING_GZIP, json, sizeof json, "incorrect header check"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        bytes body = copy_of(cases[i].data, cases[i].size);
        assert_wrong(cases[i].coding, body, cases[i].word);
        free(body.data);
    }
}

/* ---- A gigabyte of zeros ---- */

static bytes repeat(bytes one, size_t times) {
    bytes all = {malloc(one.size * times), one.size * times};
    assert_non_null(all.data);
    for (size_t i = 0; i < times; i++) memcpy(all.data + i * one.size, one.data, one.size);
    free(one.data);
    return all;
}

/* One frame that does not tell its size, of blocks that repeat a zero 128 KB times: 32 KB. */
static bytes make_zstd_bomb(void) {
    static const unsigned char head[] = {0x28, 0xb5, 0x2f, 0xfd, 0, 13 << 3},
                               block[] = {2, 0, 16, 0}, last[] = {3, 0, 16, 0};
    bytes blocks = repeat(copy_of(block, sizeof block), 8191);
    return join(join(copy_of(head, sizeof head), blocks), copy_of(last, sizeof last));
}

/* Of what is longer than is kept only the beginning is decoded, and the rest guessed: within a
 * third and twice of it where all is alike, of zstd by its blocks of 128 KB. */
static void what_is_longer_than_is_kept_is_guessed(void **state) {
    (void)state;
    enum { KEEP = 100000 };
    static const size_t sizes[] = {0, KEEP - 1, KEEP, KEEP + 1, KEEP + 2, MB, 3 * MB - 1, 3 * MB};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        bytes text = make_text(sizes[s]);
        for (size_t p = 0; p < PACKERS; p++) {
            bytes body = packers[p].pack(text.data, text.size), got = {NULL, 0};
            shd_budget *budget = shd_budget_new(4 * MB);
            const shd_inflation how = {
                .most = 3 * MB, .keep = KEEP, .budget = budget, .room = UINT64_MAX};
            size_t taken = 0;
            const shd_status status = shd_inflate(packers[p].coding, body.data, body.size, &how,
                                                  &got.data, &got.size, &taken, NULL);
            assert_int_equal(status, SHD_OK);
            if (sizes[s] > KEEP) {
                assert_null(got.data);
                assert_in_range(got.size, KEEP + 1, 3 * MB);
                assert_in_range(got.size, sizes[s] / 3, 2 * sizes[s]);
            } else {
                assert_int_equal(got.size, sizes[s]);
                assert_memory_equal(got.data, text.data, sizes[s]);
            }
            assert_int_equal(shd_budget_load_of(budget).used, taken);
            assert_true(taken <= KEEP);
            free(got.data);
            free(body.data);
            shd_budget_drop(budget);
        }
        free(text.data);
    }
}

/* Whatever a body's beginning promises, it is long, within what may be; and it comes to what it is,
 * within the same limit, once it is decoded. */
static void bodies_that_begin_unlike_they_end(void **state) {
    (void)state;
    enum { KEEP = 64 << 10, LONG = 8 * MB };
    bytes dense = make_text(LONG), sparse = {calloc(1, LONG), LONG};
    assert_non_null(sparse.data);
    for (size_t i = 0; i < LONG; i++) dense.data[i] ^= (unsigned char)(i * i >> 7);
    const struct {
        const unsigned char *head, *tail;
        size_t head_size, tail_size, times; /* of both together */
    } cases[] = {{dense.data, sparse.data, 100000, LONG, 1},
                 {sparse.data, dense.data, 100000, LONG, 1},
                 {sparse.data, dense.data, KEEP + 1, 0, 1},
                 {dense.data, sparse.data, 1, 1, 40000},
                 {sparse.data, dense.data, 1, 1000, 1000}};
    for (size_t c = 0; c < sizeof cases / sizeof cases[0]; c++)
        for (size_t p = 0; p < PACKERS; p++) {
            const size_t each = cases[c].head_size + cases[c].tail_size,
                         all = each * cases[c].times;
            bytes plain = repeat(join(copy_of(cases[c].head, cases[c].head_size),
                                      copy_of(cases[c].tail, cases[c].tail_size)),
                                 cases[c].times);
            bytes body = repeat(join(packers[p].pack(cases[c].head, cases[c].head_size),
                                     packers[p].pack(cases[c].tail, cases[c].tail_size)),
                                cases[c].times);
            shd_budget *budget = shd_budget_new(MB);
            const shd_inflation how = {
                .most = 2 * LONG, .keep = KEEP, .budget = budget, .room = UINT64_MAX};
            bytes got = {NULL, 0};
            size_t taken = 1;
            assert_int_equal(shd_inflate(packers[p].coding, body.data, body.size, &how, &got.data,
                                         &got.size, &taken, NULL),
                             SHD_OK);
            assert_null(got.data);
            assert_in_range(got.size, KEEP + 1, 2 * LONG);
            assert_int_equal(taken, 0);
            assert_int_equal(shd_budget_load_of(budget).used, 0);
            shd_budget_drop(budget);
            assert_comes_to(packers[p].coding, body, plain.data, all);
            free(body.data);
            free(plain.data);
        }
    free(dense.data);
    free(sparse.data);
}

/* What never has room is not for another time. */
static void what_never_has_room_is_over_a_limit(void **state) {
    (void)state;
    bytes text = make_text(MB);
    shd_budget *budget = shd_budget_new(4 * MB);
    for (size_t p = 0; p < PACKERS; p++) {
        bytes body = packers[p].pack(text.data, text.size);
        for (uint64_t room = 0; room < 3 * MB; room += 100000) {
            const shd_inflation how = {
                .most = 2 * MB, .keep = 2 * MB, .budget = budget, .room = room};
            bytes got;
            size_t taken;
            shd_error error;
            const shd_status status = shd_inflate(packers[p].coding, body.data, body.size, &how,
                                                  &got.data, &got.size, &taken, &error);
            if (status) {
                assert_int_equal(status, SHD_LIMIT);
                assert_non_null(strstr(error.text, "the limit `memory`"));
            } else {
                assert_true(room >= MB);
                assert_int_equal(got.size, MB);
                assert_int_equal(shd_budget_load_of(budget).used, taken);
                shd_budget_give(budget, taken);
                free(got.data);
            }
            assert_int_equal(shd_budget_load_of(budget).used, 0);
            if (room >= 2900000) assert_int_equal(status, SHD_OK);
        }
        free(body.data);
    }
    shd_budget_drop(budget);
    free(text.data);
}

static void a_gigabyte_of_zeros_takes_no_more_than_may_be(void **state) {
    (void)state;
    unsigned char *zeros = calloc(1, MB);
    assert_non_null(zeros);
    const struct {
        shd_coding coding;
        bytes body;
    } bombs[] = {{SHD_CODING_GZIP, repeat(pack_gzip(zeros, MB), 1024)},
                 {SHD_CODING_ZSTD, repeat(pack_zstd(zeros, MB), 1024)},
                 {SHD_CODING_ZSTD, make_zstd_bomb()}};
    for (size_t i = 0; i < sizeof bombs / sizeof bombs[0]; i++) {
        bytes got;
        char text[512];
        assert_true(bombs[i].body.size < 2 * MB);
        /* The budget has room for what may be, twice as much while it grows, and a decoder. */
        assert_int_equal(unpack(bombs[i].coding, bombs[i].body, 4 * MB, 16 * MB, &got, text),
                         SHD_LIMIT);
        assert_non_null(strstr(text, "after 4194304 bytes"));
        assert_non_null(strstr(text, "the limit `body`"));
        /* For want of memory nobody is asked where there never is so much; else it is waited for.
         */
        if (!i)
            assert_int_equal(unpack(bombs[i].coding, bombs[i].body, 64 * MB, MB, &got, text),
                             SHD_CROWDED);
        assert_int_equal(unpack(bombs[i].coding, bombs[i].body, 64 * MB, 10000, &got, text),
                         SHD_CROWDED);
        free(bombs[i].body.data);
    }
    free(zeros);
}

/* A head that tells a size is believed where that is too much: nothing is decoded. */
static void a_frame_that_tells_its_size_is_refused_by_it(void **state) {
    (void)state;
    static const unsigned char head[] = {0x28, 0xb5, 0x2f, 0xfd, 0x80, 0, 0, 0, 0, 0x40};
    bytes got, body = copy_of(head, sizeof head);
    assert_int_equal(unpack(SHD_CODING_ZSTD, body, 4 * MB, 16 * MB, &got, NULL), SHD_LIMIT);
    free(body.data);
}

static void a_cancelled_request_ends_it(void **state) {
    (void)state;
    shd_engine_options options = shd_engine_defaults();
    shd_engine *engine;
    shd_request *request;
    options.threads = 1;
    assert_int_equal(shd_engine_new(&options, &engine, NULL), SHD_OK);
    assert_int_equal(shd_request_new(engine, &request, NULL), SHD_OK);
    const shd_inflation how = {.most = MB, .room = MB, .request = request};
    assert_false(shd_request_is_cancelled(request));
    shd_request_cancel(request);
    assert_true(shd_request_is_cancelled(request));
    for (size_t p = 0; p < PACKERS; p++) {
        bytes body = packers[p].pack("a", 1), got;
        size_t taken;
        assert_true(shd_inflate_open(packers[p].coding));
        assert_int_equal(shd_inflate(packers[p].coding, body.data, body.size, &how, &got.data,
                                     &got.size, &taken, NULL),
                         SHD_CANCELLED);
        free(body.data);
    }
    shd_request_drop(request);
    shd_engine_drop(engine);
}

static void fields_name_one_coding(void **state) {
    (void)state;
    static const struct {
        const char *field;
        int coding; /* -1: it is not taken */
    } cases[] = {{NULL, SHD_CODING_NONE},
                 {"", SHD_CODING_NONE},
                 {"identity", SHD_CODING_NONE},
                 {"Identity, identity", SHD_CODING_NONE},
                 {"gzip", SHD_CODING_GZIP},
                 {" GZip ", SHD_CODING_GZIP},
                 {"x-gzip", SHD_CODING_GZIP},
                 {",, identity ,\tgzip,", SHD_CODING_GZIP},
                 {"zstd", SHD_CODING_ZSTD},
                 {"zstd, identity", SHD_CODING_ZSTD},
                 {"gzip, gzip", -1},
                 {"gzip, zstd", -1},
                 {"zstd;q=1", -1},
                 {"br", -1},
                 {"deflate", -1},
                 {"compress, gzip", -1},
                 {"gzi", -1},
                 {"gzipp", -1},
                 {"\"gzip\"", -1},
                 {"*", -1}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_coding coding = SHD_CODING_NONE;
        const bool taken = shd_coding_read(cases[i].field, &coding);
        if ((taken ? (int)coding : -1) != cases[i].coding) fail_msg("%s", cases[i].field);
    }
    assert_string_equal(shd_coding_list(), "gzip, zstd");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bodies_come_to_what_was_packed),
        cmocka_unit_test(members_follow_each_other),
        cmocka_unit_test(a_link_is_one_stream_of_deflate),
        cmocka_unit_test(whatever_is_cut_is_told),
        cmocka_unit_test(whatever_is_spoilt_is_told_or_means_nothing),
        cmocka_unit_test(what_is_not_of_its_coding_is_told),
        cmocka_unit_test(what_is_longer_than_is_kept_is_guessed),
        cmocka_unit_test(bodies_that_begin_unlike_they_end),
        cmocka_unit_test(what_never_has_room_is_over_a_limit),
        cmocka_unit_test(a_gigabyte_of_zeros_takes_no_more_than_may_be),
        cmocka_unit_test(a_frame_that_tells_its_size_is_refused_by_it),
        cmocka_unit_test(a_cancelled_request_ends_it),
        cmocka_unit_test(fields_name_one_coding),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
