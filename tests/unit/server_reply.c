/* Answers before they become HTTP: headers that are safe, shared bodies, problems and their limits.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "base/arena.h"
#include "server/answer/problem.h"
#include "server/answer/reply.h"

static const char *value_of(const shd_reply *reply, const char *name) {
    for (size_t i = 0; i < reply->header_count; i++)
        if (!strcmp(reply->headers[i].name, name)) return reply->headers[i].value;
    return NULL;
}

static bool body_has(const shd_reply *reply, const char *text) {
    return memmem(reply->body, reply->size, text, strlen(text));
}

static void header_values_are_made_safe(void **state) {
    (void)state;
    static const struct {
        const char *text, *wanted;
    } cases[] = {
        {"plain", "plain"},
        {"", ""},
        {"a  ", "a"},
        {"100%", "100%25"},
        {"a\r\nX-Evil: 1", "a%0D%0AX-Evil: 1"},
        {"\t\x01\x1f\x7f", "%09%01%1F%7F"},
        {"gr\xc3\xbcn", "gr%C3%BCn"},
        {"\"quoted\\\"", "\"quoted\\\""},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        shd_reply reply = {0};
        shd_reply_header(&reply, "X-Test", "%s", cases[i].text);
        assert_string_equal(value_of(&reply, "X-Test"), cases[i].wanted);
        shd_reply_clear(&reply);
    }
}

/* A value is cut between characters, not within one that is encoded. */
static void long_values_are_cut(void **state) {
    (void)state;
    char text[1200];
    for (int first = 998; first <= 1001; first++) {
        shd_reply reply = {0};
        snprintf(text, sizeof text, "%0*d%%%s", first, 0, "zz");
        shd_reply_header(&reply, "X-Test", "%s", text);
        const char *value = value_of(&reply, "X-Test");
        assert_int_equal(strlen(value), first <= 1000 ? first : 1000);
        assert_null(strchr(value, '%'));
        shd_reply_clear(&reply);
    }
    shd_reply reply = {0};
    snprintf(text, sizeof text, "%0*d%%%s", 997, 0, "zz");
    shd_reply_header(&reply, "X-Test", "%s", text);
    assert_string_equal(value_of(&reply, "X-Test") + 997, "%25");
    shd_reply_clear(&reply);
}

static void warnings_are_strings_of_structured_fields(void **state) {
    (void)state;
    shd_reply reply = {0};
    shd_reply_warning(&reply, "/a\"b\\", "so \"it\" is, \xe2\x82\xac");
    assert_string_equal(value_of(&reply, "Shaded-Warning"),
                        "\"so %22it%22 is, %E2%82%AC\";pointer=\"/a%22b%5C\"");
    shd_reply_clear(&reply);
}

static void more_headers_than_there_is_room_for_are_left_out(void **state) {
    (void)state;
    shd_reply reply = {0}, copy = {0};
    for (int i = 0; i < SHD_REPLY_HEADERS + 5; i++) shd_reply_plain(&reply, "Vary", "Accept");
    assert_int_equal(reply.header_count, SHD_REPLY_HEADERS);
    shd_reply_copy(&copy, &reply);
    assert_int_equal(copy.header_count, SHD_REPLY_HEADERS);
    shd_reply_clear(&reply);
    assert_string_equal(copy.headers[SHD_REPLY_HEADERS - 1].value, "Accept");
    shd_reply_clear(&copy);
}

static void copies_share_a_body_until_the_last_is_gone(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(1 << 20);
    shd_reply reply = {.status = 200, .limit = SHD_LIMIT_QUEUE}, copies[3] = {{0}};
    shd_budget_count(budget, 100);
    shd_reply_give(&reply, "image/png", strdup("picture"), 7);
    shd_reply_count(&reply, budget, 100);
    assert_int_equal(shd_reply_alone(&reply), 7);
    for (size_t i = 0; i < 3; i++) {
        shd_reply_copy(&copies[i], &reply);
        assert_ptr_equal(copies[i].body, reply.body);
        assert_int_equal(copies[i].status, 200);
        assert_int_equal(copies[i].limit, SHD_LIMIT_QUEUE);
    }
    assert_int_equal(shd_reply_alone(&reply), 7 / 4);
    shd_reply_clear(&reply);
    shd_reply_clear(&copies[0]);
    shd_reply_clear(&copies[2]);
    assert_memory_equal(copies[1].body, "picture", 7);
    assert_int_equal(shd_budget_load_of(budget).used, 100);
    shd_reply_strip(&copies[1]);
    assert_int_equal(copies[1].header_count, 0);
    assert_int_equal(copies[1].size, 7);
    shd_reply_clear(&copies[1]);
    assert_int_equal(shd_budget_load_of(budget).used, 0);
    shd_budget_drop(budget);
}

static void what_is_given_or_lent_replaces_what_was_there(void **state) {
    (void)state;
    shd_budget *budget = shd_budget_new(1 << 20);
    shd_reply reply = {.status = 200};
    shd_budget_count(budget, 5);
    shd_reply_give(&reply, "text/plain", strdup("first"), 5);
    shd_reply_count(&reply, budget, 5);
    shd_reply_lend(&reply, "text/plain", "second", 6);
    assert_int_equal(shd_budget_load_of(budget).used, 0);
    assert_int_equal(shd_reply_alone(&reply), 0); /* nothing goes with what is lent */
    shd_budget_count(budget, 9);
    shd_reply_count(&reply, budget, 9);
    assert_int_equal(shd_budget_load_of(budget).used, 0);
    assert_memory_equal(reply.body, "second", 6);
    shd_reply_clear(&reply);
    shd_budget_drop(budget);
}

