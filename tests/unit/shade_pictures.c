/* Pictures under footprints: their levels, one point of them, and means against all points. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

#include "base/bits.h"
#include "base/vec3.h"
#include "shade/picture.h"
#include "shade/texture.h"

static uint64_t seed = 5;

static double uniform(double low, double high) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(seed >> 11) * 0x1p-53);
}

typedef struct made {
    shd_texels texels;
    shd_pyramid pyramid;
    float *rgba;
    void *levels;
} made;

static made picture_of(int width, int height, double (*texel)(int x, int y, int c)) {
    made m = {.rgba = malloc(4 * sizeof(float) * (size_t)width * (size_t)height)};
    m.texels = (shd_texels){.width = width, .height = height, .colors = 3, .rgba = m.rgba};
    for (int c = 0; c < 4; c++) m.texels.low[c] = INFINITY, m.texels.high[c] = -INFINITY;
    for (int i = 0; i < width * height; i++)
        for (int c = 0; c < 4; c++) {
            const float value = (float)texel(i % width, i / width, c);
            m.rgba[4 * i + c] = value;
            m.texels.low[c] = fminf(m.texels.low[c], value);
            m.texels.high[c] = fmaxf(m.texels.high[c], value);
        }
    m.levels = aligned_alloc(64, (shd_pyramid_size(&m.texels) + 63) / 64 * 64);
    return m;
}

/* `m` stays where it is from here on. */
static void raise(made *m) {
    assert_true(shd_pyramid_fill(&m->texels, NULL, m->levels));
    shd_pyramid_open(&m->texels, m->levels, &m->pyramid);
}

static void drop_picture(made *m) {
    free(m->rgba);
    free(m->levels);
}

static double noise(int x, int y, int c) {
    (void)x, (void)y;
    return uniform(-1, c + 1);
}

static double checks(int x, int y, int c) {
    (void)c;
    return (x / 32 + y / 32) % 2;
}

/* Each level has half the sides of the one before, and the picture's mean. */
static void levels_have_one_mean(void **state) {
    (void)state;
    static const int sides[][3] = {{1, 1, 1}, {1, 7, 4}, {7, 1, 4},   {5, 3, 4},
                                   {8, 4, 4}, {9, 2, 5}, {64, 64, 7}, {33, 100, 8}};
    for (size_t i = 0; i < sizeof sides / sizeof *sides; i++) {
        const int width = sides[i][0], height = sides[i][1];
        made m = picture_of(width, height, noise);
        raise(&m);
        assert_int_equal(m.pyramid.count, sides[i][2]);
        assert_false(m.pyramid.grey);
        double mean[4] = {0};
        for (int k = 0; k < 4 * width * height; k++) mean[k % 4] += m.rgba[k];
        for (int l = 1; l < m.pyramid.count; l++) {
            const shd_level *level = &m.pyramid.levels[l];
            assert_int_equal(level->width, (level[-1].width + 1) / 2);
            assert_int_equal(level->height, (level[-1].height + 1) / 2);
            double sum[4] = {0};
            for (int k = 0; k < 4 * level->width * level->height; k++) sum[k % 4] += level->rgba[k];
            for (int c = 0; c < 4; c++) {
                sum[c] *= (double)width * height / level->width / level->height;
                assert_true(fabs(sum[c] - mean[c]) < 1e-6 * width * height);
            }
        }
        drop_picture(&m);
    }
}

/* The lower left corner is (0, 0); what is beyond is as the wrap says. */
static void points_lie_between_texels(void **state) {
    (void)state;
    made m = picture_of(2, 2, checks);
    for (int k = 0; k < 4; k++) m.rgba[4 * k] = (float)k; /* 0 1 above 2 3 */
    m.texels.low[0] = 0;
    m.texels.high[0] = 3;
    raise(&m);
    static const struct {
        double s, t;
        shd_wrap wrap;
        double value;
    } cases[] = {
        {0.25, 0.75, SHD_WRAP_CLAMP, 0},   {0.75, 0.25, SHD_WRAP_CLAMP, 3},
        {0.5, 0.75, SHD_WRAP_CLAMP, 0.5},  {0.25, 0.5, SHD_WRAP_REPEAT, 1},
        {0.5, 0.5, SHD_WRAP_MIRROR, 1.5},  {-7, 9, SHD_WRAP_CLAMP, 0},
        {7, -1e9, SHD_WRAP_CLAMP, 3},      {0, 0.75, SHD_WRAP_CLAMP, 0},
        {0, 0.75, SHD_WRAP_REPEAT, 0.5},   {-0.25, 0.75, SHD_WRAP_REPEAT, 1},
        {-0.25, 0.75, SHD_WRAP_MIRROR, 0}, {-0.75, 0.75, SHD_WRAP_MIRROR, 1},
        {1.25, 1.25, SHD_WRAP_MIRROR, 1},  {1.25, 1.25, SHD_WRAP_REPEAT, 2},
        {-9.75, 8.25, SHD_WRAP_REPEAT, 2},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        double out[4];
        const shd_footprint f = {{cases[i].s, cases[i].t}, {1e-3, 0}, {0, 1e-3}};
        shd_picture_mean(&m.pyramid, cases[i].wrap, &f, out);
        if (fabs(out[0] - cases[i].value) > 1e-9)
            fail_msg("case %zu: %g, not %g", i, out[0], cases[i].value);
    }
    drop_picture(&m);
}

