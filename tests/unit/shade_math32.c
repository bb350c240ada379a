/* The f32 functions of the standard tier against the C library in f64. */
#include "shade/math32.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

/* The largest relative error over every 97th float of [low, high]. */
static double worst(float (*f)(float), double (*reference)(double), float low, float high) {
    double largest = 0;
    for (int32_t bits = shd_bits32(low); bits <= shd_bits32(high); bits += 97) {
        float x = shd_float32(bits);
        double wanted = reference(x);
        double error = fabs(f(x) - wanted) / fabs(wanted);
        if (error > largest) largest = error;
    }
    return largest;
}

static float log1m(float d) {
    return shd_log1m(d);
}

static double log1m_reference(double d) {
    return log1p(-d);
}

static float exp_negative(float x) {
    return shd_exp32(-x);
}

static double exp_negative_reference(double x) {
    return exp(-x);
}

static void log1m_is_within_two_ulps(void **state) {
    (void)state;
    double error = worst(log1m, log1m_reference, 1e-30f, 0.99999994f);
    print_message("log(1-d): %.2e relative\n", error);
    assert_true(error < 2.4e-7); /* 4 half-ulps */
}

static void log1m_of_zero_is_zero(void **state) {
    (void)state;
    assert_true(shd_log1m(0) == 0);
}

static void exp_is_within_two_ulps(void **state) {
    (void)state;
    double error = worst(exp_negative, exp_negative_reference, 1e-30f, 86.9f);
    print_message("exp(-x): %.2e relative\n", error);
    assert_true(error < 2.4e-7);
}

static void exp_vanishes_where_f32_would_be_denormal(void **state) {
    (void)state;
    assert_true(shd_exp32(-87.1f) == 0);
    assert_true(shd_exp32(-1e30f) == 0);
    assert_true(shd_exp32(-INFINITY) == 0);
    assert_true(shd_exp32(0) == 1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(log1m_is_within_two_ulps),
        cmocka_unit_test(log1m_of_zero_is_zero),
        cmocka_unit_test(exp_is_within_two_ulps),
        cmocka_unit_test(exp_vanishes_where_f32_would_be_denormal),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
