/* The sample patterns: what they promise, for each number of samples. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "base/pattern.h"
#include "bench/energy.h"

static void every_pattern_is_of_rooks_and_centred(void **state) {
    (void)state;
    for (int n = 1; n <= 64; n++) {
        int rows[64] = {0};
        long across = 0, down = 0; /* from the centre, in half columns and rows */
        for (int i = 0; i < n; i++) {
            double x, y;
            shd_sample_offset(i, n, &x, &y);
            const int column = (int)(x * n), row = (int)(y * n);
            assert_true(x == (column + 0.5) / n && y == (row + 0.5) / n);
            assert_int_equal(column, i);
            assert_in_range(row, 0, n - 1);
            rows[row]++;
            across += 2 * column + 1 - n;
            down += 2 * row + 1 - n;
        }
        for (int i = 0; i < n; i++) assert_int_equal(rows[i], 1);
        assert_true(across == 0 && down == 0);
    }
}

/* No two samples would err less if they exchanged their rows. */
static void no_exchange_of_rows_is_for_the_better(void **state) {
    (void)state;
    static distances d;
    for (int n = 2; n <= 64; n++) {
        int rows[64];
        for (int i = 0; i < n; i++) {
            double x, y;
            shd_sample_offset(i, n, &x, &y);
            rows[i] = (int)(y * n);
        }
        find_distances(n, &d);
        for (int a = 0; a < n; a++)
            for (int b = a + 1; b < n; b++)
                if (may_exchange(strata_of(n), rows, a, b))
                    assert_true(exchange_gain(&d, rows, a, b) > -1e-9);
        /* Errors on edges fall as n^(-3/4), those of the best patterns of any kind. */
        find_edges(n, &d);
        assert_true(sqrt(energy_of(&d, rows) / SHD_PI) < 0.32 * pow(n, -0.75));
    }
}

static void sixty_four_have_a_sample_in_each_cell(void **state) {
    (void)state;
    bool taken[64] = {false};
    for (int i = 0; i < 64; i++) {
        double x, y;
        shd_sample_offset(i, 64, &x, &y);
        bool *cell = &taken[(int)(y * 8) * 8 + (int)(x * 8)];
        assert_false(*cell);
        *cell = true;
    }
}

static void one_sample_is_the_centre_and_four_are_a_rotated_grid(void **state) {
    (void)state;
    static const double four[4][2] = {
        {0.125, 0.625}, {0.375, 0.125}, {0.625, 0.875}, {0.875, 0.375}};
    double x, y;
    shd_sample_offset(0, 1, &x, &y);
    assert_true(x == 0.5 && y == 0.5);
    for (int i = 0; i < 4; i++) {
        shd_sample_offset(i, 4, &x, &y);
        assert_true(x == four[i][0] && y == four[i][1]);
        /* by a right angle around the centre: the next one */
        bool turned = false;
        for (int k = 0; k < 4; k++)
            turned = turned || (four[k][0] - 0.5 == 0.5 - y && four[k][1] - 0.5 == x - 0.5);
        assert_true(turned);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_pattern_is_of_rooks_and_centred),
        cmocka_unit_test(no_exchange_of_rows_is_for_the_better),
        cmocka_unit_test(sixty_four_have_a_sample_in_each_cell),
        cmocka_unit_test(one_sample_is_the_centre_and_four_are_a_rotated_grid),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