/* A footprint of `pixels` texels across, `ratio` times as long, turned. */
static shd_footprint footprint_of(double texels, double ratio, double lean, double turn) {
    const double c = cos(turn), s = sin(turn), wide = texels / 64;
    return (shd_footprint){{uniform(-2, 2), uniform(-2, 2)},
                           {ratio * wide * c, ratio * wide * s},
                           {wide * (lean * c - s), wide * (lean * s + c)}};
}

/* Checks of 32 texels as a picture are `checker`, but for edges that are a texel wide or a part of
 * the footprint. */
static void pictures_of_checks_are_checks(void **state) {
    (void)state;
    made m = picture_of(64, 64, checks);
    raise(&m);
    assert_true(m.pyramid.grey);
    const shd_pattern checker = {.kind = SHD_CHECKER, .map = {{2, 0, 0}, {0, 2, 1}}};
    double squares = 0, worst = 0;
    enum { COUNT = 2000 };
    for (int k = 0; k < COUNT; k++) {
        const shd_footprint f = footprint_of(exp(uniform(-1, 2.8)), exp(uniform(0, 2.7)),
                                             uniform(-0.5, 0.5), uniform(0, 7));
        double out[4];
        shd_picture_mean(&m.pyramid, SHD_WRAP_REPEAT, &f, out);
        const double off = fabs(out[0] - shd_pattern_mean(&checker, &f));
        squares += off * off;
        worst = fmax(worst, off);
    }
    if (sqrt(squares / COUNT) > 0.03 || worst > 0.15)
        fail_msg("off by %g, at worst %g", sqrt(squares / COUNT), worst);
    drop_picture(&m);
}

/* Of a picture that is smooth, the mean is that of all points, but for what levels blur. */
static double waves(int x, int y, int c) {
    return sin(2 * SHD_PI * (x + 2 * c) / 64) + cos(2 * SHD_PI * (y + x) / 64);
}

static void means_of_smooth_pictures_are_exact(void **state) {
    (void)state;
    made m = picture_of(64, 64, waves);
    raise(&m);
    for (int k = 0; k < 300; k++) {
        const shd_footprint f = footprint_of(exp(uniform(-2, 2)), exp(uniform(0, 2.5)),
                                             uniform(-0.5, 0.5), uniform(0, 7));
        double out[4], sum = 0;
        shd_picture_mean(&m.pyramid, SHD_WRAP_REPEAT, &f, out);
        enum { SIDE = 60 };
        for (int i = 0; i < SIDE * SIDE; i++) {
            const double a = (i % SIDE + 0.5) / SIDE - 0.5, b = (i / SIDE + 0.5) / SIDE - 0.5,
                         x = 64 * (f.at[0] + a * f.x[0] + b * f.y[0]) - 0.5,
                         y = 64 * (1 - f.at[1] - a * f.x[1] - b * f.y[1]) - 0.5;
            sum += sin(2 * SHD_PI * x / 64) + cos(2 * SHD_PI * (x + y) / 64);
        }
        if (fabs(out[0] - sum / SIDE / SIDE) > 0.04)
            fail_msg("%g, but %g by force", out[0], sum / SIDE / SIDE);
    }
    drop_picture(&m);
}

/* A little more or less of a footprint is a little more or less of the mean: levels and counts of
 * points come and go without a step. */
