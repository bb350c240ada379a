/* Maps of pictures: where texels are, what larger and smaller ones become, and what is no radiance.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "scene/surroundings.h"

typedef struct made {
    shd_surroundings map;
    float *texels;
} made;

static shd_texels picture_of(int height) {
    return (shd_texels){.width = 2 * height,
                        .height = height,
                        .colors = 3,
                        .rgba = calloc((size_t)height * (size_t)height * 2, 4 * sizeof(float))};
}

static float *pixel_of(const shd_texels *picture, int x, int y) {
    return (float *)picture->rgba + 4 * ((size_t)y * (size_t)picture->width + (size_t)x);
}

static made make(const shd_texels *picture, int rows) {
    const size_t values = 6 * (size_t)rows * (size_t)rows;
    made out = {{.width = 2 * rows, .height = rows}, malloc(values * sizeof(float))};
    assert_true(shd_surroundings_fill(picture, NULL, &out.map, out.texels));
    assert_true(shd_surroundings_measure(&out.map, true, NULL));
    return out;
}

static void drop(made *m, const shd_texels *picture) {
    free(m->texels);
    free((float *)picture->rgba);
}

/* The middle is -z, a quarter to the right is +x, the seam is +z, the top is +y. So OpenEXR's
 * latitude-longitude maps, whose middle is +z, are as there after half a turn, and three.js's,
 * whose middle is +x, after rotate -90. */
static void texels_are_where_they_should_be(void **state) {
    (void)state;
    static const struct {
        double u, v;
        shd_vec3 d;
    } places[] = {{0.5, 0.5, {0, 0, -1}}, {0.75, 0.5, {1, 0, 0}}, {0.25, 0.5, {-1, 0, 0}},
                  {1, 0.5, {0, 0, 1}},    {0.3, 0, {0, 1, 0}},    {0.3, 1, {0, -1, 0}}};
    enum { H = 64 };
    for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
        shd_texels picture = picture_of(H);
        /* The four texels around a place, or the row at a pole. */
        const int x = (int)(places[k].u * 2 * H), y = (int)(places[k].v * H);
        const bool pole = y == 0 || y == H;
        for (int j = y > 0 ? y - 1 : 0; j <= y && j < H; j++)
            for (int i = pole ? 0 : x - 1; i <= (pole ? 2 * H - 1 : x); i++)
                pixel_of(&picture, i % (2 * H), j)[k % 3] = 5;
        made m = make(&picture, H);
        for (size_t other = 0; other < sizeof places / sizeof *places; other++) {
            double rgb[3];
            shd_surroundings_at(&m.map, places[other].d, rgb);
            assert_float_equal(rgb[k % 3], other == k ? 5 : 0, 1e-6);
        }
        drop(&m, &picture);
    }
}

static double random_value(uint64_t *random) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    const double u = (double)(*random >> 11) * 0x1p-53;
    return pow(u, 9) * 100;
}

static void fill_with_noise(const shd_texels *picture, uint64_t random) {
    for (int y = 0; y < picture->height; y++)
        for (int x = 0; x < picture->width; x++)
            for (int c = 0; c < 3; c++) pixel_of(picture, x, y)[c] = (float)random_value(&random);
}

static double angle_of_row(int row, int height) {
    return (cos(SHD_PI * row / height) - cos(SHD_PI * (row + 1) / height)) * SHD_PI / height;
}

/* Also of the first moment by latitude, to the width of a texel: nothing is where it was not. */
static void fewer_texels_have_all_light(void **state) {
    (void)state;
    static const int heights[][2] = {{96, 64}, {65, 64}, {200, 64}, {300, 256}, {64, 64}};
    for (size_t k = 0; k < sizeof heights / sizeof *heights; k++) {
        const int height = heights[k][0], rows = heights[k][1];
        shd_texels picture = picture_of(height);
        fill_with_noise(&picture, k);
        assert_int_equal(shd_surroundings_rows(height, rows), rows);
        made m = make(&picture, rows);
        double before[3] = {0}, after[3] = {0}, east_before = 0, east_after = 0;
        for (int y = 0; y < height; y++)
            for (int x = 0; x < 2 * height; x++)
                for (int c = 0; c < 3; c++) {
                    const double flux =
                        angle_of_row(y, height) * (double)pixel_of(&picture, x, y)[c];
                    before[c] += flux;
                    if (x >= height) east_before += flux; /* halves are whole columns of both */
                }
        for (int y = 0; y < rows; y++)
            for (int x = 0; x < 2 * rows; x++)
                for (int c = 0; c < 3; c++) {
                    const double flux =
                        angle_of_row(y, rows) * (double)m.texels[3 * (y * 2 * rows + x) + c];
                    after[c] += flux;
                    if (x >= rows) east_after += flux;
                }
        for (int c = 0; c < 3; c++) assert_float_equal(after[c] / before[c], 1, 1e-6);
        assert_float_equal(east_after / east_before, 1, 1e-3);
        assert_int_equal(m.map.held, 0);
        drop(&m, &picture);
    }
}

/* A texel that is the only one: its light is in the new ones that it is in, by their shares. */
static void light_stays_where_it_is(void **state) {
    (void)state;
    enum { H = 80, R = 64 }; /* five old ones are four new ones */
    shd_texels picture = picture_of(H);
    pixel_of(&picture, 41, 36)[1] = 7; /* columns 32.8 to 33.6, rows 28.8 to 29.6 */
    made m = make(&picture, R);
    double sum = 0;
    for (int y = 0; y < R; y++)
        for (int x = 0; x < 2 * R; x++)
            sum += (double)m.texels[3 * (y * 2 * R + x) + 1] * angle_of_row(y, R);
    assert_float_equal(sum / (7 * angle_of_row(36, H)), 1, 1e-6);
    const double left = m.texels[3 * (29 * 2 * R + 32) + 1],
                 right = m.texels[3 * (29 * 2 * R + 33) + 1];
    assert_float_equal(left / right, 0.25 / 0.75, 1e-5);
    assert_float_equal(left, 7 * 0.2 * 0.6, 0.01); /* areas, but for the latitude */
    assert_float_equal(m.texels[3 * (29 * 2 * R + 34) + 1], 0, 0);
    drop(&m, &picture);
}

