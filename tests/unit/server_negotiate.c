/* What Accept-Encoding and If-None-Match mean. */
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

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(gzip_is_taken_where_it_is_liked_no_less_than_nothing),
        cmocka_unit_test(a_star_matches_only_where_it_is_asked_to),
        cmocka_unit_test(json_is_told_by_its_type_or_its_suffix),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
