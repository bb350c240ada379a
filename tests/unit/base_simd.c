/* The vector operations that the language and the processor do not have by themselves. */
#include "base/simd.h"

#include <float.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

static float float_of(uint32_t bits) {
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static uint32_t random_bits(void) {
    return (uint32_t)rand() << 16 ^ (uint32_t)rand();
}

/* The C library's fmaf is right by decree; lanes are taken one by one. */
static void check_fma(const float a[SHD_W], const float b[SHD_W], const float c[SHD_W]) {
    float got[SHD_W];
    shd_vf_store(got, shd_vf_fma(shd_vf_load(a), shd_vf_load(b), shd_vf_load(c)));
    for (int i = 0; i < SHD_W; i++) {
        float wanted = fmaf(a[i], b[i], c[i]);
        if (isnan(wanted) ? !isnan(got[i]) : memcmp(&got[i], &wanted, sizeof wanted))
            fail_msg("fma(%a, %a, %a) is %a, not %a", (double)a[i], (double)b[i], (double)c[i],
                     (double)got[i], (double)wanted);
    }
}

/* Any bits; values of like size, whose sums cancel; sums that lie on or beside a tie of f32. */
static void fma_rounds_once(void **state) {
    (void)state;
    srand(1);
    int twice = 0; /* where rounding to f64 first would give another float */
    for (int round = 0; round < 400000; round++) {
        float a[SHD_W], b[SHD_W], c[SHD_W];
        for (int i = 0; i < SHD_W; i++) {
            switch (round % 4) {
            case 0:
                a[i] = float_of(random_bits());
                b[i] = float_of(random_bits());
                c[i] = float_of(random_bits());
                break;
            case 1:
                a[i] = 1 + (float)(rand() & 0xfff) * FLT_EPSILON;
                b[i] = 1 - (float)(rand() & 0xfff) * FLT_EPSILON;
                c[i] = -1 + (float)(rand() & 0xf) * FLT_EPSILON / 4;
                break;
            case 2: { /* a tie less 2^-70 or so, which a double does not see */
                const float x = (float)(rand() & 0xff) * FLT_EPSILON;
                a[i] = 1 + x;
                b[i] = ldexpf(1 - x, -24);
                c[i] = (rand() & 1 ? -1.0f : 1.0f) * (1 + (float)(rand() & 0xf) * FLT_EPSILON);
                break;
            }
            default: /* results around the smallest normal float */
                a[i] = ldexpf(1 + (float)(rand() & 0xffff) * FLT_EPSILON, -60 - rand() % 20);
                b[i] = ldexpf(1 + (float)(rand() & 0xffff) * FLT_EPSILON, -65 - rand() % 5);
                c[i] = ldexpf((float)(rand() & 0xff) - 128, -149 + rand() % 30);
            }
            double sum = (double)a[i] * (double)b[i] + (double)c[i];
            twice += (float)sum != fmaf(a[i], b[i], c[i]) && !isnan(sum);
        }
        check_fma(a, b, c);
    }
    print_message("%d sums that a double would round twice\n", twice);
    assert_true(twice > 0);
}

static void fma_knows_infinity_and_nan(void **state) {
    (void)state;
    static const float odd[] = {0,       -0.0f,    1,   -1,      INFINITY, -INFINITY,
                                FLT_MAX, -FLT_MAX, NAN, FLT_MIN, 1e-45f,   3};
    enum { COUNT = sizeof odd / sizeof odd[0] };
    for (int i = 0; i < COUNT * COUNT * COUNT; i++) {
        float a[SHD_W], b[SHD_W], c[SHD_W];
        for (int k = 0; k < SHD_W; k++) {
            a[k] = odd[i % COUNT];
            b[k] = odd[i / COUNT % COUNT];
            c[k] = odd[i / COUNT / COUNT];
        }
        check_fma(a, b, c);
    }
}

static void max_takes_the_second_where_the_first_is_nan_or_equal(void **state) {
    (void)state;
    float got[SHD_W];
    shd_vf_store(got, shd_vf_max(shd_vf_set(NAN), shd_vf_set(2)));
    assert_true(got[0] == 2);
    shd_vf_store(got, shd_vf_max(shd_vf_set(-0.0f), shd_vf_set(0)));
    assert_false(signbit(got[0]));
    shd_vf_store(got, shd_vf_max(shd_vf_set(3), shd_vf_set(2)));
    assert_true(got[SHD_W - 1] == 3);
}

static void halves_widen_and_join_again(void **state) {
    (void)state;
    float from[SHD_W], got[SHD_W];
    for (int i = 0; i < SHD_W; i++) from[i] = (float)i + 0.5f;
    shd_vf v = shd_vf_load(from);
    shd_vd low = shd_vd_widen(shd_vf_half(v, 0)), high = shd_vd_widen(shd_vf_half(v, 1));
    double wide[SHD_W];
    shd_vd_store(wide, low);
    shd_vd_store(wide + SHD_W / 2, high);
    for (int i = 0; i < SHD_W; i++) assert_true(wide[i] == (double)from[i]);
    shd_vf_store(got, shd_vf_join(shd_vh_narrow(low), shd_vh_narrow(high)));
    assert_memory_equal(got, from, sizeof got);
}

static void masks_select_and_count(void **state) {
    (void)state;
    float from[SHD_W], got[SHD_W];
    for (int i = 0; i < SHD_W; i++) from[i] = (float)(i % 3);
    shd_vf v = shd_vf_load(from), zero = shd_vf_set(0);
    shd_mf some = shd_vf_gt(v, zero), two = shd_vf_gt_in(some, v, shd_vf_set(1));
    for (int i = 0; i < SHD_W; i++) {
        assert_int_equal(shd_mf_bits(some) >> i & 1, i % 3 > 0);
        assert_int_equal(shd_mf_bits(two) >> i & 1, i % 3 > 1);
        assert_int_equal(shd_mf_bits(shd_mf_not(two)) >> i & 1, i % 3 <= 1);
    }
    assert_false(shd_mf_any(shd_mf_and(two, shd_mf_not(some))));
    shd_vf_store(got, shd_vf_mul_in(two, v, shd_vf_set(4)));
    for (int i = 0; i < SHD_W; i++) assert_true(got[i] == (i % 3 == 2 ? 8 : 0));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(fma_rounds_once),
        cmocka_unit_test(fma_knows_infinity_and_nan),
        cmocka_unit_test(max_takes_the_second_where_the_first_is_nan_or_equal),
        cmocka_unit_test(halves_widen_and_join_again),
        cmocka_unit_test(masks_select_and_count),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
