/* Rates of tokens: how many requests they let in, and when the next one may come. Times are made
 * up. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "server/access/quota.h"

static shd_rate rate_of(const char *text) {
    shd_rate rate = {0, 0};
    assert_true(shd_rate_read(text, &rate));
    return rate;
}

static int make(void **state) {
    return !(*state = shd_quotas_new());
}

static int drop(void **state) {
    shd_quotas_drop(*state);
    return 0;
}

static void rates_are_read(void **state) {
    (void)state;
    static const char *const wrong[] = {"",
                                        "/minute",
                                        "1",
                                        "1/",
                                        "0/second",
                                        "-1/second",
                                        "+1/second",
                                        " 1/second",
                                        "1/minutes",
                                        "1/Minute",
                                        "1.5/second",
                                        "1000001/day",
                                        "99999999999999999999/day",
                                        "1/60",
                                        "1//day",
                                        "0x1/day"};
    shd_rate rate = rate_of("100/minute");
    assert_int_equal(rate.count, 100);
    assert_int_equal(rate.seconds, 60);
    assert_string_equal(shd_rate_unit(rate), "minute");
    assert_int_equal(rate_of("1/second").seconds, 1);
    assert_int_equal(rate_of("007/hour").seconds, 3600);
    assert_int_equal(rate_of("1000000/day").count, 1000000);
    assert_string_equal(shd_rate_unit(rate_of("3/day")), "day");
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        if (shd_rate_read(wrong[i], &rate)) fail_msg("\"%s\" is a rate", wrong[i]);
}

static void a_full_bucket_lets_so_many_in_and_then_one_at_a_time(void **state) {
    shd_quotas *quotas = *state;
    shd_quota *ci = shd_quotas_get(quotas, "ci");
    const shd_rate rate = rate_of("6/minute");
    double now = 1e6;
    for (int i = 0; i < 6; i++) assert_true(shd_quota_take(quotas, ci, rate, now) == 0);
    assert_true(fabs(shd_quota_take(quotas, ci, rate, now) - 10) < 1e-6);
    /* What was refused is not counted. */
    assert_true(fabs(shd_quota_take(quotas, ci, rate, now + 4) - 6) < 1e-6);
    for (int i = 1; i < 1000; i++) {
        now += 10;
        assert_true(shd_quota_take(quotas, ci, rate, now) == 0);
        assert_true(fabs(shd_quota_take(quotas, ci, rate, now) - 10) < 1e-4);
    }
    /* It is never fuller than full. */
    now += 1e6;
    for (int i = 0; i < 6; i++) assert_true(shd_quota_take(quotas, ci, rate, now) == 0);
    assert_true(shd_quota_take(quotas, ci, rate, now) > 0);
}

/* Whoever comes again when it is told to, in whole seconds, is let in. */
static void what_is_told_is_true(void **state) {
    static const char *const rates[] = {"1/second",    "7/second", "3/minute", "1000/hour",
                                        "1000000/day", "1/day",    "11/day"};
    shd_quotas *quotas = *state;
    for (size_t r = 0; r < sizeof rates / sizeof rates[0]; r++) {
        shd_quota *quota = shd_quotas_get(quotas, rates[r]);
        const shd_rate rate = rate_of(rates[r]);
        double now = 12345.678, wait = 0;
        for (uint32_t i = 0; i < rate.count; i++)
            assert_true(shd_quota_take(quotas, quota, rate, now) == 0);
        for (int i = 0; i < 1000; i++) {
            while ((wait = shd_quota_take(quotas, quota, rate, now)) == 0) continue;
            /* Not a moment earlier. */
            assert_true(shd_quota_take(quotas, quota, rate, now + wait * 0.99) > 0);
            now += ceil(wait);
            assert_true(shd_quota_take(quotas, quota, rate, now) == 0);
        }
    }
}

static void names_have_their_own_and_keep_it(void **state) {
    shd_quotas *quotas = *state;
    shd_quota *a = shd_quotas_get(quotas, "a"), *b = shd_quotas_get(quotas, "b");
    const shd_rate two = rate_of("2/day"), three = rate_of("3/day"), one = rate_of("1/day");
    assert_ptr_equal(shd_quotas_get(quotas, "a"), a);
    assert_ptr_not_equal(a, b);
    for (int i = 0; i < 2; i++) assert_true(shd_quota_take(quotas, a, two, 0) == 0);
    assert_true(shd_quota_take(quotas, a, two, 0) > 0);
    assert_true(shd_quota_take(quotas, b, two, 0) == 0);
    /* Another rate: what is used stays used. */
    assert_true(shd_quota_take(quotas, a, three, 0) == 0);
    assert_true(shd_quota_take(quotas, a, three, 0) > 0);
    assert_true(fabs(shd_quota_take(quotas, a, one, 0) - 3 * 86400) < 1);
}

static void all_are_counted(void **state) {
    shd_quotas *quotas = *state;
    shd_quota *quota = shd_quotas_get(quotas, "counted");
    shd_quotas_get(quotas, "idle");
    for (int i = 0; i < 5; i++) shd_quota_take(quotas, quota, rate_of("2/day"), 0);
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    shd_quotas_print(quotas, out);
    assert_int_equal(fclose(out), 0);
    static const char *const lines[] = {
        "{token=\"counted\",result=\"admitted\"} 2\n", "{token=\"counted\",result=\"refused\"} 3\n",
        "{token=\"idle\",result=\"admitted\"} 0\n", "{token=\"idle\",result=\"refused\"} 0\n"};
    for (size_t i = 0; i < sizeof lines / sizeof lines[0]; i++)
        if (!strstr(text, lines[i])) fail_msg("%s", text);
    free(text);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rates_are_read),
        cmocka_unit_test(a_full_bucket_lets_so_many_in_and_then_one_at_a_time),
        cmocka_unit_test(what_is_told_is_true),
        cmocka_unit_test(names_have_their_own_and_keep_it),
        cmocka_unit_test(all_are_counted),
    };
    return cmocka_run_group_tests(tests, make, drop);
}
