/* Phong's coefficients from made-up rows: what was put in comes out, with the errors that are told,
 * and what rows do not tell is said. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "analysis/phong_fit.h"
#include "solid.h"

enum { ROWS = 400 };

static uint64_t state;

static double uniform01(void) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return ((double)(state >> 11) + 0.5) * 0x1p-53;
}

static double gauss(void) {
    return sqrt(-2 * log(uniform01())) * cos(2 * acos(-1) * uniform01());
}

/* A cap of a sphere lit from its side: N.L and R.V of rows, by their angles. */
typedef struct rows {
    float light[3 * ROWS], weight[3 * ROWS], diffuse[3 * ROWS];
    double mirrored[ROWS];
    float lobes[SHD_FIT_LOBES][3 * ROWS];
    unsigned calls;
} rows;

static const double truth[3][3] = {{0.05, 0.6, 0.3}, {0.1, 0.3, 0.25}, {0.02, 0.2, 0.5}};

static double lobe_at(double mirrored, double n) {
    return mirrored > 0 ? pow(mirrored, n) : 0;
}

static shd_status give_lobes(void *context, const double *exponents, size_t count, float **out,
                             shd_error *error) {
    rows *r = context;
    (void)error;
    r->calls++;
    for (size_t k = 0; k < count; k++)
        for (size_t i = 0; i < 3 * ROWS; i++)
            out[k][i] = (float)lobe_at(r->mirrored[i / 3], exponents[k]);
    return SHD_OK;
}

static void make_rows(rows *r, double n, double noise) {
    memset(r, 0, sizeof *r);
    for (size_t i = 0; i < ROWS; i++) {
        const double x = -1 + 2 * (double)(i % 20) / 19, y = -1 + 2 * (double)(i / 20) / 19,
                     turn = hypot(x - 0.4, y) * 0.9;
        r->mirrored[i] = cos(2 * turn);
        for (size_t c = 0; c < 3; c++) {
            const double d = fmax(cos(turn), 0);
            r->diffuse[3 * i + c] = (float)d;
            r->light[3 * i + c] =
                (float)(truth[c][0] + truth[c][1] * (double)r->diffuse[3 * i + c] +
                        truth[c][2] * (double)(float)lobe_at(r->mirrored[i], n) + noise * gauss());
            r->weight[3 * i + c] = (float)(noise > 0 ? 1 / noise : 1);
        }
    }
}

static shd_phong_fit fit_rows(rows *r, bool relative) {
    float *scratch[SHD_FIT_LOBES];
    shd_phong_fit out;
    shd_error error;
    for (int k = 0; k < SHD_FIT_LOBES; k++) scratch[k] = r->lobes[k];
    const shd_fit_rows in = {.count = ROWS,
                             .light = r->light,
                             .weight = r->weight,
                             .diffuse = r->diffuse,
                             .relative = relative};
    assert_int_equal(shd_phong_fit_find(&in, give_lobes, r, scratch, NULL, &out, &error), SHD_OK);
    return out;
}

static rows r;

static void exact_light_gives_exact_coefficients(void **unused) {
    (void)unused;
    static const double exponents[] = {0.2, 1, 7, 40, 80};
    for (size_t k = 0; k < sizeof exponents / sizeof *exponents; k++) {
        make_rows(&r, exponents[k], 0);
        const shd_phong_fit f = fit_rows(&r, true);
        assert_int_equal(f.doubt, k < 4 ? SHD_FIT_SURE : SHD_FIT_FEW);
        assert_true(fabs(f.shininess / exponents[k] - 1) < 1e-5);
        assert_in_range(r.calls, 11, 24);
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < 3; i++) {
                assert_int_equal(f.channels[c].doubt[i], SHD_FIT_SURE);
                assert_true(fabs(f.channels[c].value[i] - truth[c][i]) < 2e-6);
            }
    }
}

/* Over many pictures, values spread as each of them tells; and together with the exponent. */
static void values_spread_as_they_are_told_to(void **unused) {
    (void)unused;
    enum { TIMES = 150 };
    double sum[10] = {0}, squares[10] = {0}, told[10] = {0}, crossed = 0, cross_told = 0;
    state = 7;
    for (int t = 0; t < TIMES; t++) {
        make_rows(&r, 20, 0.01);
        const shd_phong_fit f = fit_rows(&r, false);
        for (int p = 0; p < 10; p++) {
            const shd_fit_channel *channel = &f.channels[p < 9 ? p / 3 : 0];
            const double off =
                             p < 9 ? channel->value[p % 3] - truth[p / 3][p % 3] : f.shininess - 20,
                         deviation = p < 9 ? channel->deviation[p % 3] : f.deviation;
            sum[p] += off;
            squares[p] += off * off;
            told[p] += deviation * deviation;
        }
        crossed += (f.channels[0].value[2] - truth[0][2]) * (f.shininess - 20);
        cross_told += f.channels[0].covariance[SHD_FIT_SPECULAR][SHD_FIT_SHININESS];
    }
    for (int p = 0; p < 10; p++) {
        /* A variance from 150 is known to 12 %, its mean to a twelfth of a deviation. */
        assert_true(squares[p] / told[p] > 0.6 && squares[p] / told[p] < 1.5);
        assert_true(fabs(sum[p]) / TIMES < 4 * sqrt(told[p] / TIMES / TIMES));
    }
    assert_true(crossed / cross_told > 0.5 && crossed / cross_told < 1.6);
}

