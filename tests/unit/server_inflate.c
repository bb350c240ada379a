/* Bodies in gzip and zstd, links in deflate: what they stand for, and what is none. */
#include "unit/packed.h"

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
        cmocka_unit_test(fields_name_one_coding),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
