/* What Accept, Accept-Encoding, Content-Type and If-None-Match mean. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "server/answer/negotiate.h"

typedef struct decision {
    const char *field;
    bool wanted;
} decision;

static void gzip_is_taken_where_it_is_liked_no_less_than_nothing(void **state) {
    (void)state;
    static const decision cases[] = {
        {NULL, false},
        {"", false},
        {" , ,", false},
        {"gzip", true},
        {"X-GZIP", true},
        {"gzip;q=0", false},
        {"gzip;q=0.000", false},
        {"gzip;q=0.001", true},
        {"gzip ; Q=0.5 , identity;q=0.5", true},
        {"gzip;q=0.499,identity;q=0.5", false},
        {"gzip;q=0.001,identity;q=0", true},
        {"identity;q=0", false},
        {"identity;q=0, *", true},
        {"*", true},
        {"*;q=0", false},
        {"*;q=0, gzip", true},
        {"gzip;q=0, *", false},
        {"identity, *;q=0.9", false},
        {"deflate, br;q=1.0", false},
        {"gzip2", false},
        {"gzi", false},
        {"br;x=\"gzip, gzip\", deflate", false},
        {"br;x=\", gzip", false}, /* quotes that do not end */
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        if (shd_accepts_gzip(cases[i].field) == cases[i].wanted) continue;
        print_error("%s\n", cases[i].field);
        fail();
    }
}

static void a_star_matches_only_where_it_is_asked_to(void **state) {
    (void)state;
    static const char tag[] = "0123abcd";
    for (int star = 0; star < 2; star++) {
        assert_int_equal(shd_etag_matches("*", tag, star), star);
        assert_int_equal(shd_etag_matches(" * ", tag, star), star);
        assert_int_equal(shd_etag_matches("\"other\", *", tag, star), star);
        assert_true(shd_etag_matches("*, \"0123abcd\"", tag, star));
        assert_true(shd_etag_matches("W/\"0123abcd\"", tag, star));
        assert_false(shd_etag_matches("0123abcd", tag, star));
        assert_false(shd_etag_matches("\"*\"", tag, star));
        assert_false(shd_etag_matches(NULL, tag, star));
    }
}

