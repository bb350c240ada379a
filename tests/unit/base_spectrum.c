/* Spectra: white is white, RGB makes the round trip, and curves are what they say. */
#include "base/spectrum.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

static const shd_affine SAME = {.linear = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

/* Rec.709 to ACEScg, rounded: any matrix will do. */
static const shd_affine WIDER = {
    .linear = {{0.6131, 0.3395, 0.0474}, {0.0702, 0.9164, 0.0134}, {0.0206, 0.1096, 0.8698}}};

/* Sums of up to 256 rounded products of numbers near 1, and two inverses of matrices whose
 * condition is below 10. */
static const double NEAR = 1e-12;

static void near_to(const double a[3], const double b[3], double by) {
    for (int c = 0; c < 3; c++)
        if (!(fabs(a[c] - b[c]) <= by)) fail_msg("%.17g is not %.17g", a[c], b[c]);
}

/* All of [0,1] cubed in steps of 1/4, as surfaces in white light and as lights on white. */
static void round_trips(const shd_bins *bins) {
    double k[SHD_BINS_MOST], w[SHD_BINS_MOST][3], out[3];
    for (int i = 0; i < 125; i++) {
        const double rgb[3] = {i % 5 / 4.0, i / 5 % 5 / 4.0, i / 25 / 4.0};
        shd_bins_lift(bins, rgb, k);
        shd_bins_mix(bins->count, k, (const double(*)[3])bins->white, out);
        near_to(out, rgb, NEAR);
        memset(w, 0, sizeof w);
        shd_bins_add_lifted(bins, rgb, w);
        shd_bins_mix(bins->count, NULL, (const double(*)[3])w, out);
        near_to(out, rgb, NEAR);
    }
}

static void rgb_makes_the_round_trip(void **state) {
    (void)state;
    static const double ends[][2] = {{380, 730}, {360, 830}, {371.3, 781.9}};
    static const size_t counts[] = {16, 17, 36, 71, 256};
    for (size_t i = 0; i < 15; i++) {
        shd_arena *arena = shd_arena_new(1 << 20);
        shd_bins bins;
        assert_true(
            shd_bins_make(counts[i % 5], ends[i / 5][0], ends[i / 5][1], &SAME, arena, &bins));
        round_trips(&bins);
        shd_arena_drop(arena);
    }
}

/* A white surface under D65, by its name and as its samples, is white, in any number of bins. The
 * colors of greys are grey. */
static void white_is_white(void **state) {
    (void)state;
    const double one[1] = {1}, at[1] = {555}, white[3] = {1, 1, 1}, grey[3] = {0.25, 0.25, 0.25};
    const shd_curve flat = {.count = 1, .at = at, .values = one, .scale = 0.25};
    shd_curve_kind kind;
    const shd_curve d65 = shd_curve_named(3, &kind);
    assert_string_equal(d65.name, "D65");
    for (size_t count = SHD_BINS_LEAST; count <= SHD_BINS_MOST; count += 24) {
        double k[SHD_BINS_MOST], w[SHD_BINS_MOST][3] = {{0}}, out[3];
        shd_arena *arena = shd_arena_new(1 << 20);
        shd_bins bins;
        assert_true(shd_bins_make(count, 380, 730, &SAME, arena, &bins));
        assert_true(shd_bins_add_light(&bins, &d65, w));
        shd_bins_mix(count, NULL, (const double(*)[3])w, out);
        near_to(out, white, NEAR);
        shd_bins_reflect(&bins, &flat, k);
        shd_bins_mix(count, k, (const double(*)[3])w, out);
        near_to(out, grey, NEAR);
        shd_arena_drop(arena);
    }
    double rgb[3];
    shd_eye eye;
    assert_true(shd_eye_make(&eye));
    assert_true(shd_curve_rgb(&eye, &d65, SHD_CURVE_LIGHT, rgb));
    near_to(rgb, white, 1e-9); /* the primaries have ten decimals */
    assert_true(shd_curve_rgb(&eye, &flat, SHD_CURVE_REFLECTANCE, rgb));
    near_to(rgb, grey, 1e-9);
}

static void working_spaces_are_matrices(void **state) {
    (void)state;
    shd_arena *arena = shd_arena_new(1 << 20);
    shd_bins bins;
    assert_true(shd_bins_make(16, 380, 730, &WIDER, arena, &bins));
    round_trips(&bins);
    shd_arena_drop(arena);
}

static void curves_are_linear_and_end_constant(void **state) {
    (void)state;
    const double at[] = {400, 450, 470}, values[] = {1, 3, 2};
    const shd_curve curve = {.count = 3, .at = at, .values = values, .scale = 9},
                    even = {.count = 3, .first = 400, .step = 10, .values = values, .scale = 9};
    const double asked[][3] = {{1, 1, 1},     {400, 1, 1},     {405, 1.2, 2}, {425, 2, 2},
                               {450, 3, 2},   {465, 2.25, 2},  {470, 2, 2},   {5000, 2, 2},
                               {410, 1.4, 3}, {415, 1.6, 2.5}, {420, 1.8, 2}};
    for (size_t i = 0; i < sizeof asked / sizeof asked[0]; i++) {
        assert_true(fabs(shd_curve_value(&curve, asked[i][0]) - asked[i][1]) < 1e-14);
        assert_true(fabs(shd_curve_value(&even, asked[i][0]) - asked[i][2]) < 1e-14);
    }
}

/* The table of CIE 15, to its six digits. */
static void illuminant_a_is_the_cies(void **state) {
    (void)state;
    static const double table[][2] = {{380, 9.79510}, {450, 33.0859}, {555, 96.4423}, {560, 100},
                                      {600, 129.043}, {700, 198.261}, {780, 241.675}};
    shd_curve_kind kind;
    const shd_curve a = shd_curve_named(0, &kind);
    assert_int_equal(kind, SHD_CURVE_LIGHT);
    for (size_t i = 0; i < sizeof table / sizeof table[0]; i++)
        assert_true(fabs(100 * shd_curve_value(&a, table[i][0]) / table[i][1] - 1) < 6e-6);
}

static void light_that_nobody_sees_is_refused(void **state) {
    (void)state;
    const double at[] = {300, 350}, none[] = {0, 0}, some[] = {1e-300, 0};
    shd_curve curve = {.count = 2, .at = at, .values = none, .scale = 1};
    double rgb[3] = {7, 7, 7};
    shd_eye eye;
    assert_true(shd_eye_make(&eye));
    assert_false(shd_curve_rgb(&eye, &curve, SHD_CURVE_LIGHT, rgb));
    curve.values = some;
    assert_false(shd_curve_rgb(&eye, &curve, SHD_CURVE_LIGHT, rgb));
    assert_true(rgb[0] == 7);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rgb_makes_the_round_trip),
        cmocka_unit_test(white_is_white),
        cmocka_unit_test(working_spaces_are_matrices),
        cmocka_unit_test(curves_are_linear_and_end_constant),
        cmocka_unit_test(illuminant_a_is_the_cies),
        cmocka_unit_test(light_that_nobody_sees_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
