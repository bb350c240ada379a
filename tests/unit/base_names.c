/* Formats and the catalog: what clients name is found, what they misspell is not. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/catalog.h"
#include "base/format.h"

static void every_format_is_found_by_its_own_name(void **state) {
    (void)state;
    for (int f = 0; f < SHD_FORMAT_COUNT; f++) {
        const shd_format_info *info = shd_format_get((shd_format)f);
        shd_format found = SHD_FORMAT_COUNT;
        assert_true(shd_format_find(info->name, &found));
        assert_int_equal(found, f);
        assert_int_equal(strncmp(info->media_type, "image/", 6), 0);
        assert_true(info->depth & info->depths); /* the default depth is one that it holds */
        assert_false(info->premultiplied && !info->alpha);
        for (int g = 0; g < f; g++) {
            assert_string_not_equal(info->name, shd_format_get((shd_format)g)->name);
            assert_string_not_equal(info->media_type, shd_format_get((shd_format)g)->media_type);
        }
    }
}

static void suffixes_are_found_in_any_case(void **state) {
    (void)state;
    static const struct {
        const char *name;
        shd_format format;
    } cases[] = {{"jpg", SHD_JPEG}, {"JPG", SHD_JPEG},  {"Jpeg", SHD_JPEG},
                 {"tif", SHD_TIFF}, {"TIFF", SHD_TIFF}, {"Exr", SHD_EXR},
                 {"PNG", SHD_PNG},  {"webp", SHD_WEBP}, {"hdr", SHD_HDR}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_format found = SHD_FORMAT_COUNT;
        assert_true(shd_format_find(cases[i].name, &found));
        assert_int_equal(found, cases[i].format);
    }
}

static void unknown_formats_are_refused_and_touch_nothing(void **state) {
    (void)state;
    static const char *const names[] = {"", "pn", "pngs", ".png", "png ", "gif", "image/png"};
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        shd_format found = SHD_HDR;
        assert_false(shd_format_find(names[i], &found));
        assert_int_equal(found, SHD_HDR);
    }
}

static void depths_are_named_as_clients_write_them(void **state) {
    (void)state;
    assert_string_equal(shd_depth_name(SHD_U8), "8");
    assert_string_equal(shd_depth_name(SHD_U16), "16");
    assert_string_equal(shd_depth_name(SHD_HALF), "half");
    assert_string_equal(shd_depth_name(SHD_FLOAT), "float");
}

static void the_catalog_is_searched_by_name_and_alias(void **state) {
    (void)state;
    static const char *const aliases[] = {"scene_linear", "yiq LINEAR"};
    static const shd_space_info spaces[] = {
        {"lin_rec709", "", SHD_RGB, true, aliases, 2, SHD_HOLDS_LIGHT, NULL},
        {"YIQ", "", SHD_YIQ, false, NULL, 0, SHD_HOLDS_CODES, NULL},
        {"YIQ linear", "", SHD_YIQ, false, NULL, 0, SHD_HOLDS_CODES, NULL}};
    static const char *const views[] = {"Standard"};
    static const shd_display_info displays[] = {{"sRGB", views, 1, NULL},
                                                {"Display P3", views, 1, NULL}};
    const shd_catalog catalog = {
        .spaces = spaces, .space_count = 3, .displays = displays, .display_count = 2};
    for (size_t i = 0; i < 3; i++)
        assert_ptr_equal(shd_catalog_space(&catalog, spaces[i].name), &spaces[i]);
    for (size_t i = 0; i < 2; i++)
        assert_ptr_equal(shd_catalog_display(&catalog, displays[i].name), &displays[i]);
    assert_ptr_equal(shd_catalog_space(&catalog, "Scene_Linear"), &spaces[0]);
    assert_ptr_equal(shd_catalog_space(&catalog, "yiq"), &spaces[1]);
    assert_ptr_equal(shd_catalog_space(&catalog, "YIQ Linear"),
                     &spaces[2]); /* a name comes first */
    static const char *const wrong[] = {"", "YIQ ", "YI", "lin_rec709x", "srgb"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        assert_null(shd_catalog_space(&catalog, wrong[i]));
        assert_null(shd_catalog_display(&catalog, wrong[i]));
    }
    assert_null(shd_catalog_space(&(shd_catalog){0}, "YIQ"));
}

static void channels_have_the_letters_of_their_space(void **state) {
    (void)state;
    static const char letters[][4] = {"RGB", "XYZ", "YIQ", "HSV", "Lab", "LCh"};
    for (int kind = SHD_RGB; kind <= SHD_LCH; kind++)
        for (int c = 0; c < 3; c++) {
            const char *name = shd_channel_names((shd_channels)kind)[c];
            assert_int_equal(strlen(name), 1);
            assert_int_equal(name[0], letters[kind][c]);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_format_is_found_by_its_own_name),
        cmocka_unit_test(suffixes_are_found_in_any_case),
        cmocka_unit_test(unknown_formats_are_refused_and_touch_nothing),
        cmocka_unit_test(depths_are_named_as_clients_write_them),
        cmocka_unit_test(the_catalog_is_searched_by_name_and_alias),
        cmocka_unit_test(channels_have_the_letters_of_their_space),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