static void json_is_told_by_its_type_or_its_suffix(void **state) {
    (void)state;
    static const decision cases[] = {
        {NULL, false},
        {"application/json", true},
        {" Application/JSON ; charset=utf-8", true},
        {"application/problem+json", true},
        {"model/vnd.scene+JSON", true},
        {"text/plain", false},
        {"/scene+json", false}, /* of no kind */
        {"application/+json", false},
        {"scene+json", false},
        {"+json", false},
        {"application/json2", false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        if (shd_is_json(cases[i].field) == cases[i].wanted) continue;
        print_error("%s\n", cases[i].field);
        fail();
    }
}

/* The most exact range decides on a type, whatever others say and in whatever order. */
static void the_most_exact_range_decides(void **state) {
    (void)state;
    static const decision cases[] = {
        {NULL, true},
        {"", true},
        {" \t", true},
        {"application/json", true},
        {"APPLICATION/Json", true},
        {"*/*", true},
        {"application/*", true},
        {"text/*", false},
        {"image/png, text/html", false},
        {"application/json;q=0", false},
        {"*/*, application/json;q=0", false},
        {"application/json;q=0, */*", false},
        {"*/*, application/*;q=0", false},
        {"*/*;q=0, application/*", true},
        {"application/*;q=0, application/json;q=0.001", true},
        {"*/*;q=0", false},
        {"application/json;q=0.000", false},
        {"application/json;q=1.000", true},
        {"application/json;q=.5", true},   /* no number: as if there were none */
        {"application/json; q=nan", true}, /* the same */
        {"application/json; Q=0", false},
        {"application/json;version=1;q=0", false},
        {"application/json;title=\";q=0\"", true},
        {"text/plain;title=\", application/json, \"", false},
        {"text/plain;title=\"\\\", application/json\"", false},
        {"text/plain;title=\"\", application/json", true},
        {",,application/json,", true},
        {"application/jsonp", false},
        {"application/jso", false},
        {"application", false},
        {"application/", false},
        {"*", false},
        {"*/json", false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        if (shd_accepts(cases[i].field, "application/json") == cases[i].wanted) continue;
        print_error("%s\n", cases[i].field);
        fail();
    }
}

/* Formats that need no OpenImageIO. */
static void the_picture_is_of_the_format_that_is_liked_best(void **state) {
    (void)state;
    static const struct {
        const char *field;
        int wanted; /* -1: none */
    } cases[] = {
        {NULL, SHD_PNG},
        {"", SHD_PNG},
        {"*/*", SHD_PNG},
        {"image/*", SHD_PNG},
        {"image/jpeg", SHD_JPEG},
        {"image/jpg", SHD_JPEG},
        {"image/PJPEG", SHD_JPEG},
        {"image/webp;q=0.9, image/jpeg;q=0.8", SHD_WEBP},
        {"image/webp;q=0.8, image/jpeg;q=0.80", SHD_JPEG},
        {"image/webp, image/*;q=0.9", SHD_WEBP},
        {"image/webp, */*;q=0.8", SHD_WEBP},
        {"image/png;q=0, image/jpeg;q=0, image/webp;q=0.1, text/html", SHD_WEBP},
        {"image/png;q=0, image/jpeg;q=0.1", SHD_JPEG},
        {"image/jpg;q=0.3, image/jpeg;q=0.1, image/webp;q=0.2", SHD_WEBP},
        {"image/jpg;q=0, image/jpeg", SHD_JPEG}, /* its own name is as exact, and asked first */
        {"image/png;q=5", SHD_PNG},
        {"image/png;q=0.9, image/jpeg;q=5, image/webp", SHD_JPEG},
        {"image/avif,image/webp,image/apng,image/svg+xml,image/*,*/*;q=0.8", SHD_PNG},
        {"text/html, application/xhtml+xml", -1},
        {"image/*;q=0", -1},
        {"multipart/form-data", -1},
        {"image/png2", -1},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        shd_format format;
        const int got = shd_accepts_picture(cases[i].field, &format) ? (int)format : -1;
        if (got == cases[i].wanted) continue;
        print_error("%s: %d\n", cases[i].field, got);
        fail();
    }
}

static void tags_are_compared_weakly_and_whole(void **state) {
    (void)state;
    static const decision cases[] = {
        {"\"abc\"", true},
        {"W/\"abc\"", true},
        {"\"x\" , W/\"abc\"\t", true},
        {"\"a,b\", \"abc\"", true},
        {"\"x, \"abc\"", false}, /* the first one's quotes end before abc */
        {"w/\"abc\"", false},
        {"W/ \"abc\"", false},
        {"\"ABC\"", false},
        {"\"abc", false},
        {"\"abcd\"", false},
        {"\"ab\"", false},
        {"\"\"", false},
        {"", false},
        {",", false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        if (shd_etag_matches(cases[i].field, "abc", false) == cases[i].wanted) continue;
        print_error("%s\n", cases[i].field);
        fail();
    }
}

static void binary_bodies_say_so(void **state) {
    (void)state;
    assert_true(shd_is_binary("application/octet-stream"));
    assert_true(shd_is_binary(" Application/Octet-Stream;x=y"));
    assert_false(shd_is_binary("application/octet-streams"));
    assert_false(shd_is_binary("application/octet"));
    assert_false(shd_is_binary(NULL));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gzip_is_taken_where_it_is_liked_no_less_than_nothing),
        cmocka_unit_test(a_star_matches_only_where_it_is_asked_to),
        cmocka_unit_test(json_is_told_by_its_type_or_its_suffix),
        cmocka_unit_test(the_most_exact_range_decides),
        cmocka_unit_test(the_picture_is_of_the_format_that_is_liked_best),
        cmocka_unit_test(tags_are_compared_weakly_and_whole),
        cmocka_unit_test(binary_bodies_say_so),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