/* Light as codes of steps so wide that most rows have one code, and its error: a box's sides, a
 * wall. Without a highlight, of 40 such pictures' coefficients few are off by more than three
 * deviations. */
static void codes_of_even_light_are_no_mean_of_many(void **unused) {
    (void)unused;
    enum { TIMES = 40 };
    const double step = 0.004;
    unsigned off = 0, shining = 0;
    state = 3;
    for (int t = 0; t < TIMES; t++) {
        double real[3][2];
        make_rows(&r, 20, 0);
        for (int c = 0; c < 3; c++) {
            real[c][0] = 0.3 * uniform01();
            real[c][1] = 0.7 * uniform01();
        }
        for (size_t i = 0; i < 3 * (size_t)ROWS;
             i++) { /* two sides, the second slightly lit anew */
            const size_t row = i / 3;
            r.diffuse[i] = row < ROWS / 2 ? 0.4f : 0.7f + 2e-5f * (float)row;
            const double light = real[i % 3][0] + real[i % 3][1] * (double)r.diffuse[i];
            r.light[i] = (float)(round(light / step) * step);
            r.weight[i] = (float)(sqrt(12) / step);
        }
        const shd_phong_fit f = fit_rows(&r, false);
        shining += f.doubt != SHD_FIT_NO_LOBE;
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < 2; i++)
                off += fabs(f.channels[c].value[i] - real[c][i]) > 3 * f.channels[c].deviation[i];
    }
    assert_in_range(off, 0, 6);
    assert_in_range(shining, 0, 2);
}

static void noise_beyond_weights_widens_errors(void **unused) {
    (void)unused;
    state = 3;
    make_rows(&r, 20, 0.01);
    const shd_phong_fit before = fit_rows(&r, false);
    for (size_t i = 0; i < 3 * ROWS; i++) r.weight[i] *= 10; /* too sure of itself */
    const shd_phong_fit after = fit_rows(&r, false);
    assert_true(fabs(after.channels[0].weighted / before.channels[0].weighted - 10) < 0.01);
    assert_true(fabs(after.deviation / before.deviation - 1) < 0.1);
}

static void left_out_rows_do_not_count(void **unused) {
    (void)unused;
    make_rows(&r, 40, 0);
    for (size_t i = 0; i < 3 * ROWS; i += 7) {
        r.light[i] = 100;
        r.weight[i] = 0;
    }
    const shd_phong_fit f = fit_rows(&r, true);
    assert_true(fabs(f.shininess - 40) < 1e-3);
    assert_true(fabs(f.channels[2].value[2] - truth[2][2]) < 2e-6);
}

/* So many rows around the highlight, and no other ones. */
static void keep_rows(rows *out, size_t count) {
    for (size_t i = 0; i < 3 * ROWS; i++)
        if (i / 3 < 170 || (i / 3 - 170) % 7 || i / 3 >= 170 + 7 * count) out->weight[i] = 0;
}

static void fewer_rows_than_unknowns_tell_none_of_them(void **unused) {
    (void)unused;
    for (size_t kept = 1; kept < 4; kept++)
        for (int relative = 0; relative < 2; relative++) {
            state = 3;
            make_rows(&r, 6, 1e-3);
            keep_rows(&r, kept);
            const shd_phong_fit f = fit_rows(&r, relative);
            assert_int_equal(f.channels[1].rows, kept);
            assert_int_equal(f.channels[1].doubt[SHD_FIT_DIFFUSE], SHD_FIT_TOO_FEW);
            assert_true(isinf(f.channels[1].deviation[SHD_FIT_DIFFUSE]));
            assert_true(f.channels[1].covariance[1][1] == 0 && isinf(f.deviation));
        }
}

/* 68 of 100 values are within one deviation, though errors are known by four rows alone. */
static void errors_of_few_rows_reach_as_far_as_they_are_told_to(void **unused) {
    (void)unused;
    int within = 0, all = 0;
    state = 17;
    for (int t = 0; t < 150; t++) {
        make_rows(&r, 4, 1e-4);
        keep_rows(&r, 4);
        const shd_phong_fit f = fit_rows(&r, true);
        for (int c = 0; c < 3; c++)
            for (int i = 0; i < 3; i++) {
                const shd_fit_channel *channel = &f.channels[c];
                if (channel->doubt[i] != SHD_FIT_SURE) continue;
                within += fabs(channel->value[i] - truth[c][i]) < channel->deviation[i];
                all++;
            }
    }
    assert_true(all > 900 && within > 0.6 * all && within < 0.75 * all);
}

