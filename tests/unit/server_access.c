/* Who may ask: files of tokens and keys, origins, networks, and what of an answer is private. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "server/access/access.h"
#include "server/access/client.h"
#include "server/access/private.h"
#include "server/access/tokens.h"

static shd_error error;

static void write_file(char path[32], const void *text, size_t size) {
    strcpy(path, "/tmp/shaded-access-XXXXXX");
    const int fd = mkstemp(path);
    assert_true(fd >= 0);
    assert_int_equal(write(fd, text, size), size);
    close(fd);
}

static shd_status load(const char *text, shd_tokens **out) {
    char path[32];
    write_file(path, text, strlen(text));
    shd_quotas *quotas = shd_quotas_new();
    error.text[0] = 0;
    const shd_status status = shd_tokens_load(path, quotas, out, &error);
    /* Quotas outlive tokens that have rates; these tests ask for none of them. */
    shd_quotas_drop(quotas);
    unlink(path);
    return status;
}

/* The SHA-256 of "0123456789abcdef". */
#define DIGEST "9f9f5111f7b27a781f1f1ddde5ebc2dd2b796bfc7365c9c28b548e564176929f"
#define TOKEN  "0123456789abcdef"

static void lines_of_tokens_are_whole_or_refused(void **state) {
    (void)state;
    static const struct {
        const char *text, *wrong; /* NULL: TOKEN is known */
    } cases[] = {
        {TOKEN, NULL},
        {TOKEN "\r\n", NULL},
        {"\t " TOKEN " \t\n", NULL},
        {"# " TOKEN "\n\n" TOKEN "\n", NULL},
        {"ci sha256:" DIGEST, NULL},
        {"ci \t sha256:" DIGEST " expires=2999-12-31T23:59:59Z", NULL},
        {"ci sha256:" DIGEST " rate=1/day expires=2999-02-28T00:00:00Z", NULL},
        {"", "there is no token"},
        {"# " TOKEN "\n", "there is no token"},
        {TOKEN "\n0123456789abcde\n", "line 2 is no token"},
        {"0123456789abcde!", "line 1 is no token"},
        {TOKEN "\x80", "line 1 holds a character"},
        {TOKEN "\v", "line 1 holds a character"},
        {"ci sha256:" DIGEST "0", "line 1 has no sha256"},
        {"ci SHA256:" DIGEST, "line 1 has no sha256"},
        {"ci md5:" DIGEST, "line 1 has no sha256"},
        {"c! sha256:" DIGEST, "line 1 has a name other"},
        {"012345678901234567890123456789012 sha256:" DIGEST, "line 1 has a name other"},
        {"ci sha256:" DIGEST " expires=2999-02-29T00:00:00Z", "line 1 has other words"},
        {"ci sha256:" DIGEST " expires=2999-01-01T24:00:00Z", "line 1 has other words"},
        {"ci sha256:" DIGEST " expires=2999-01-01T00:00:00", "line 1 has other words"},
        {"ci sha256:" DIGEST " rate=0/day", "line 1 has other words"},
        {"ci sha256:" DIGEST " rate=5/week", "line 1 has other words"},
        {"ci sha256:" DIGEST " rate=5/day rate=5/day", "line 1 has other words"},
        {"ci sha256:" DIGEST " rate=5/day\nci sha256:" DIGEST, "line 2 has another rate"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        shd_tokens *tokens = NULL;
        const shd_status status = load(cases[i].text, &tokens);
        const bool is_known = !status && shd_tokens_admit(tokens, "Bearer " TOKEN);
        shd_tokens_drop(tokens);
        if (cases[i].wrong ? status == SHD_CONFIG && strstr(error.text, cases[i].wrong) : is_known)
            continue;
        print_error("%s: %s\n", cases[i].text, error.text);
        fail();
    }
}

/* The end of a line that is too long is no line: a comment's tail would be a token. */
static void a_long_comment_hides_no_token(void **state) {
    (void)state;
    for (int length = 1000; length <= 1001; length++) {
        char text[1200];
        shd_tokens *tokens = NULL;
        snprintf(text, sizeof text, "#%*s\n" TOKEN "x\n", length - 1, TOKEN);
        assert_int_equal(load(text, &tokens), length == 1000 ? SHD_OK : SHD_CONFIG);
        if (length == 1000) assert_null(shd_tokens_admit(tokens, "Bearer " TOKEN));
        shd_tokens_drop(tokens);
    }
    assert_non_null(strstr(error.text, "longer than 1000"));
    assert_null(strstr(error.text, TOKEN));
}

static void the_field_carries_one_bearer_token(void **state) {
    (void)state;
    shd_tokens *tokens;
    assert_int_equal(load("ci sha256:" DIGEST "\nold sha256:" DIGEST
                          " expires=2001-01-01T00:00:00Z\nanother-token-0123456789",
                          &tokens),
                     SHD_OK);
    static const struct {
        const char *field, *name; /* NULL: none is admitted */
    } cases[] = {
        {"Bearer " TOKEN, "ci"},
        {"bEARER   " TOKEN, "ci"},
        {"Bearer another-token-0123456789", ""},
        {NULL, NULL},
        {"", NULL},
        {"Bearer", NULL},
        {"Bearer ", NULL},
        {"Bearer\t" TOKEN, NULL},
        {"Bearer " TOKEN " ", NULL},
        {"Bearer " TOKEN ", Bearer " TOKEN, NULL},
        {"Bearer 0123456789ABCDEF", NULL},
        {"Bearer 0123456789abcde", NULL},
        {"Bearer " DIGEST, NULL},
        {"Bearer sha256:" DIGEST, NULL},
        {"Basic " TOKEN, NULL},
        {TOKEN, NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const shd_token *token = shd_tokens_admit(tokens, cases[i].field);
        const char *wanted = cases[i].name;
        if (wanted ? token && !strcmp(token->name, wanted) : !token) continue;
        print_error("%s\n", cases[i].field ? cases[i].field : "no field");
        fail();
    }
    shd_tokens_drop(tokens);
    assert_int_equal(load("old sha256:" DIGEST " expires=2001-01-01T00:00:00Z", &tokens), SHD_OK);
    assert_null(shd_tokens_admit(tokens, "Bearer " TOKEN));
    shd_tokens_drop(tokens);
}

static void a_link_is_signed_by_any_of_the_keys(void **state) {
    (void)state;
    static const char file[] = "# keys\nJefeJefeJefeJefeJefeJefeJefeJefe\n"
                               "abcdefghijklmnopqrstuvwxyz012345\n";
    static const char text[] = "/v1/preview/gold?width=64";
    /* printf /v1/preview/gold?width=64 | openssl dgst -sha256 -hmac KEY -binary | basenc
     * --base64url */
    static const char first[] = "4ghnO5a1hdqKeYN7_UIUinlQr3BDPQrv8FEsIqALMZE",
                      second[] = "zFf4fT0TFdDO0kIuJ5LGGTRpKwBYImDl5yqsPRKcCIE";
    char path[32], wrong[sizeof first + 1];
    shd_keys *keys;
    write_file(path, file, sizeof file - 1);
    assert_int_equal(shd_keys_load(path, &keys, &error), SHD_OK);
    unlink(path);
    assert_true(shd_keys_signed(keys, text, sizeof text - 1, first));
    assert_true(shd_keys_signed(keys, text, sizeof text - 1, second));
    assert_false(shd_keys_signed(keys, text, sizeof text - 2, first));
    assert_false(shd_keys_signed(keys, text, sizeof text - 1, ""));
    snprintf(wrong, sizeof wrong, "%s=", first);
    assert_false(shd_keys_signed(keys, text, sizeof text - 1, wrong));
    for (size_t i = 0; i < sizeof first - 1; i++) {
        strcpy(wrong, first);
        wrong[i] ^= 1;
        assert_false(shd_keys_signed(keys, text, sizeof text - 1, wrong));
    }
    shd_keys_drop(keys);
    write_file(path, file, 30);
    assert_int_equal(shd_keys_load(path, &keys, &error), SHD_CONFIG);
    assert_non_null(strstr(error.text, "line 2 is no key"));
    unlink(path);
}

static void origins_are_whole(void **state) {
    (void)state;
    static const struct {
        const char *list, *told; /* NULL: it is none */
    } cases[] = {
        {"", ""},
        {" , \t", ""},
        {"*", "*"},
        {"https://a.example,http://b.example:8080", "https://a.example, http://b.example:8080"},
        {"https://a.example *", "https://a.example, *"},
        {"http://[::1]:8080", "http://[::1]:8080"},
        {"null", NULL},
        {"https://", NULL},
        {"://a.example", NULL},
        {"https://a.example/", NULL},
        {"https://A.example", NULL},
        {"a.example", NULL},
        {"https://a.example **", NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *told = NULL;
        const shd_status status = shd_origins_list(cases[i].list, &told, &error);
        const bool good =
            cases[i].told ? !status && !strcmp(told, cases[i].told) : status == SHD_CONFIG && !told;
        free(told);
        if (good) continue;
        print_error("%s\n", cases[i].list);
        fail();
    }
    static const char list[] = "https://a.example, http://b.example:8080";
    assert_true(shd_origins_admit(list, "https://a.example"));
    assert_true(shd_origins_admit(list, "http://b.example:8080"));
    assert_false(shd_origins_admit(list, "http://a.example"));
    assert_false(shd_origins_admit(list, "https://a.example.evil"));
    assert_false(shd_origins_admit(list, "https://a.exampl"));
    assert_false(shd_origins_admit(list, "http://b.example"));
    assert_false(shd_origins_admit(list, ""));
    assert_false(shd_origins_admit("", "https://a.example"));
    assert_true(shd_origins_admit(" *", "null"));
}

static void private_policies_say_nothing_to_shared_caches(void **state) {
    (void)state;
    static const struct {
        const char *policy;
        long long left; /* -1: for ever */
        const char *wanted;
    } cases[] = {
        {"", -1, "private"},
        {"public, max-age=3600", -1, "private, max-age=3600"},
        {"PUBLIC,S-MaxAge=9 , proxy-revalidate", -1, "private"},
        {"private=\"a, public\", max-age=5", -1, "private, max-age=5"},
        {"publicity=1, max-age=5", -1, "private, publicity=1, max-age=5"},
        {"ext=\"public, s-maxage=1\", no-transform", -1,
         "private, ext=\"public, s-maxage=1\", no-transform"},
        {"public, max-age=3600", 60, "private, max-age=60, must-revalidate"},
        {"public, max-age=30", 60, "private, max-age=30, must-revalidate"},
        {"max-age=\"30\"", 60, "private, max-age=30, must-revalidate"},
        {"max-age=30, max-age=20, must-revalidate", 60, "private, max-age=20, must-revalidate"},
        {"no-store", 0, "private, no-store, max-age=0, must-revalidate"},
        {"stale-while-revalidate=60, stale-if-error=9, immutable", 7,
         "private, immutable, max-age=7, must-revalidate"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char out[SHD_POLICY_SIZE];
        shd_private_policy(cases[i].policy, cases[i].left, out);
        assert_string_equal(out, cases[i].wanted);
    }
}

static void only_answers_that_are_kept_become_private(void **state) {
    (void)state;
    for (int i = 0; i < 4; i++) {
        const bool has_token = i & 1, is_error = i & 2;
        shd_reply reply = {.status = is_error ? 404 : 200};
        shd_reply_plain(&reply, "Cache-Control", "public");
        shd_private_apply(&reply, has_token, 0);
        assert_string_equal(reply.headers[0].value, has_token && !is_error ? "private" : "public");
        assert_int_equal(reply.header_count, has_token && !is_error ? 2 : 1);
        shd_reply_clear(&reply);
    }
    shd_reply reply = {.status = 304};
    shd_reply_plain(&reply, "Cache-Control", "public, max-age=60");
    shd_private_apply(&reply, false, 1); /* it has passed */
    assert_string_equal(reply.headers[0].value, "private, max-age=0, must-revalidate");
    assert_int_equal(reply.header_count, 1);
    shd_reply_clear(&reply);
}

static void networks_have_as_many_bits_as_their_addresses(void **state) {
    (void)state;
    static const struct {
        const char *list;
        bool good;
    } cases[] = {
        {"", true},
        {"10.0.0.0/8, ::1 unix", true},
        {"0.0.0.0/0", true},
        {"10.0.0.0/32", true},
        {"10.0.0.0/33", false},
        {"::/128", true},
        {"::/129", false},
        {"10.0.0.0/", false},
        {"10.0.0.0/+8", false},
        {"10.0.0.0/8/8", false},
        {"10.0.0.0/99999999999999999999", false},
        {"10.0.0", false},
        {"10.0.0.256", false},
        {"010.0.0.1", false},
        {"localhost", false},
        {"unix/8", false},
        {"[::1]", false},
        {"10.0.0.1:80", false},
        {"00000000000000000000000000000000000000000000000000000000000010.0.0.1", false},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        shd_networks *networks = NULL;
        const shd_status status = shd_networks_new(cases[i].list, &networks, &error);
        shd_networks_drop(networks);
        if (status == (cases[i].good ? SHD_OK : SHD_CONFIG)) continue;
        print_error("%s\n", cases[i].list);
        fail();
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lines_of_tokens_are_whole_or_refused),
        cmocka_unit_test(a_long_comment_hides_no_token),
        cmocka_unit_test(the_field_carries_one_bearer_token),
        cmocka_unit_test(a_link_is_signed_by_any_of_the_keys),
        cmocka_unit_test(origins_are_whole),
        cmocka_unit_test(private_policies_say_nothing_to_shared_caches),
        cmocka_unit_test(only_answers_that_are_kept_become_private),
        cmocka_unit_test(networks_have_as_many_bits_as_their_addresses),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
