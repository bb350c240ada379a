/* Reports and errors: nothing is lost from the count, whatever is kept. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/arena.h"
#include "base/report.h"

static void more_problems_than_are_kept_are_counted(void **state) {
    (void)state;
    enum { COUNT = 3 * SHD_REPORT_KEEP };
    shd_arena *arena = shd_arena_new(1 << 20);
    shd_report report;
    shd_report_init(&report, arena);
    assert_int_equal(report.status, SHD_OK);
    assert_int_equal(shd_report_errors_kept(&report), 0);
    for (int i = 0; i < COUNT; i++) {
        char pointer[32];
        snprintf(pointer, sizeof pointer, "/objects/%d", i);
        shd_report_error(&report, i ? SHD_SCENE : SHD_LIMIT, pointer, "problem %d", i);
        if (i % 3 == 0) shd_report_warning(&report, pointer, "warning %d", i);
    }
    assert_int_equal(report.status, SHD_LIMIT); /* the first error's */
    assert_int_equal(report.error_count, COUNT);
    assert_int_equal(report.warning_count, COUNT / 3);
    assert_int_equal(shd_report_errors_kept(&report), SHD_REPORT_KEEP);
    assert_int_equal(shd_report_warnings_kept(&report), SHD_REPORT_KEEP);
    assert_string_equal(report.errors[63].pointer, "/objects/63");
    assert_string_equal(report.errors[63].detail, "problem 63");
    assert_string_equal(report.warnings[1].detail, "warning 3");
    shd_arena_drop(arena);
}

static void warnings_leave_the_status_alone(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(1 << 20);
    shd_report report;
    shd_report_init(&report, arena);
    shd_report_warning(&report, "", "a word");
    assert_int_equal(report.status, SHD_OK);
    assert_int_equal(shd_report_warnings_kept(&report), 1);
    assert_int_equal(shd_report_errors_kept(&report), 0);
    shd_arena_drop(arena);
}

static void a_full_arena_loses_no_problem(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(0);
    shd_report report;
    shd_report_init(&report, arena);
    shd_report_error(&report, SHD_MEMORY, "/lights/3", "there is no room");
    shd_report_warning(&report, "/lights/4", "nor here");
    assert_int_equal(report.status, SHD_MEMORY);
    assert_int_equal(report.error_count, 1);
    assert_int_equal(report.warning_count, 1);
    assert_string_equal(report.errors[0].pointer, "");
    assert_true(strlen(report.errors[0].detail) > 0);
    assert_true(strlen(report.warnings[0].detail) > 0);
    shd_arena_drop(arena);
}

static void long_texts_are_cut_not_overrun(void **state) {
    (void)state;
    char text[2000];
    memset(text, 'x', sizeof text - 1);
    text[sizeof text - 1] = 0;

    shd_arena *arena = shd_arena_new(1 << 20);
    shd_report report;
    shd_report_init(&report, arena);
    shd_report_error(&report, SHD_SCENE, text, "%s", text);
    assert_int_equal(strlen(report.errors[0].detail), sizeof((shd_error *)0)->text - 1);
    assert_string_equal(report.errors[0].pointer, text); /* a place is never cut */
    shd_arena_drop(arena);

    shd_error error;
    assert_int_equal(shd_fail(&error, SHD_CONFIG, text, "%s", text), SHD_CONFIG);
    assert_int_equal(error.status, SHD_CONFIG);
    assert_int_equal(strlen(error.path), sizeof error.path - 1);
    assert_int_equal(strlen(error.text), sizeof error.text - 1);
}

static void failing_without_an_error_to_fill_keeps_the_status(void **state) {
    (void)state;
    assert_int_equal(shd_fail(NULL, SHD_LIMIT, "/a", "%d", 1), SHD_LIMIT);
    shd_error error;
    shd_fail(&error, SHD_SCENE, NULL, "no place");
    assert_string_equal(error.path, "");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(more_problems_than_are_kept_are_counted),
        cmocka_unit_test(warnings_leave_the_status_alone),
        cmocka_unit_test(a_full_arena_loses_no_problem),
        cmocka_unit_test(long_texts_are_cut_not_overrun),
        cmocka_unit_test(failing_without_an_error_to_fill_keeps_the_status),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
