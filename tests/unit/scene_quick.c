/* Documents that simdjson reads against what jansson makes of them. */
#include <inttypes.h>
#include <math.h>

#include "same_tree.h"
#include "scene/json.h"
#include "unit/scene_support.h"

static bool is_read(const char *text, size_t length) {
    const int held = hold_quick_tree(text, length);
    if (held < 0) fail_msg("%.*s: another tree", (int)length, text);
    return held;
}

static const char document[] =
    "{ \"image\":{\"width\":64,\"height\":48},\"camera\":{\"position\":[0,-0.0,4.5e0]},\r\n\t"
    "\"lights\":[],\"objects\":[{\"type\":\"sphere\",\"radius\":0.25,\"name\":\"\xc3\xa4\"},"
    "{\"a\":[true,false,null,[{}]],\"\":1e-07}],\"background\":null} ";

static void most_documents_are_read(void **state) {
    (void)state;
    static const char *const plain[] = {
        document,
        "1",
        " -0.5 ",
        "\"x\"",
        "[]",
        "{}",
        "true",
        "[[[[1]]]]",
        "{\"a\":{\"a\":1},\"b\":{\"a\":1}}",
        "[9223372036854775807,-9223372036854775808]",
        "[18446744073709551615,9007199254740993,1E2,2e+3]",
        "[-0.0,-0.0e5,0e0,1e-400,-1e-400,0.5e-05]",
        "[4.9e-324,2.4703282292062327e-324,2.4703282292062328e-324]",
        "[1.7976931348623157e308,1.7976931348623158e308]",
        "[0.1234567890123456789012345678901234567890]",
        "\"\xf0\x9f\x8e\xa8\xef\xbf\xbf\x7f\""};
    for (size_t i = 0; i < sizeof plain / sizeof *plain; i++)
        if (!is_read(plain[i], strlen(plain[i]))) fail_msg("%s", plain[i]);
}

/* Of these jansson makes something else than simdjson, or nothing and says why. */
static const char *const unusual[] = {"[1,]",
                                      "[1, ]",
                                      "[,1]",
                                      "{,}",
                                      "{\"a\":1,}",
                                      "[1 2]",
                                      "{\"a\"}",
                                      "{\"a\" 1}",
                                      "{a:1}",
                                      "tru",
                                      "truefalse",
                                      "nul",
                                      "nulls",
                                      "01",
                                      "-01",
                                      "1.",
                                      "1.e1",
                                      "-",
                                      "+1",
                                      ".5",
                                      "1e",
                                      "1e+",
                                      "0x1",
                                      "1e999",
                                      "-1e999",
                                      "[1.7976931348623159e308]",
                                      "NaN",
                                      "Infinity",
                                      "-Infinity",
                                      "\"a",
                                      "'a'",
                                      "\"\x01\"",
                                      "\"a\nb\"",
                                      "\"\ta\"",
                                      "\"\xff\"",
                                      "\"\xc0\x80\"",
                                      "\"\xed\xa0\x80\"",
                                      "\"\xf4\x90\x80\x80\"",
                                      "\"\xe2\x82\"",
                                      "{\"\xff\":1}",
                                      "[\xc2\xa0]",
                                      "[1]]",
                                      "[1}",
                                      "{\"a\":1]",
                                      "[",
                                      "{",
                                      "]",
                                      "[[]",
                                      "{\"a\":",
                                      "{}{}",
                                      "1 2",
                                      "[] x",
                                      "{\"a\":1,\"a\":1}",
                                      "{\"a\":1,\"b\":2,\"a\":3}",
                                      "{\"a\":{\"\":1,\"\":2}}",
                                      "18446744073709551616",
                                      "-9223372036854775809",
                                      "123456789012345678901234567890",
                                      "-0",
                                      "[-0]",
                                      "[-0,1]",
                                      "[-0e3]",
                                      "\xef\xbb\xbf{}",
                                      "\xef\xbb\xbf",
                                      "[1]\v",
                                      "[\f1]",
                                      "[1]//",
                                      "/**/[1]"};

static void what_is_unusual_is_left_to_jansson(void **state) {
    (void)state;
    for (size_t i = 0; i < sizeof unusual / sizeof *unusual; i++)
        if (is_read(unusual[i], strlen(unusual[i]))) fail_msg("%s", unusual[i]);
    assert_false(is_read("", 0));
    assert_false(is_read("1\0", 2));
    assert_false(is_read("[1,\0 2]", 7));
    assert_false(is_read("\"\0\"", 3));
    assert_false(is_read("{\"a\0\":1}", 9));
}

/* 64 arrays in each other are read, some more are not. */
static void what_is_nested_deeply_is_left_to_jansson(void **state) {
    (void)state;
    char text[200];
    for (int depth = 60; depth <= 100; depth += 5) {
        memset(text, '[', (size_t)depth);
        memset(text + depth, ']', (size_t)depth);
        assert_int_equal(is_read(text, 2 * (size_t)depth), depth <= 60);
    }
}

/* Each byte replaced by others, left out, or with others before it; and the beginning alone. */
static void mistakes_are_never_read(void **state) {
    (void)state;
    static const char bytes[] = "{}[],:\" 0-.e1tn/\x01\x80\xc3";
    const size_t length = strlen(document);
    char text[sizeof document + 1];
    size_t read = 0;
    for (size_t at = 0; at < length; at++) {
        memcpy(text, document, at);
        memcpy(text + at, document + at + 1, length - at - 1);
        read += is_read(text, length - 1);
        read += is_read(document, at);
        for (size_t k = 0; k < sizeof bytes; k++) { /* and a zero */
            memcpy(text, document, length);
            text[at] = bytes[k];
            read += is_read(text, length);
            memcpy(text + at + 1, document + at, length - at);
            read += is_read(text, length + 1);
        }
    }
    assert_true(read > 500);
}

