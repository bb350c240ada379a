/* What a sheet writes below its cells, and where it says that a variant is wrong. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "image/draw.h"
#include "render/sheet_label.h"
#include "scene/variants.h"

static shd_variants *read_batch(const char *text, shd_arena *arena) {
    const shd_limits limits = {.memory = 1 << 24, .body = 1 << 20};
    shd_report report;
    shd_variants *variants = NULL;
    shd_report_init(&report, arena);
    if (shd_variants_read(text, strlen(text), &limits, NULL, arena, &variants, &report))
        fail_msg("%s: %s", report.errors[0].pointer, report.errors[0].detail);
    return variants;
}

static void assert_label(const char *text, size_t index, const char *expected) {
    shd_arena *arena = shd_arena_new(1 << 24);
    shd_variants *variants = read_batch(text, arena);
    char *label = shd_variants_label(variants, index);
    assert_string_equal(label, expected);
    free(label);
    shd_variants_drop(variants);
    shd_arena_drop(arena);
}

static void labels_tell_what_is_changed(void **state) {
    (void)state;
#define SWEEP(place, values) "{\"scene\":{},\"sweep\":{\"" place "\":[" values "]},\"sheet\":{}}"
    assert_label(SWEEP("/materials/m/shininess", "10,30"), 1, "shininess 30");
    assert_label(SWEEP("/materials/m", "{\"preset\":\"brass\"}"), 0, "brass");
    assert_label(SWEEP("/output/view", "\"Raw\",\"Film\\nic\""), 1, "Film ic");
    assert_label(SWEEP("/materials/m/diffuse", "[0.5, 0.1,0]"), 0, "diffuse 0.5 0.1 0");
    assert_label(SWEEP("/a~1b", "0.30000000000000004"), 0, "a/b 0.3");
    assert_label(SWEEP("/x", "true,null,{\"a\":1}"), 1, "x null");
    assert_label(SWEEP("/x", "true,null,{\"a\":1}"), 2, "{\"a\":1}");
    assert_label("{\"scene\":{\"objects\":[{}]},\"sweep\":{\"/objects/0\":[1],\"/b\":[2,3]}}", 1,
                 "objects 0 1\nb 3");
    assert_label("{\"scene\":{},\"variants\":[{},{\"a\":{\"b\":1,\"c\":\"red\"},\"d\":null}]}", 1,
                 "b 1\nred\nd null");
    assert_label("{\"scene\":{},\"variants\":[{}]}", 0, "");
    assert_label("{\"scene\":{},\"variants\":[{},{}],\"sheet\":{\"labels\":[\"a\",\"\\u00e9\"]}}",
                 1, "\xc3\xa9");
    assert_label("{\"scene\":{},\"name\":\"alone\",\"sheet\":{}}", 0, "alone");
}

static void assert_place(const char *text, size_t index, const char *pointer,
                         const char *expected) {
    shd_arena *arena = shd_arena_new(1 << 24);
    shd_variants *variants = read_batch(text, arena);
    char *place = shd_variants_place(variants, index, pointer);
    assert_string_equal(place, expected);
    free(place);
    shd_variants_drop(variants);
    shd_arena_drop(arena);
}

static void mistakes_have_their_place(void **state) {
    (void)state;
    static const char swept[] = "{\"scene\":{},\"sweep\":{\"/a/b\":[1,2],\"/c~0\":[3,4,5]}}";
    assert_place(swept, 5, "/a/b", "/sweep/~1a~1b/1");
    assert_place(swept, 4, "/c~0/x/0", "/sweep/~1c~00/1/x/0");
    assert_place(swept, 4, "/a/bc", "/scene/a/bc");
    assert_place(swept, 0, "", "/scene");
    assert_place("{\"scene\":{},\"variants\":[{},{}]}", 1, "/a", "/variants/1");
}

static void assert_broken(const char *text, double width, const char *const *expected) {
    char lines[SHD_LABEL_LINES][SHD_LABEL_SIZE];
    const size_t count = shd_label_break(text, 10, width, lines);
    for (size_t i = 0; i < count; i++) {
        if (!expected[i]) fail_msg("\"%s\" has a line \"%s\" too many", text, lines[i]);
        assert_string_equal(lines[i], expected[i]);
        assert_true(shd_text_width(lines[i], 10) <= width);
    }
    assert_null(expected[count]);
}

#define LINES(...) ((const char *const[]){__VA_ARGS__, NULL})

static void lines_are_no_wider_than_their_cell(void **state) {
    (void)state;
    const double wide = shd_text_width("shininess 30", 10);
    assert_broken("shininess 30", wide, LINES("shininess 30"));
    assert_broken("shininess 30", wide - 1, LINES("shininess", "30"));
    assert_broken("  a  b\n\nc ", 1000, LINES("a b", "c"));
    assert_broken("", 1000, (const char *const[]){NULL});
    assert_broken("a\nb\nc\nd", 1000, LINES("a", "b", "c", "d"));
    assert_broken("a\nb\nc\nd\ne", 1000, LINES("a", "b", "c", "d..."));
    assert_broken("Wordwordword", shd_text_width("Wor...", 10), LINES("Wor..."));
    assert_broken("\xc3\xa9\xc3\xa9\xc3\xa9\xc3\xa9\xc3\xa9\xc3\xa9",
                  shd_text_width("\xc3\xa9\xc3\xa9...", 10), LINES("\xc3\xa9\xc3\xa9..."));
}

static void texts_of_any_length_end(void **state) {
    (void)state;
    char lines[SHD_LABEL_LINES][SHD_LABEL_SIZE], text[2000];
    for (size_t period = 1; period < 400; period += 7) {
        for (size_t i = 0; i < sizeof text - 1; i++) text[i] = i % period ? '\xa9' : '\xc3';
        text[sizeof text - 1] = 0;
        for (double width = 1; width < 4000; width *= 3) {
            const size_t count = shd_label_break(text, 10, width, lines);
            assert_in_range(count, 1, SHD_LABEL_LINES);
            for (size_t i = 0; i < count; i++) assert_true(strlen(lines[i]) < SHD_LABEL_SIZE);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(labels_tell_what_is_changed),
        cmocka_unit_test(mistakes_have_their_place),
        cmocka_unit_test(lines_are_no_wider_than_their_cell),
        cmocka_unit_test(texts_of_any_length_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
