/* What bodies in a coding may come to: how much is kept, guessed and refused. */
#include "unit/packed.h"

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

/* Whoever decodes a body has opened what its coding takes. */
static int open_codings(void **state) {
    (void)state;
    for (int p = 0; p < PACKERS; p++)
        if (!shd_inflate_open(packers[p].coding)) return 1;
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_longer_than_is_kept_is_guessed),
        cmocka_unit_test(bodies_that_begin_unlike_they_end),
        cmocka_unit_test(what_never_has_room_is_over_a_limit),
        cmocka_unit_test(a_gigabyte_of_zeros_takes_no_more_than_may_be),
        cmocka_unit_test(a_frame_that_tells_its_size_is_refused_by_it),
        cmocka_unit_test(a_cancelled_request_ends_it),
    };
    return cmocka_run_group_tests(tests, open_codings, NULL);
}