/* Numbers of any bits, and those halfway between two, in as many digits as they have. */
static void numbers_have_the_same_bits(void **state) {
    (void)state;
    uint64_t bits = 88172645463325252u;
    size_t read = 0;
    char text[2000];
    for (int i = 0; i < 3000; i++) {
        bits = bits * 6364136223846793005u + 1442695040888963407u;
        double value, next;
        memcpy(&value, &bits, sizeof value);
        if (!isfinite(value)) continue;
        next = nextafter(value, 0);
        const long double middle = ((long double)value + next) / 2;
        const int some = snprintf(text, sizeof text, "[%.17g,%.15g,%.25Lg,%.9f,%" PRId64 "]", value,
                                  value, middle, fmod(value, 1000), (int64_t)bits >> i % 64);
        assert_true(some < (int)sizeof text);
        read += is_read(text, (size_t)some);
    }
    assert_true(read > 2500); /* not those with longer integers, or with -0 */
}

static bool ends(void *context) {
    return --*(int *)context < 0;
}

/* At the first look, and at a later one. */
static void cancelled_documents_are_not_read(void **state) {
    (void)state;
    enum { ITEMS = 3000 };
    char text[2 * ITEMS + 1 + SHD_QUICK_PADDING] = "[";
    for (int i = 0; i < ITEMS; i++) memcpy(text + 1 + 2 * i, i + 1 < ITEMS ? "1," : "1]", 2);
    for (int looks = 0; looks < 4; looks++) {
        int left = looks;
        json_t *tree = shd_quick_tree(text, 2 * ITEMS + 1, ends, &left);
        assert_int_equal(tree != NULL, looks == 3);
        json_decref(tree);
    }
}

/* ---- Documents that are long enough ---- */

enum { LONG = 5000 };

/* The mistakes of a document do not depend on whether it is read quickly first: one that is short
 * is not. */
static void mistakes_have_jansson_s_words(void **state) {
    (void)state;
    static const char *const more[] = {"[\"\\u0000\"]",          "[\"\\ud800\"]",   "[\"\\udc00\"]",
                                       "[\"\\ud800\\u0041\"]",   "{\"\\u0000\":1}", "[\"\\x\"]",
                                       "{\"a\":1,\"\\u0061\":2}"};
    const size_t count = sizeof unusual / sizeof *unusual, extra = sizeof more / sizeof *more;
    char *text = malloc(LONG + 100);
    assert_non_null(text);
    for (size_t i = 0; i < count + extra; i++) {
        const char *mistake = i < count ? unusual[i] : more[i - count];
        if (*mistake == '\xef') continue; /* it is one at the beginning alone */
        const size_t length = strlen(mistake);
        memset(text, ' ', LONG);
        text[LONG - 1] = '\n';
        memcpy(text + LONG, mistake, length);
        reading quick = read_bytes(text, LONG + length, &scene_limits),
                slow = read_bytes(mistake, length, &scene_limits);
        assert_int_equal(quick.status, slow.status);
        assert_int_equal(quick.report.error_count, slow.report.error_count);
        if (slow.status == SHD_SYNTAX) {
            assert_int_equal(quick.report.line, slow.report.line + 1);
            assert_int_equal(quick.report.column, slow.report.column);
            const char *one = strchr(quick.report.errors[0].detail, ','),
                       *other = strchr(slow.report.errors[0].detail, ',');
            assert_string_equal(one, other);
        }
        drop(&quick);
        drop(&slow);
    }
    free(text);
}

/* A cap that has the tree alone is enough, and none is passed. */
static void memory_that_simdjson_takes_counts(void **state) {
    (void)state;
    char text[LONG];
    memset(text, ' ', sizeof text);
    memcpy(text, document, strlen(document));
    bool was_read = false, was_quick = false;
    for (size_t cap = 1 << 10; cap < 1 << 18; cap += 1 << 10) {
        reading r = {.arena = shd_arena_new(cap)};
        shd_report_init(&r.report, r.arena);
        shd_json json;
        const bool read =
            shd_json_parse(text, sizeof text, cap, true, NULL, r.arena, &json, &r.report);
        assert_true(read || (!was_read && r.report.status >= SHD_LIMIT));
        assert_true(shd_arena_peak(r.arena) <= cap);
        if (read) {
            assert_true(json.block || !was_quick);
            was_quick = json.block;
            shd_json_drop(&json, r.arena);
            assert_true(was_quick || !was_read || cap < 100000);
        }
        was_read = read;
        drop(&r);
    }
    assert_true(was_quick);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(most_documents_are_read),
        cmocka_unit_test(what_is_unusual_is_left_to_jansson),
        cmocka_unit_test(what_is_nested_deeply_is_left_to_jansson),
        cmocka_unit_test(mistakes_are_never_read),
        cmocka_unit_test(numbers_have_the_same_bits),
        cmocka_unit_test(cancelled_documents_are_not_read),
        cmocka_unit_test(mistakes_have_jansson_s_words),
        cmocka_unit_test(memory_that_simdjson_takes_counts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
