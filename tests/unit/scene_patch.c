/* Merge patches (RFC 7396) and values at pointers (RFC 6901), as text. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <jansson.h>

#include "scene/patch.h"
#include "scene/variants.h"

static shd_span span_of(const char *text) {
    return shd_span_of(text, text + strlen(text));
}

static void assert_json(const char *text, size_t size, const char *expected) {
    json_t *got = json_loadb(text, size, JSON_DECODE_ANY, NULL);
    json_t *wanted = json_loads(expected, JSON_DECODE_ANY, NULL);
    assert_non_null(wanted);
    if (!got || !json_equal(got, wanted)) fail_msg("\"%.*s\" is not %s", (int)size, text, expected);
    json_decref(got);
    json_decref(wanted);
}

static void assert_merged(const char *document, const char *patch, const char *expected) {
    shd_draft draft = {.data = NULL};
    shd_patch_merge(&draft, span_of(document), span_of(patch));
    assert_int_equal(draft.status, SHD_OK);
    assert_json(draft.data, draft.size, expected);
    free(draft.data);
}

/* RFC 7396, appendix A, all of it. */
static void merge_patches_are_those_of_the_rfc(void **state) {
    (void)state;
    static const char *const cases[][3] = {
        {"{\"a\":\"b\"}", "{\"a\":\"c\"}", "{\"a\":\"c\"}"},
        {"{\"a\":\"b\"}", "{\"b\":\"c\"}", "{\"a\":\"b\",\"b\":\"c\"}"},
        {"{\"a\":\"b\"}", "{\"a\":null}", "{}"},
        {"{\"a\":\"b\",\"b\":\"c\"}", "{\"a\":null}", "{\"b\":\"c\"}"},
        {"{\"a\":[\"b\"]}", "{\"a\":\"c\"}", "{\"a\":\"c\"}"},
        {"{\"a\":\"c\"}", "{\"a\":[\"b\"]}", "{\"a\":[\"b\"]}"},
        {"{\"a\":{\"b\":\"c\"}}", "{\"a\":{\"b\":\"d\",\"c\":null}}", "{\"a\":{\"b\":\"d\"}}"},
        {"{\"a\":[{\"b\":\"c\"}]}", "{\"a\":[1]}", "{\"a\":[1]}"},
        {"[\"a\",\"b\"]", "[\"c\",\"d\"]", "[\"c\",\"d\"]"},
        {"{\"a\":\"b\"}", "[\"c\"]", "[\"c\"]"},
        {"{\"a\":\"foo\"}", "null", "null"},
        {"{\"a\":\"foo\"}", "\"bar\"", "\"bar\""},
        {"{\"e\":null}", "{\"a\":1}", "{\"e\":null,\"a\":1}"},
        {"[1,2]", "{\"a\":\"b\",\"c\":null}", "{\"a\":\"b\"}"},
        {"{}", "{\"a\":{\"bb\":{\"ccc\":null}}}", "{\"a\":{\"bb\":{}}}"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_merged(cases[i][0], cases[i][1], cases[i][2]);
}

/* What is said in other ways: blanks, escapes, brackets in strings. */
static void spelling_does_not_matter(void **state) {
    (void)state;
    assert_merged(" { \"a\" : [ 1 , { \"]\" : \"}\\\"\" } ] ,\n\"b\":2 } ", "{\"\\u0061\" : null }",
                  "{\"b\":2}");
    assert_merged("{\"\\u00e9\\ud83d\\ude00\":1}", "{\"\xc3\xa9\xf0\x9f\x98\x80\":{\"x\":true}}",
                  "{\"\xc3\xa9\xf0\x9f\x98\x80\":{\"x\":true}}");
    assert_merged("{\"a\\\\\":{\"b\":[[]]}}", "{\"a\\\\\":{\"c\":-1.5e-3}}",
                  "{\"a\\\\\":{\"b\":[[]],\"c\":-1.5e-3}}");
}

static void assert_replaced(const char *document, const char *pointer, const char *expected) {
    shd_draft draft = {.data = NULL};
    shd_error error;
    assert_int_equal(shd_patch_replace(&draft, span_of(document), pointer, span_of("[9]"), &error),
                     SHD_OK);
    assert_json(draft.data, draft.size, expected);
    free(draft.data);
}

static void assert_no_place(const char *document, const char *pointer, const char *word) {
    shd_draft draft = {.data = NULL};
    shd_error error;
    assert_int_equal(shd_patch_replace(&draft, span_of(document), pointer, span_of("[9]"), &error),
                     SHD_SCENE);
    if (!strstr(error.text, word)) fail_msg("\"%s\" is not in \"%s\"", word, error.text);
    free(draft.data);
}

static void pointers_lead_to_places(void **state) {
    (void)state;
    assert_replaced("{\"a\":1}", "/a", "{\"a\":[9]}");
    assert_replaced("{\"a\":1}", "/b", "{\"a\":1,\"b\":[9]}");
    assert_replaced("{}", "/a/b/c", "{\"a\":{\"b\":{\"c\":[9]}}}");
    assert_replaced("{\"a\":[{\"b\":1},{\"b\":2}],\"c\":3}", "/a/1/b",
                    "{\"a\":[{\"b\":1},{\"b\":[9]}],\"c\":3}");
    assert_replaced("{\"a\":[0,1,2,3,4,5,6,7,8,9,10]}", "/a/10",
                    "{\"a\":[0,1,2,3,4,5,6,7,8,9,[9]]}");
    assert_replaced("{\"a/b\":1,\"~\":2}", "/a~1b", "{\"a/b\":[9],\"~\":2}");
    assert_replaced("{\"a/b\":1,\"~\":2}", "/~0", "{\"a/b\":1,\"~\":[9]}");
    assert_replaced("{\"\":1}", "/", "{\"\":[9]}");
    assert_replaced("{\"\\\"\":{}}", "/\"/\\", "{\"\\\"\":{\"\\\\\":[9]}}");
    assert_no_place("{\"a\":[1]}", "/a/1", "list of 1");
    assert_no_place("{\"a\":[1]}", "/a/-", "/a/-");
    assert_no_place("{\"a\":[1]}", "/a/00", "list of 1");
    assert_no_place("{\"a\":[1]}", "/a/x", "/a/x");
    assert_no_place("{\"a\":[1]}", "/a/18446744073709551616", "list of 1");
    assert_no_place("{\"a\":1}", "/a/b", "neither");
    assert_no_place("{\"a\":null}", "/a/b", "neither");
}

static void a_raised_flag_ends_it(void **state) {
    (void)state;
    const atomic_bool raised = true;
    shd_draft draft = {.cancelled = &raised};
    shd_error error;
    shd_patch_merge(&draft, span_of("{\"a\":1}"), span_of("{\"b\":1}"));
    assert_int_equal(draft.status, SHD_CANCELLED);
    free(draft.data);
    draft = (shd_draft){.cancelled = &raised};
    assert_int_equal(shd_patch_replace(&draft, span_of("{\"a\":1}"), "/a", span_of("1"), &error),
                     SHD_CANCELLED);
    free(draft.data);
}

/* ---- Batches ---- */

/* `pointer`: that of the first mistake; NULL: there is none. */
static shd_variants *read_batch(const char *text, const char *pointer) {
    shd_arena *arena = shd_arena_new(1 << 24);
    shd_report whole, *report = &whole;
    const shd_limits limits = {.memory = 1 << 24, .body = 1 << 20};
    shd_variants *variants = NULL;
    shd_report_init(report, arena);
    shd_variants_read(text, strlen(text), &limits, NULL, arena, &variants, report);
    assert_int_equal(report->status == SHD_OK, variants != NULL);
    if (pointer && !variants)
        assert_string_equal(report->errors[0].pointer, pointer);
    else
        assert_true(!pointer && variants);
    shd_arena_drop(arena);
    return variants;
}

static void assert_variant(const shd_variants *variants, size_t index, const char *expected) {
    char *text;
    size_t length;
    shd_error error;
    assert_int_equal(shd_variants_document(variants, index, NULL, &text, &length, &error), SHD_OK);
    assert_json(text, length, expected);
    free(text);
}

static void the_last_list_goes_on_fastest(void **state) {
    (void)state;
    shd_variants *v = read_batch(" {\"sweep\": {\"/a\": [1, 2], \"/b/0\": [3, [4], {\"x\": null}]},"
                                 " \"scene\" : {\"b\": [0, 5]} } ",
                                 NULL);
    assert_int_equal(shd_variants_count(v), 6);
    assert_variant(v, 0, "{\"b\":[3,5],\"a\":1}");
    assert_variant(v, 1, "{\"b\":[[4],5],\"a\":1}");
    assert_variant(v, 2, "{\"b\":[{\"x\":null},5],\"a\":1}");
    assert_variant(v, 3, "{\"b\":[3,5],\"a\":2}");
    assert_variant(v, 5, "{\"b\":[{\"x\":null},5],\"a\":2}");
    shd_variants_drop(v);
    v = read_batch("{\"scene\": {\"a\": {\"b\": 1}}, \"variants\": [{}, {\"a\": {\"b\": null}}]}",
                   NULL);
    assert_int_equal(shd_variants_count(v), 2);
    assert_variant(v, 0, "{\"a\":{\"b\":1}}");
    assert_variant(v, 1, "{\"a\":{}}");
    shd_variants_drop(v);
}

static void mistakes_in_batches_have_their_place(void **state) {
    (void)state;
    static const char *const cases[][2] = {
        {"[]", ""},
        {"{\"variants\": [{}]}", ""},
        {"{\"scene\": [], \"variants\": [{}]}", "/scene"},
        {"{\"scene\": {}, \"variants\": [{}], \"sweep\": {\"/a\": [1]}}", ""},
        {"{\"scene\": {}, \"variants\": []}", "/variants"},
        {"{\"scene\": {}, \"variants\": {}}", "/variants"},
        {"{\"scene\": {}, \"variants\": [{}, 3]}", "/variants/1"},
        {"{\"scene\": {}, \"sweep\": {}}", "/sweep"},
        {"{\"scene\": {}, \"sweep\": []}", "/sweep"},
        {"{\"scene\": {}, \"sweep\": {\"a\": [1]}}", "/sweep/a"},
        {"{\"scene\": {}, \"sweep\": {\"\": [1]}}", "/sweep/"},
        {"{\"scene\": {}, \"sweep\": {\"/~2\": [1]}}", "/sweep/~1~02"},
        {"{\"scene\": {}, \"sweep\": {\"/a\": []}}", "/sweep/~1a"},
        {"{\"scene\": {}, \"sweep\": {\"/a\": 1}}", "/sweep/~1a"},
        {"{\"scene\": {\"a\": 1}, \"sweep\": {\"/a/b\": [1]}}", "/sweep"},
        {"{\"scene\": {}, \"variants\": [{}], \"x\": 1}", "/x"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++)
        assert_null(read_batch(cases[i][0], cases[i][1]));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(merge_patches_are_those_of_the_rfc),
        cmocka_unit_test(spelling_does_not_matter),
        cmocka_unit_test(pointers_lead_to_places),
        cmocka_unit_test(a_raised_flag_ends_it),
        cmocka_unit_test(the_last_list_goes_on_fastest),
        cmocka_unit_test(mistakes_in_batches_have_their_place),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
