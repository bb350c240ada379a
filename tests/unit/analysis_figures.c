/* Figures of channels against sorted values and closed forms; the axes against known colors. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "analysis/axes.h"
#include "analysis/figures.h"
#include "solid.h"

static int by_value(const void *a, const void *b) {
    const float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

static shd_arena *arena;

static shd_figures figures_of(const float *values, size_t count, double low, double high) {
    shd_figures out;
    assert_true(shd_figures_find(values, count, (shd_extent){low, high},
                                 shd_figures_scratch_new(arena), NULL, &out));
    return out;
}

static void percentiles_are_those_of_sorted_values(void **state) {
    (void)state;
    enum { MOST = 5000 };
    static float values[MOST], sorted[MOST];
    uint32_t seed = 1;
    for (size_t count = 1; count <= MOST; count = count * 3 + 1) {
        for (size_t i = 0; i < count; i++) {
            seed = seed * 1664525 + 1013904223;
            const double x = (double)(int32_t)seed / 2147483648.0;
            values[i] = (float)(i % 3 ? x : x * x * x * 1e-20); /* signs, and small ones */
        }
        memcpy(sorted, values, sizeof sorted);
        qsort(sorted, count, sizeof *sorted, by_value);
        const shd_figures f = figures_of(values, count, -1, 1);
        assert_int_equal(f.count, count);
        assert_true(f.min == (double)sorted[0] && f.max == (double)sorted[count - 1]);
        uint64_t sum = 0;
        for (int b = 0; b < SHD_BINS; b++) sum += f.bins[b];
        assert_int_equal(sum, count);
        for (int p = 0; p < SHD_PERCENTILES; p++) {
            const double rank = ceil(shd_percentiles[p] * (double)count / 100);
            assert_true(f.percentiles[p] == (double)sorted[(size_t)rank - 1]);
        }
    }
}

static void what_is_not_finite_is_left_out(void **state) {
    (void)state;
    const float values[] = {NAN, 2, -INFINITY, -1, INFINITY, 0.5f};
    const shd_figures f = figures_of(values, 6, 0, 1), none = figures_of(values, 1, 0, 1);
    assert_int_equal(f.count, 3);
    assert_true(f.min == -1 && f.max == 2 && f.mean == 0.5 && f.percentiles[3] == 0.5);
    assert_true(f.low == -1 && f.high == 2); /* the edges go as far as values do */
    assert_int_equal(f.bins[0], 1);
    assert_int_equal(f.bins[32], 1); /* on an edge */
    assert_int_equal(f.bins[63], 1);
    assert_int_equal(none.count, 0);
    assert_true(none.low == 0 && none.high == 1 && none.bins[0] == 0);
}

static void a_cancelled_search_ends(void **state) {
    (void)state;
    const atomic_bool cancelled = true;
    const float values[] = {1};
    shd_figures out;
    assert_false(shd_figures_find(values, 1, (shd_extent){0, 1}, shd_figures_scratch_new(arena),
                                  &cancelled, &out));
}

static void axes_of_known_colors(void **state) {
    (void)state;
    static const struct {
        float rgb[3];
        double hsv[3], yiq[3];
    } known[] = {{{1, 1, 1}, {0, 0, 1}, {1, 0, 0}},
                 {{1, 0, 0}, {0, 1, 1}, {.30, .60, .21}},
                 {{0, 1, 0}, {1 / 3.0, 1, 1}, {.59, -.28, -.52}},
                 {{0, 0, 1}, {2 / 3.0, 1, 1}, {.11, -.32, .31}},
                 {{1, 0, 1}, {5 / 6.0, 1, 1}, {.41, .28, .52}},
                 {{0.5f, 0.25f, 0.25f}, {0, 0.5, 0.5}, {.325, .15, .0525}},
                 {{0, 0, 0}, {0, 0, 0}, {0, 0, 0}},
                 {{-1, 0.5f, 0}, {1 / 3.0, 1, 0.5}, {-.005, -.74, -.47}}};
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        double hsv[3], yiq[3];
        shd_hsv_of(known[i].rgb, hsv);
        shd_yiq_of(known[i].rgb, yiq);
        for (int c = 0; c < 3; c++) {
            assert_true(fabs(hsv[c] - known[i].hsv[c]) < 1e-12);
            assert_true(fabs(yiq[c] - known[i].yiq[c]) < 1e-12);
        }
    }
}

int main(void) {
    arena = shd_arena_new(1 << 24);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(percentiles_are_those_of_sorted_values),
        cmocka_unit_test(what_is_not_finite_is_left_out),
        cmocka_unit_test(a_cancelled_search_ends),
        cmocka_unit_test(axes_of_known_colors),
    };
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    shd_arena_drop(arena);
    return failed;
}
