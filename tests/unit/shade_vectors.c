/* The functions of the kernels on vectors, f64 against 113-bit floats and f32 against f64. */
#include "base/vec3.h"
#include "shade/math64_simd.h"
#include "shade/math_simd.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

/* 113 bits by gcc on x86-64, where `long double` has 64; there are others where it has 113. */
#if __has_include(<quadmath.h>)
#include <quadmath.h>
typedef __float128 wide;
#define wide_exp   expq
#define wide_log1p log1pq
#define wide_expm1 expm1q
#define wide_atan2 atan2q
#else
typedef long double wide;
#define wide_exp   expl
#define wide_log1p log1pl
#define wide_expm1 expm1l
#define wide_atan2 atan2l
#endif

static double exp_of(double x) {
    double out[SHD_W / 2];
    shd_vd_store(out, shd_exp64(shd_vd_set(x)));
    return out[0];
}

static double fall_of(double x) {
    double out[SHD_W / 2];
    shd_vd_store(out, shd_fall64(shd_vd_set(x)));
    return out[0];
}

static double log1m_of(double d) {
    double out[SHD_W / 2];
    shd_vd_store(out, shd_log1m64(shd_vd_set(d)));
    return out[0];
}

static double atan2_of(double y, double x) {
    double out[SHD_W / 2];
    shd_vd_store(out, shd_atan2_64(shd_vd_set(y), shd_vd_set(x)));
    return out[0];
}

/* A number between 2^low and 2^high, evenly in its exponent. */
static double some(double low, double high) {
    return exp2(low + (high - low) * (rand() / (RAND_MAX + 1.0)));
}

static double relative(double got, wide wanted) {
    wide error = ((wide)got - wanted) / wanted;
    return fabs((double)error);
}

static void exp_is_within_an_ulp(void **state) {
    (void)state;
    srand(1);
    double worst = 0;
    for (int i = 0; i < 200000; i++) {
        double x = -some(-60, log2(700));
        worst = fmax(worst, relative(exp_of(x), wide_exp((wide)x)));
    }
    print_message("exp: %.2e relative\n", worst);
    assert_true(worst < 2.3e-16);
}

static void falls_are_within_some_ulps(void **state) {
    (void)state;
    srand(4);
    double worst = 0;
    for (int i = 0; i < 200000; i++) {
        const double x = -some(-300, 9.45);
        worst = fmax(worst, relative(fall_of(x), -wide_expm1((wide)x)));
    }
    print_message("1 - exp: %.2e relative\n", worst);
    assert_true(worst < 5e-16);
    assert_true(fall_of(0) == 0 && fall_of(-700) == 1);
}

static void log_is_within_an_ulp(void **state) {
    (void)state;
    srand(2);
    double worst = 0;
    for (int i = 0; i < 200000; i++) {
        double d = i % 2 ? some(-70, 0) : 1 - some(-53, -1);
        if (!(d < 1)) continue;
        worst = fmax(worst, relative(log1m_of(d), wide_log1p(-(wide)d)));
    }
    print_message("log(1 - d): %.2e relative\n", worst);
    assert_true(worst < 2.3e-16);
}

static void angles_are_within_some_ulps(void **state) {
    (void)state;
    srand(3);
    double worst = 0;
    for (int i = 0; i < 200000; i++) {
        const double x = (i & 1 ? -1 : 1) * some(-i % 60, 0), y = (i & 2 ? -1 : 1) * some(-20, 0);
        worst = fmax(worst, relative(atan2_of(y, x), wide_atan2((wide)y, (wide)x)));
    }
    print_message("atan2: %.2e relative\n", worst);
    assert_true(worst < 6e-16); /* a quotient, a polynomial and a difference of pi / 2 */
    assert_true(atan2_of(0, 0) == 0 && atan2_of(0, 1) == 0);
    assert_true(atan2_of(1, 0) == SHD_PI / 2 && atan2_of(-1, 0) == -SHD_PI / 2);
    assert_true(atan2_of(0, -1) == SHD_PI && fabs(atan2_of(1, 1) - SHD_PI / 4) < 2e-16);
}

static void ends_are_exact(void **state) {
    (void)state;
    assert_true(exp_of(0) == 1 && exp_of(-0.0) == 1);
    assert_true(exp_of(-0x1p-60) <= 1);
    assert_true(exp_of(-700) > 0);
    assert_true(log1m_of(0) == 0);
    assert_true(fabs(log1m_of(1 - 0x1p-53) / (-53 * log(2)) - 1) < 1e-15);
}

static double exp2_of(float t) {
    float out[SHD_W];
    shd_vf_store(out, shd_exp2(shd_vf_set(t)));
    return (double)out[0];
}

static double log2_of(float d) {
    float out[SHD_W];
    shd_vf_store(out, shd_log2_1m(shd_vf_set(d)));
    return (double)out[0];
}

static void exp2_is_near_an_ulp_of_f32(void **state) {
    (void)state;
    srand(3);
    double worst = 0;
    for (int i = 0; i < 400000; i++) {
        float t = -(float)some(-22.9, log2(125));
        double wanted = exp2((double)t);
        worst = fmax(worst, fabs(exp2_of(t) / wanted - 1));
        assert_true(exp2_of(t) <= 1);
    }
    print_message("2^t: %.2e relative\n", worst);
    assert_true(worst < 1.8e-7);
    assert_true(exp2_of(0) == 1);
    assert_true(exp2_of(-125) > 0);
}

static void log2_is_near_an_ulp_of_f32(void **state) {
    (void)state;
    srand(4);
    double worst = 0;
    for (int i = 0; i < 400000; i++) {
        float d = (float)(i % 2 ? some(-40, 0) : 1 - some(-24, -1));
        if (!(d < 1)) continue;
        double wanted = log1p(-(double)d) / log(2);
        worst = fmax(worst, fabs(log2_of(d) / wanted - 1));
    }
    print_message("log2(1 - d): %.2e relative\n", worst);
    assert_true(worst < 2.4e-7);
    assert_true(log2_of(0) == 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exp_is_within_an_ulp),
        cmocka_unit_test(falls_are_within_some_ulps),
        cmocka_unit_test(log_is_within_an_ulp),
        cmocka_unit_test(angles_are_within_some_ulps),
        cmocka_unit_test(ends_are_exact),
        cmocka_unit_test(exp2_is_near_an_ulp_of_f32),
        cmocka_unit_test(log2_is_near_an_ulp_of_f32),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
