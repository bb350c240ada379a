/* The document as text: syntax, limits, memory, digest. */
#include "unit/scene_support.h"

typedef struct mistake {
    const char *text;
    int line, column;
    const char *words;
} mistake;

static void syntax_errors_have_line_and_column(void **state) {
    (void)state;
    static const mistake cases[] = {
        {"", 1, 1, "empty"},
        {" \n\t ", 1, 1, "empty"},
        {"{", 1, 1, ""},
        {"{\"objects\":\n  [tru]}", 2, 6, "invalid token"},
        {"{\"objects\": []} x", 1, 17, "end of file expected"},
        {"{\"objects\": []}{}", 1, 16, "end of file expected"},
        {"{\"objects\": [01]}", 1, 14, ""},
        {"{\"objects\": [NaN]}", 1, 16, ""},
        {"{\"objects\": [-Infinity]}", 1, 14, ""},
        {"{\"objects\": [1,]}", 1, 16, ""},
        {"{'objects': []}", 1, 2, ""},
        {"{\"ambient\": 1e999}", 1, 17, "real number overflow"},
        {"{\"ambient\": -1e999}", 1, 18, "real number overflow"},
        {"{\"a\": 1,\n \"a\": 2}", 2, 4, "the key \"a\" is there twice"},
        {"{\"x\": \"\\u0000\"}", 1, 14, "\\u0000 is not allowed in strings"},
        {"{\"x\": \"\\ud800\"}", 1, 14, ""},
        {"{\"x\": \"\xff\"}", 1, 7, "unable to decode byte 0xff"},
        {"{\"x\": \"\xc0\x80\"}", 1, 7, "unable to decode byte 0xc0"},
        {"\xef\xbb\xbf{}", 1, 1, "byte order mark"},
        {"{\"x\": \"a\nb\"}", 1, 8, "newline"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        reading r = read_bytes(cases[i].text, strlen(cases[i].text), &scene_limits);
        if (r.status != SHD_SYNTAX || r.report.line != cases[i].line ||
            r.report.column != cases[i].column || !has_error(&r, "", cases[i].words)) {
            print_error("%s: wanted line %d, column %d, %s; got %d, %d, %s\n", cases[i].text,
                        cases[i].line, cases[i].column, cases[i].words, r.report.line,
                        r.report.column, r.report.errors[0].detail);
            fail();
        }
        drop(&r);
    }
}

static void long_duplicate_keys_are_named(void **state) {
    (void)state;
    reading r = read_with("{'a-rather-long-name-of-a-member \\'q\\'': 1,"
                          "'a-rather-long-name-of-a-member \\'q\\'': 2}",
                          &scene_limits);
    assert_int_equal(r.status, SHD_SYNTAX);
    assert_true(has_error(&r, "", "the key \"a-rather-long-name-of-a-member \\\"q\\\"\""));
    drop(&r);
}

/* Looking for its beginning takes no more than one look at each byte: else this would take hours.
 */
static void duplicate_keys_of_backslashes_are_named_at_once(void **state) {
    (void)state;
    enum { KEY = 1 << 22 };
    char *text = malloc(2 * KEY + 16), *end = text;
    assert_non_null(text);
    for (int k = 0; k < 2; k++) {
        *end++ = k ? ',' : '{';
        *end++ = '"';
        memset(end, '\\', KEY);
        end += KEY;
        end = stpcpy(end, "\":1");
    }
    reading r = read_bytes(text, (size_t)(end - text), &scene_limits);
    assert_int_equal(r.status, SHD_SYNTAX);
    assert_true(has_error(&r, "", "the key \"\\\\\\"));
    drop(&r);
    free(text);
}

static void bytes_of_zero_are_syntax_errors(void **state) {
    (void)state;
    static const char inside[] = "{\"obj\0ects\": []}", after[] = "{\"objects\": []}\0";
    reading r = read_bytes(inside, sizeof inside - 1, &scene_limits);
    assert_int_equal(r.status, SHD_SYNTAX);
    drop(&r);
    r = read_bytes(after, sizeof after - 1, &scene_limits);
    assert_int_equal(r.status, SHD_SYNTAX);
    drop(&r);
    r = read_bytes("\0\0\0", 3, &scene_limits);
    assert_int_equal(r.status, SHD_SYNTAX);
    drop(&r);
}

static void nesting_without_end_is_refused(void **state) {
    (void)state;
    enum { DEPTH = 100000 };
    static const char *const pieces[] = {"[", "{\"a\":"};
    for (int p = 0; p < 2; p++) {
        size_t length = strlen(pieces[p]);
        char *text = malloc(DEPTH * length);
        assert_non_null(text);
        for (size_t i = 0; i < DEPTH; i++) memcpy(text + i * length, pieces[p], length);
        reading r = read_bytes(text, DEPTH * length, &scene_limits);
        assert_int_equal(r.status, SHD_SYNTAX);
        assert_true(has_error(&r, "", "nested too deeply"));
        drop(&r);
        free(text);
    }
    /* As deep as the parser goes, in a place where anything is an error. */
    char deep[4096] = "{\"objects\": ";
    memset(deep + 12, '[', 2000);
    memset(deep + 2012, ']', 2000);
    strcpy(deep + 4012, "}");
    reading r = read_bytes(deep, strlen(deep), &scene_limits);
    assert_int_equal(r.status, SHD_SCENE);
    drop(&r);
}

static void every_prefix_of_a_document_is_refused(void **state) {
    (void)state;
    static const char text[] =
        "{\"lights\": [{\"position\": [1.5e1, -2, 3, 1], \"color\": \"#ffeedd\"}], "
        "\"background\": null, \"objects\": [{\"type\": \"sphere\", \"m\\u00e4\": true}]}";
    for (size_t length = 0; length < sizeof text - 1; length++) {
        reading r = read_bytes(text, length, &scene_limits);
        assert_int_equal(r.status, SHD_SYNTAX);
        drop(&r);
    }
}

/* ---- Limits ---- */

static void assert_limit(const char *text, shd_limits limits, const char *pointer,
                         const char *words) {
    reading r = read_with(text, &limits);
    if (r.status != SHD_LIMIT || !has_error(&r, pointer, words)) {
        print_error("%s: %s\n", text,
                    r.report.error_count ? r.report.errors[0].detail : "accepted");
        fail();
    }
    drop(&r);
}

static void limits_are_named_with_what_was_asked(void **state) {
    (void)state;
    shd_limits l = scene_limits;
    assert_limit(WITH("'image': {'width': 10000, 'height': 10000}"), l, "/image",
                 "the image asks for 100000000 pixels; the limit `pixels` is 16777216");
    l.pixels = 1000;
    assert_limit("{'objects': []}", l, "", "262144 pixels");
    assert_limit(WITH("'image': {'region': [0, 0, 1001, 1], 'width': 60000}"), l, "/image",
                 "1001 pixels");
    reading r = read_with(WITH("'image': {'width': 65535, 'height': 65535,"
                               "'region': [65000, 65000, 100, 10], 'samples': 1}"),
                          &l);
    assert_int_equal(r.status, SHD_OK);
    drop(&r);

    l = scene_limits;
    l.samples = 4 * 512 * 512 - 1;
    assert_limit("{'objects': []}", l, "",
                 "1048576 samples (262144 pixels of 4); the limit `samples` is 1048575");
    assert_limit(WITH("'image': {'width': 65535, 'height': 65535, 'region': [9, 9, 129, 128],"
                      "'samples': 64}"),
                 l, "/image", "1056768 samples");
    r = read_with(WITH("'image': {'region': [9, 9, 128, 127], 'samples': 64}"), &l);
    assert_int_equal(r.status, SHD_OK);
    drop(&r);

    l = scene_limits;
    l.lights = 2;
    assert_limit(WITH("'lights': [{'type': 'point'}, {'type': 'point'}, {'type': 'point'}]"), l,
                 "/lights", "3 lights; the limit `lights` is 2");
    /* What was not read is not held against the rest. */
    shd_limits none = l;
    none.lights = 0;
    reading few = read_with(WITH("'lights': [{'type': 'point'}], 'output': {'format': 'exr',"
                                 "'layers': ['light.0']}"),
                            &none);
    assert_int_equal(few.report.error_count, 1);
    drop(&few);
    l.objects = 1;
    assert_limit("{'objects': [{'type': 'box'}, {'type': 'box'}]}", l, "/objects",
                 "2 objects; the limit `objects` is 1");
    l = scene_limits;
    l.body = 10;
    assert_limit("{'objects': []}", l, "", "15 bytes; the limit `body` is 10");
    l = scene_limits;
    l.triangles = 2100;
    assert_limit("{'objects': [{'type': 'torus', 'interpolation': 'flat'},"
                 "{'type': 'box', 'interpolation': 'flat'}, {'type': 'cylinder',"
                 "'interpolation': 'gouraud'}]}",
                 l, "/objects", "2188 triangles; the limit `triangles` is 2100");
    l.triangles = 1;
    assert_limit(MESH("'positions': [0,0,0, 1,0,0, 0,1,0], 'indices': [0,1,2, 0,2,1]"), l,
                 "/objects", "2 triangles");
    assert_limit("{'objects': [{'type': 'sphere', 'radius': 0.5}, {'type': 'disc',"
                 "'interpolation': 'flat'}]}",
                 l, "/objects", "32 triangles");
}

/* The tree may be far larger than its text: it is measured before it is made. */
static void a_tree_larger_than_the_memory_limit_is_not_made(void **state) {
    (void)state;
    enum { COUNT = 1 << 20 };
    char *text = malloc(3 * COUNT);
    assert_non_null(text);
    for (size_t i = 0; i < COUNT; i++) memcpy(text + 3 * i, "{},", 3);
    text[0] = '[';
    reading r = read_bytes(text, 3 * COUNT, &scene_limits);
    assert_int_equal(r.status, SHD_LIMIT);
    assert_true(has_error(&r, "", "the limit `memory` is 268435456"));
    drop(&r);
    free(text);
}

static void full_arena_is_a_memory_error(void **state) {
    (void)state;
    /* Materials with lobes: little text and much scene. */
    char text[1 << 15] = "{'objects': [";
    for (int i = 0; i < 500; i++) strcat(text, i ? ",{'type': 'box'}" : "{'type': 'box'}");
    strcat(text, "]}");
    shd_limits limits = scene_limits;
    shd_arena *arena = shd_arena_new(100000);
    shd_report report;
    shd_report_init(&report, arena);
    const shd_scene *scene = NULL;
    for (char *c = text; *c; c++)
        if (*c == '\'') *c = '"';
    shd_status status = shd_scene_read(text, strlen(text), &scene_catalog, &limits, SHD_PNG, arena,
                                       &scene, &report);
    assert_int_equal(status, SHD_MEMORY);
    assert_null(scene);
    assert_int_equal(report.error_count, 1);
    shd_arena_drop(arena);
}

/* ---- Digest ---- */

static void digest_is_of_what_the_document_says(void **state) {
    (void)state;
    static const char *const same[] = {
        "{'ambient': 0.5, 'background': [0, 1, 2], 'objects': [{'type': 'sphere', 'radius': 10}]}",
        "{'objects':[{'radius':1e1,'type':'spher\\u0065'}],'background':[0,1,2],'ambient':0.5}",
        "\n{'background':[-0,1.0,2], 'objects':[{'type':'sphere','radius':1e1}], 'ambient':5e-1}",
    };
    static const char *const others[] = {
        "{'ambient': 0.5, 'background': [0, 2, 1], 'objects': [{'type': 'sphere', 'radius': 10}]}",
        "{'ambient': 0.6, 'background': [0, 1, 2], 'objects': [{'type': 'sphere', 'radius': 10}]}",
        "{'background': 0.5, 'ambient': [0, 1, 2], 'objects': [{'type': 'sphere', 'radius': 10}]}",
        "{'ambient': 0.5, 'background': [0, 1, 2], 'objects': [{'type': 'torus', 'radius': 10}]}",
        "{'ambient': 0.5, 'background': [0, 1, 2], 'objects': []}",
        "{'ambient': 0.5, 'background': null, 'objects': [{'type': 'sphere', 'radius': 10}]}",
    };
    char digest[33];
    for (size_t i = 0; i < 3; i++) {
        reading r = read_scene(same[i]);
        if (!i) strcpy(digest, r.scene->digest);
        assert_string_equal(r.scene->digest, digest);
        assert_int_equal(strspn(digest, "0123456789abcdef"), 32);
        drop(&r);
    }
    for (size_t i = 0; i < 6; i++) {
        reading r = read_scene(others[i]);
        assert_string_not_equal(r.scene->digest, digest);
        drop(&r);
    }
}

/* More members than fit on the stack, in any order. */
static void digest_of_many_members_is_independent_of_their_order(void **state) {
    (void)state;
    char digest[33] = "";
    for (int pass = 0; pass < 2; pass++) {
        char text[8192] = "{'objects': [], 'materials': {";
        for (int i = 0; i < 100; i++)
            sprintf(text + strlen(text), "%s'm%d': {'diffuse': 0.%d}", i ? "," : "",
                    pass ? 99 - i : i, pass ? 99 - i : i);
        strcat(text, "}}");
        reading r = read_scene(text);
        if (pass) assert_string_equal(r.scene->digest, digest);
        strcpy(digest, r.scene->digest);
        drop(&r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(syntax_errors_have_line_and_column),
        cmocka_unit_test(long_duplicate_keys_are_named),
        cmocka_unit_test(duplicate_keys_of_backslashes_are_named_at_once),
        cmocka_unit_test(bytes_of_zero_are_syntax_errors),
        cmocka_unit_test(nesting_without_end_is_refused),
        cmocka_unit_test(every_prefix_of_a_document_is_refused),
        cmocka_unit_test(limits_are_named_with_what_was_asked),
        cmocka_unit_test(a_tree_larger_than_the_memory_limit_is_not_made),
        cmocka_unit_test(full_arena_is_a_memory_error),
        cmocka_unit_test(digest_is_of_what_the_document_says),
        cmocka_unit_test(digest_of_many_members_is_independent_of_their_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
