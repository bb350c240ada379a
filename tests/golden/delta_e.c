/* CIEDE2000 against the published pairs, and Lab against published colors. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "base/primaries.h"
#include "color/delta_e.h"

#define COUNT(a) (sizeof(a) / sizeof *(a))

/* G. Sharma, W. Wu, E. N. Dalal, "The CIEDE2000 Color-Difference Formula: Implementation Notes,
 * Supplementary Test Data, and Mathematical Observations", Color Research and Application 30(1),
 * February 2005, pp. 21-30, Table 1. The pairs stand on the formula's edges: greys, opposite
 * hues, the mean hue's jump, the rotation of blues. */
static const struct {
    double a[3], b[3], difference;
} pairs[] = {
    {{50.0000, 2.6772, -79.7751}, {50.0000, 0.0000, -82.7485}, 2.0425},
    {{50.0000, 3.1571, -77.2803}, {50.0000, 0.0000, -82.7485}, 2.8615},
    {{50.0000, 2.8361, -74.0200}, {50.0000, 0.0000, -82.7485}, 3.4412},
    {{50.0000, -1.3802, -84.2814}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, -1.1848, -84.8006}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, -0.9009, -85.5211}, {50.0000, 0.0000, -82.7485}, 1.0000},
    {{50.0000, 0.0000, 0.0000}, {50.0000, -1.0000, 2.0000}, 2.3669},
    {{50.0000, -1.0000, 2.0000}, {50.0000, 0.0000, 0.0000}, 2.3669},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0009}, 7.1792},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0010}, 7.1792},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0011}, 7.2195},
    {{50.0000, 2.4900, -0.0010}, {50.0000, -2.4900, 0.0012}, 7.2195},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0009, -2.4900}, 4.8045},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0010, -2.4900}, 4.8045},
    {{50.0000, -0.0010, 2.4900}, {50.0000, 0.0011, -2.4900}, 4.7461},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 0.0000, -2.5000}, 4.3065},
    {{50.0000, 2.5000, 0.0000}, {73.0000, 25.0000, -18.0000}, 27.1492},
    {{50.0000, 2.5000, 0.0000}, {61.0000, -5.0000, 29.0000}, 22.8977},
    {{50.0000, 2.5000, 0.0000}, {56.0000, -27.0000, -3.0000}, 31.9030},
    {{50.0000, 2.5000, 0.0000}, {58.0000, 24.0000, 15.0000}, 19.4535},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.1736, 0.5854}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.2972, 0.0000}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 1.8634, 0.5757}, 1.0000},
    {{50.0000, 2.5000, 0.0000}, {50.0000, 3.2592, 0.3350}, 1.0000},
    {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
    {{63.0109, -31.0961, -5.8663}, {62.8187, -29.7946, -4.0864}, 1.2630},
    {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
    {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
    {{22.7233, 20.0904, -46.6940}, {23.0331, 14.9730, -42.5619}, 2.0373},
    {{36.4612, 47.8580, 18.3852}, {36.2715, 50.5065, 21.2231}, 1.4146},
    {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
    {{90.9257, -0.5406, -0.9208}, {88.6381, -0.8985, -0.7239}, 1.5381},
    {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
    {{2.0776, 0.0795, -1.1350}, {0.9033, -0.0636, -0.5514}, 0.9082},
};

static void the_published_pairs_are_met_both_ways(void **state) {
    (void)state;
    assert_int_equal(COUNT(pairs), 34);
    for (size_t i = 0; i < COUNT(pairs); i++)
        for (int turned = 0; turned < 2; turned++) {
            const double *a = turned ? pairs[i].b : pairs[i].a,
                         *b = turned ? pairs[i].a : pairs[i].b;
            double got = shd_delta_e_2000(a, b);
            /* Half of the table's last digit, and of the digits that its colors leave out. */
            if (!(fabs(got - pairs[i].difference) < 1e-4))
                fail_msg("pair %zu is %.6f, not %.4f", i + 1, got, pairs[i].difference);
        }
}

static double number(uint64_t *random, double low, double high) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(*random >> 11) * 0x1p-53);
}

static void differences_are_symmetric_finite_and_zero_for_equals(void **state) {
    (void)state;
    uint64_t random = 1;
    for (int i = 0; i < 100000; i++) {
        double size = pow(10, number(&random, -12, 2.1)), a[3], b[3];
        for (int c = 0; c < 3; c++) {
            a[c] = c ? number(&random, -128, 128) : number(&random, 0, 100);
            b[c] = a[c] + number(&random, -size, size);
        }
        double one = shd_delta_e_2000(a, b), other = shd_delta_e_2000(b, a);
        assert_true(isfinite(one) && one >= 0);
        assert_true(fabs(one - other) <= 1e-9 * one);
        assert_true(shd_delta_e_2000(a, a) == 0);
    }
}

/* The built-in spaces. */
static const struct {
    const char *name;
    shd_transfer transfer;
    const double *xy;
} encodings[] = {{"lin_rec709", SHD_TRANSFER_LINEAR, shd_rec709},
                 {"ACEScg", SHD_TRANSFER_LINEAR, shd_acescg},
                 {"ACES2065-1", SHD_TRANSFER_LINEAR, shd_aces2065_1},
                 {"sRGB", SHD_TRANSFER_SRGB, shd_rec709},
                 {"Rec.1886", SHD_TRANSFER_REC1886, shd_rec709},
                 {"Display P3", SHD_TRANSFER_SRGB, shd_display_p3}};

static shd_lab_space space_of(const char *name) {
    size_t i = 0;
    shd_lab_space space;
    while (strcmp(encodings[i].name, name)) i++;
    assert_true(shd_lab_space_make(encodings[i].transfer, encodings[i].xy, &space));
    return space;
}

static void lab_is_that_of_published_srgb_colors(void **state) {
    (void)state;
    /* GNU Octave, image package, the tests of rgb2lab: two digits, and a white of (0.95047, 1,
     * 1.08883) where ours is that of the chromaticities (0.3127, 0.3290), which moves b* by up
     * to 0.02. */
    static const struct {
        float rgb[3];
        double lab[3];
    } known[] = {
        {{1, 0, 0}, {53.24, 80.09, 67.20}},
        {{1, 1, 0}, {97.14, -21.55, 94.48}},
        {{0, 1, 0}, {87.74, -86.18, 83.18}},
        {{0, 1, 1}, {91.11, -48.09, -14.13}},
        {{0, 0, 1}, {32.30, 79.19, -107.86}},
        {{1, 0, 1}, {60.32, 98.24, -60.83}},
        {{1, 1, 1}, {100, 0, 0}},
        {{.5f, .5f, .5f}, {53.39, 0, 0}},
        {{.75f, 0, 0}, {39.77, 64.51, 54.13}},
        {{0, 0, 0}, {0, 0, 0}},
    };
    shd_lab_space srgb = space_of("sRGB");
    for (size_t i = 0; i < COUNT(known); i++) {
        double lab[3];
        shd_lab_of(&srgb, known[i].rgb, lab);
        for (int c = 0; c < 3; c++)
            if (!(fabs(lab[c] - known[i].lab[c]) < 0.03))
                fail_msg("color %zu: %d is %.4f, not %.4f", i, c, lab[c], known[i].lab[c]);
    }
}

static void greys_are_neutral_in_every_encoding(void **state) {
    (void)state;
    for (size_t i = 0; i < COUNT(encodings); i++) {
        shd_lab_space space = space_of(encodings[i].name);
        for (int code = 0; code <= 255; code++) {
            float grey[3];
            double lab[3];
            for (int c = 0; c < 3; c++) grey[c] = (float)code / 255;
            shd_lab_of(&space, grey, lab);
            assert_true(fabs(lab[1]) < 1e-10 && fabs(lab[2]) < 1e-10);
            assert_true(code < 255 || fabs(lab[0] - 100) < 1e-10);
        }
    }
}

static void one_color_has_one_lab_in_every_encoding(void **state) {
    (void)state;
    /* Linear 0.2, 0.5, 0.7, as Rec.709's three encodings spell it. */
    static const double linear[3] = {0.2, 0.5, 0.7};
    float plain[3], srgb[3], video[3];
    for (int c = 0; c < 3; c++) {
        plain[c] = (float)linear[c];
        srgb[c] = (float)(1.055 * pow(linear[c], 1 / 2.4) - 0.055);
        video[c] = (float)pow(linear[c], 1 / 2.4);
    }
    const struct {
        const char *name;
        const float *rgb;
    } spelled[] = {{"lin_rec709", plain}, {"sRGB", srgb}, {"Rec.1886", video}};
    double first[3];
    for (size_t i = 0; i < COUNT(spelled); i++) {
        shd_lab_space space = space_of(spelled[i].name);
        double lab[3];
        shd_lab_of(&space, spelled[i].rgb, lab);
        if (i == 0) memcpy(first, lab, sizeof lab);
        assert_true(shd_delta_e_2000(first, lab) < 1e-5); /* the codes are floats */
    }
}

static void colors_beyond_the_screen_are_held_to_it(void **state) {
    (void)state;
    shd_lab_space space = space_of("sRGB");
    const float wild[3] = {NAN, -3, INFINITY}, held[3] = {0, 0, 1};
    double a[3], b[3];
    shd_lab_of(&space, wild, a);
    shd_lab_of(&space, held, b);
    assert_memory_equal(a, b, sizeof a);
}

static void unknown_encodings_have_no_lab(void **state) {
    (void)state;
    shd_lab_space space;
    const double black[8] = {0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.5, 0};
    assert_false(shd_lab_space_make(SHD_TRANSFER_UNKNOWN, shd_rec709, &space));
    assert_false(shd_lab_space_make(SHD_TRANSFER_SRGB, black, &space));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_published_pairs_are_met_both_ways),
        cmocka_unit_test(differences_are_symmetric_finite_and_zero_for_equals),
        cmocka_unit_test(lab_is_that_of_published_srgb_colors),
        cmocka_unit_test(greys_are_neutral_in_every_encoding),
        cmocka_unit_test(one_color_has_one_lab_in_every_encoding),
        cmocka_unit_test(colors_beyond_the_screen_are_held_to_it),
        cmocka_unit_test(unknown_encodings_have_no_lab),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