static void coefficients_are_not_negative(void **unused) {
    (void)unused;
    make_rows(&r, 40, 0);
    for (size_t i = 0; i < 3 * ROWS; i++) r.light[i] -= 0.08f; /* constants are now below 0 */
    const shd_phong_fit f = fit_rows(&r, true);
    assert_true(f.channels[0].value[0] == 0 && f.channels[2].value[0] == 0);
    assert_true(fabs(f.channels[1].value[0] - 0.02) < 1e-3);
}

static void a_dull_surface_has_no_highlight(void **unused) {
    (void)unused;
    state = 11;
    make_rows(&r, 40, 0.002);
    for (size_t i = 0; i < 3 * ROWS; i++)
        r.light[i] -= (float)(truth[i % 3][2] * lobe_at(r.mirrored[i / 3], 40));
    const shd_phong_fit f = fit_rows(&r, false);
    assert_int_equal(f.doubt, SHD_FIT_NO_LOBE);
    assert_true(f.channels[1].value[2] == 0);
    assert_true(fabs(f.channels[1].value[1] - truth[1][1]) < 5e-3);
}

static void light_that_is_the_same_everywhere_tells_one_sum(void **unused) {
    (void)unused;
    make_rows(&r, 40, 0);
    for (size_t i = 0; i < 3 * ROWS; i++) {
        r.mirrored[i / 3] = -1; /* no highlight at all */
        r.diffuse[i] = 0.5f;
        r.light[i] = 0.4f;
    }
    const shd_phong_fit f = fit_rows(&r, true);
    assert_int_equal(f.doubt, SHD_FIT_NO_LOBE);
    for (int c = 0; c < 3; c++) {
        const shd_fit_channel *channel = &f.channels[c];
        assert_int_equal(channel->doubt[SHD_FIT_CONSTANT], SHD_FIT_LIKE_OTHERS);
        assert_int_equal(channel->doubt[SHD_FIT_DIFFUSE], SHD_FIT_LIKE_OTHERS);
        assert_int_equal(channel->like[SHD_FIT_DIFFUSE], SHD_FIT_CONSTANT);
        assert_int_equal(channel->doubt[SHD_FIT_SPECULAR], SHD_FIT_UNSEEN);
        assert_true(isinf(channel->deviation[SHD_FIT_DIFFUSE]));
        assert_true(fabs(channel->value[0] + 0.5 * channel->value[1] - 0.4) < 1e-6);
    }
}

static void a_channel_without_light_tells_its_constant_alone(void **unused) {
    (void)unused;
    make_rows(&r, 40, 0);
    for (size_t i = 1; i < 3 * ROWS; i += 3) {
        r.diffuse[i] = 0;
        r.weight[i] = 1;
        r.light[i] = 0.1f;
    }
    const shd_phong_fit f = fit_rows(&r, true);
    assert_int_equal(f.channels[1].doubt[SHD_FIT_DIFFUSE], SHD_FIT_UNSEEN);
    assert_int_equal(f.channels[0].doubt[SHD_FIT_DIFFUSE], SHD_FIT_SURE);
    assert_true(fabs(f.channels[1].value[0] - 0.1) < 1e-4);
}

/* By Karush, Kuhn and Tucker: no column that is used pulls, and no other one pulls up. */
static void least_squares_are_the_least(void **unused) {
    (void)unused;
    state = 5;
    for (int t = 0; t < 2000; t++) {
        shd_products p = {.square = 0};
        for (int row = 0; row < 5; row++) {
            const double a[4] = {gauss(), gauss(), t % 4 ? gauss() : 0, gauss()};
            for (int i = 0; i < 3; i++) {
                for (int j = 0; j < 3; j++) p.columns[i][j] += a[i] * a[j];
                p.values[i] += a[i] * a[3];
            }
            p.square += a[3] * a[3];
        }
        double x[3];
        shd_least_squares(&p, x);
        for (int i = 0; i < 3; i++) {
            double pull = p.values[i];
            for (int j = 0; j < 3; j++) pull -= p.columns[i][j] * x[j];
            assert_true(x[i] >= 0);
            assert_true(x[i] > 0 ? fabs(pull) < 1e-9 : pull < 1e-9);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(exact_light_gives_exact_coefficients),
        cmocka_unit_test(values_spread_as_they_are_told_to),
        cmocka_unit_test(codes_of_even_light_are_no_mean_of_many),
        cmocka_unit_test(noise_beyond_weights_widens_errors),
        cmocka_unit_test(left_out_rows_do_not_count),
        cmocka_unit_test(fewer_rows_than_unknowns_tell_none_of_them),
        cmocka_unit_test(errors_of_few_rows_reach_as_far_as_they_are_told_to),
        cmocka_unit_test(coefficients_are_not_negative),
        cmocka_unit_test(a_dull_surface_has_no_highlight),
        cmocka_unit_test(light_that_is_the_same_everywhere_tells_one_sum),
        cmocka_unit_test(a_channel_without_light_tells_its_constant_alone),
        cmocka_unit_test(least_squares_are_the_least),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