static void a_raw_message_closes_its_connection(void **state) {
    (void)state;
    for (int with_body = 0; with_body < 2; with_body++) {
        shd_reply reply = {.status = 413};
        shd_reply_lend(&reply, "text/plain", "too\0large", 9);
        shd_reply_plain(&reply, "Connection", "keep-alive");
        size_t length;
        char *text = shd_reply_raw(&reply, with_body, &length);
        assert_memory_equal(text, "HTTP/1.1 413 Content Too Large\r\nDate: ", 38);
        const char *end = strstr(text, "\r\n\r\n");
        assert_non_null(end);
        assert_non_null(strstr(text, "\r\nContent-Length: 9\r\n"));
        assert_non_null(strstr(text, "\r\nConnection: close\r\n"));
        assert_null(strstr(text, "keep-alive"));
        assert_int_equal(length, (size_t)(end + 4 - text) + (with_body ? 9 : 0));
        if (with_body) assert_memory_equal(end + 4, "too\0large", 9);
        free(text);
        shd_reply_clear(&reply);
    }
}

static void problems_have_one_status_each(void **state) {
    (void)state;
    static const struct {
        shd_status status;
        unsigned http;
        const char *type, *retry;
        shd_limit limit;
    } cases[] = {
        {SHD_SYNTAX, 400, "syntax", NULL, SHD_LIMIT_NONE},
        {SHD_SCENE, 422, "scene", NULL, SHD_LIMIT_NONE},
        {SHD_LIMIT, 422, "limit", NULL, SHD_LIMIT_PIXELS},
        {SHD_MEMORY, 422, "limit", NULL, SHD_LIMIT_MEMORY},
        {SHD_MISSING, 409, "unknown-data", NULL, SHD_LIMIT_NONE},
        {SHD_CROWDED, 429, "busy", "1", SHD_LIMIT_NONE},
        {SHD_EXHAUSTED, 503, "memory", "1", SHD_LIMIT_NONE},
        {SHD_CANCELLED, 504, "deadline", NULL, SHD_LIMIT_NONE},
        {SHD_CONFIG, 500, "internal", NULL, SHD_LIMIT_NONE},
        {SHD_INTERNAL, 500, "internal", NULL, SHD_LIMIT_NONE},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        shd_error error;
        shd_reply reply = {0};
        char type[64];
        /* The text names another limit: what is counted is the value. */
        shd_fail(&error, cases[i].status, "/secret", "the limit `queue` is 1");
        if (cases[i].status == SHD_LIMIT) shd_fail_limit(&error, SHD_LIMIT_PIXELS);
        shd_problem_error(&reply, &error);
        snprintf(type, sizeof type, "{\"type\":\"urn:shaded:problem:%s\"", cases[i].type);
        assert_int_equal(reply.status, cases[i].http);
        assert_memory_equal(reply.body, type, strlen(type));
        assert_int_equal(reply.limit, cases[i].limit);
        assert_string_equal(value_of(&reply, "Cache-Control"), "no-store");
        if (cases[i].retry)
            assert_string_equal(value_of(&reply, "Retry-After"), cases[i].retry);
        else
            assert_null(value_of(&reply, "Retry-After"));
        /* What fails inside may name the operator's files. */
        assert_int_equal(body_has(&reply, "/secret"), cases[i].http != 500);
        shd_reply_clear(&reply);
    }
}

static void a_report_tells_its_first_limit(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(1 << 20);
    shd_report report;
    shd_reply reply = {0};
    shd_report_init(&report, arena);
    shd_report_error(&report, SHD_LIMIT, "/image", "too many pixels");
    shd_report_limit(&report, SHD_LIMIT_PIXELS);
    shd_report_error(&report, SHD_LIMIT, "/lights", "too many lights");
    shd_report_limit(&report, SHD_LIMIT_LIGHTS);
    shd_problem_report(&reply, &report, SHD_BAD_SCENE);
    assert_int_equal(reply.status, 422);
    assert_int_equal(reply.limit, SHD_LIMIT_PIXELS);
    assert_true(body_has(&reply, "\"detail\":\"/image: too many pixels (and 1 more)\""));
    shd_reply_clear(&reply);
    /* A scene that is wrong, too, is refused as wrong. */
    shd_report_init(&report, arena);
    shd_report_error(&report, SHD_SCENE, "/image", "no image");
    shd_report_error(&report, SHD_LIMIT, "/lights", "too many lights");
    shd_report_limit(&report, SHD_LIMIT_LIGHTS);
    shd_problem_report(&reply, &report, SHD_BAD_SCENE);
    assert_int_equal(reply.limit, SHD_LIMIT_NONE);
    assert_true(body_has(&reply, "problem:scene"));
    shd_reply_clear(&reply);
    shd_arena_drop(arena);
}

static void text_that_is_no_utf8_is_told_all_the_same(void **state) {
    (void)state;
    shd_reply reply = {0};
    shd_problem_reply(&reply, SHD_BAD_TYPE, "it is \xff\"\n");
    assert_true(body_has(&reply, "\"detail\":\"it is ?\\\"\\n\""));
    assert_false(reply.is_short);
    shd_reply_clear(&reply);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(header_values_are_made_safe),
        cmocka_unit_test(long_values_are_cut),
        cmocka_unit_test(warnings_are_strings_of_structured_fields),
        cmocka_unit_test(more_headers_than_there_is_room_for_are_left_out),
        cmocka_unit_test(copies_share_a_body_until_the_last_is_gone),
        cmocka_unit_test(what_is_given_or_lent_replaces_what_was_there),
        cmocka_unit_test(a_raw_message_closes_its_connection),
        cmocka_unit_test(problems_have_one_status_each),
        cmocka_unit_test(a_report_tells_its_first_limit),
        cmocka_unit_test(text_that_is_no_utf8_is_told_all_the_same),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