static void means_change_without_steps(void **state) {
    (void)state;
    made m = picture_of(64, 64, checks);
    raise(&m);
    for (int line = 0; line < 6; line++) {
        double before[4], most = 0;
        const double ratio = line < 3 ? 1 : 9, turn = 0.3 + line;
        for (int k = 0; k <= 4000; k++) {
            const double wide = exp(-5 + k / 4000.0 * 6), c = cos(turn), s = sin(turn);
            const shd_footprint f = {
                {0.43, 0.54}, {ratio * wide * c, ratio * wide * s}, {-wide * s, wide * c}};
            double out[4];
            shd_picture_mean(&m.pyramid, SHD_WRAP_REPEAT, &f, out);
            if (k) most = fmax(most, fabs(out[0] - before[0]));
            for (int i = 0; i < 4; i++) before[i] = out[i];
        }
        if (most > 0.05) fail_msg("line %d: a step of %g", line, most);
    }
    drop_picture(&m);
}

/* Nothing that numbers can say is out of range, and none of it is slow. */
static void any_footprint_has_a_mean(void **state) {
    (void)state;
    static const double odd[] = {0, 1e-300, 1e-9, 1, 3e5, 1e12, 1e300, INFINITY, NAN, -1e-5, -7};
    static const int sides[][2] = {{1, 1}, {1, 300}, {300, 1}, {6, 5}};
    for (int s = 0; s < 4; s++) {
        made m = picture_of(sides[s][0], sides[s][1], noise);
        m.rgba[0] = m.texels.high[0] = 3e38f;
        m.rgba[4 * (sides[s][0] * sides[s][1] - 1) + 1] = m.texels.low[1] = -3e38f;
        if (s == 0) m.texels.low[0] = 3e38f, m.texels.high[1] = -3e38f;
        raise(&m);
        for (int k = 0; k < 3000; k++) {
            double v[6], out[4];
            for (int i = 0; i < 6; i++) v[i] = odd[(int)uniform(0, sizeof odd / sizeof *odd)];
            const shd_footprint f = {{v[0], v[1]}, {v[2], v[3]}, {v[4], v[5]}};
            const shd_pattern pattern = {.kind = SHD_PICTURE,
                                         .map = {{1, 0.5, 0}, {-0.25, 1, 0}},
                                         .wrap = (shd_wrap)(k % 3),
                                         .picture = &m.pyramid};
            shd_texture_mean(&pattern, &f, out);
            for (int c = 0; c < 4; c++)
                assert_true(out[c] >= m.texels.low[c] && out[c] <= m.texels.high[c]);
        }
        drop_picture(&m);
    }
}

/* Sides as long as each other: tiers know points to some 1e-15, and must see the same. */
static void rounding_moves_no_mean(void **state) {
    (void)state;
    made m = picture_of(33, 33, noise);
    raise(&m);
    for (int k = 0; k < 20000; k++) {
        const double turn = uniform(0, 7), open = k % 2 ? 1.5707963267948966 : uniform(0.1, 3),
                     size = pow(10, uniform(-4, 0));
        const shd_footprint f = {{uniform(0, 1), uniform(0, 1)},
                                 {size * cos(turn), size * sin(turn)},
                                 {size * cos(turn + open), size * sin(turn + open)}};
        shd_footprint beside = f;
        for (int i = 0; i < 2; i++) {
            beside.x[i] *= 1 + uniform(-1e-15, 1e-15);
            beside.y[i] *= 1 + uniform(-1e-15, 1e-15);
        }
        const shd_pattern pattern = {.kind = SHD_PICTURE,
                                     .map = {{1, 0, 0}, {0, 1, 0}},
                                     .wrap = (shd_wrap)(k % 3),
                                     .picture = &m.pyramid};
        double one[4], other[4];
        shd_texture_mean(&pattern, &f, one);
        shd_texture_mean(&pattern, &beside, other);
        for (int c = 0; c < 4; c++)
            if (fabs(one[c] - other[c]) > 1e-6) fail_msg("%d: %.9g and %.9g", k, one[c], other[c]);
    }
    drop_picture(&m);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(levels_have_one_mean),
        cmocka_unit_test(points_lie_between_texels),
        cmocka_unit_test(pictures_of_checks_are_checks),
        cmocka_unit_test(means_of_smooth_pictures_are_exact),
        cmocka_unit_test(means_change_without_steps),
        cmocka_unit_test(any_footprint_has_a_mean),
        cmocka_unit_test(rounding_moves_no_mean),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