static void more_texels_are_the_same_radiance(void **state) {
    (void)state;
    static const int heights[] = {1, 2, 5, 21, 63};
    for (size_t k = 0; k < sizeof heights / sizeof *heights; k++) {
        const int height = heights[k], rows = shd_surroundings_rows(height, SHD_SURROUNDINGS_MOST);
        assert_true(rows >= SHD_SURROUNDINGS_LEAST && rows < 3 * SHD_SURROUNDINGS_LEAST &&
                    rows % height == 0 && rows / height % 2);
        shd_texels picture = picture_of(height);
        fill_with_noise(&picture, k);
        made m = make(&picture, rows);
        float *coarse = malloc(6 * (size_t)height * (size_t)height * sizeof *coarse);
        for (int i = 0; i < 2 * height * height; i++)
            for (int c = 0; c < 3; c++) coarse[3 * i + c] = picture.rgba[4 * i + c];
        const shd_surroundings whole = {.width = 2 * height, .height = height, .texels = coarse};
        for (int i = 0; i < 500; i++) {
            /* but for the rows at the poles */
            const double u = (i * 0.618034) - floor(i * 0.618034), v = 0.02 + 0.96 * i / 500;
            double a[3], b[3];
            shd_surroundings_between(&whole, u, v, a);
            shd_surroundings_between(&m.map, u, v, b);
            for (int c = 0; c < 3; c++)
                if (fabs(v - 0.5) < 0.5 - 1.5 / rows)
                    assert_true(fabs(a[c] - b[c]) <= 1e-6 * m.map.most);
        }
        free(coarse);
        drop(&m, &picture);
    }
}

/* What is below 0 is counted, and 0. All of the row at a pole is one value. */
static void what_is_no_radiance_is_held(void **state) {
    (void)state;
    static const int heights[] = {10, 64, 100};
    for (int k = 0; k < 3; k++) {
        shd_texels picture = picture_of(heights[k]);
        fill_with_noise(&picture, 3);
        pixel_of(&picture, 3, 5)[0] = -2;
        pixel_of(&picture, 4, 5)[1] = -1e30F;
        pixel_of(&picture, 5, 5)[2] = 3e38F;
        pixel_of(&picture, 6, 5)[3] = -1; /* alpha counts for nothing */
        made m = make(&picture, shd_surroundings_rows(heights[k], SHD_SURROUNDINGS_LEAST));
        assert_int_equal(m.map.held, 3);
        const size_t values = 6 * (size_t)m.map.height * (size_t)m.map.height,
                     row = 6 * (size_t)m.map.height;
        for (size_t i = 0; i < values; i++)
            assert_true(m.texels[i] >= 0 && (double)m.texels[i] <= m.map.most);
        assert_true(m.map.most > 1e5 && m.map.most <= 1e6 && m.map.slope < 1e9);
        for (size_t i = 0; i < row; i++) {
            assert_true(m.texels[i] == m.texels[i % 3]);
            assert_true(m.texels[values - 1 - i] == m.texels[values - 1 - i % 3]);
        }
        drop(&m, &picture);
    }
}

/* The slope is no less than what any two directions differ by. */
static void slopes_hold_everywhere(void **state) {
    (void)state;
    shd_texels picture = picture_of(64);
    fill_with_noise(&picture, 11);
    made m = make(&picture, 64);
    uint64_t random = 1;
    double worst = 0;
    for (int i = 0; i < 20000; i++) {
        const double down = i % 2 ? SHD_PI * random_value(&random) / 100 / 20
                                  : acos(1 - 2 * random_value(&random) / 100),
                     turn = random_value(&random);
        const shd_vec3 a = {sin(down) * sin(turn), cos(down), sin(down) * cos(turn)};
        shd_vec3 b = {a.x + 1e-4 * cos(i), a.y + 1e-4 * sin(3 * i), a.z + 1e-4 * cos(5 * i)};
        double x[3], y[3];
        shd_normalize(b, &b);
        shd_surroundings_at(&m.map, a, x);
        shd_surroundings_at(&m.map, b, y);
        const double apart = shd_length(shd_sub(a, b));
        for (int c = 0; c < 3; c++) {
            assert_true(x[c] <= m.map.most);
            worst = fmax(worst, fabs(x[c] - y[c]) / apart);
        }
    }
    print_message("the slope is %.3g, of %.3g\n", worst, m.map.slope);
    assert_true(worst <= m.map.slope && worst > m.map.slope / 20);
    drop(&m, &picture);
}

static void cancelling_ends_it(void **state) {
    (void)state;
    const atomic_bool cancelled = true;
    shd_texels picture = picture_of(100);
    float *texels = malloc(6 * 64 * 64 * sizeof *texels);
    shd_surroundings map = {.width = 128, .height = 64};
    assert_false(shd_surroundings_fill(&picture, &cancelled, &map, texels));
    free(texels);
    free((float *)picture.rgba);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(texels_are_where_they_should_be),
        cmocka_unit_test(fewer_texels_have_all_light),
        cmocka_unit_test(light_stays_where_it_is),
        cmocka_unit_test(more_texels_are_the_same_radiance),
        cmocka_unit_test(what_is_no_radiance_is_held),
        cmocka_unit_test(slopes_hold_everywhere),
        cmocka_unit_test(cancelling_ends_it),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
