/* Patterns under footprints, against brute force and closed forms; charts against differences. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "shade/chart.h"
#include "shade/texture.h"

static uint64_t seed = 7;

static double uniform(double low, double high) {
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(seed >> 11) * 0x1p-53);
}

static double fraction(double x) {
    return x - floor(x);
}

static double value_of(const shd_pattern *p, double u, double v) {
    const double s = p->map[0][0] * u + p->map[0][1] * v + p->map[0][2],
                 t = p->map[1][0] * u + p->map[1][1] * v + p->map[1][2];
    if (p->kind == SHD_CHECKER) return fmod(fabs(floor(s) + floor(t)), 2);
    if (p->kind == SHD_GRID)
        return fabs(s - round(s)) < p->width / 2 || fabs(t - round(t)) < p->width / 2;
    if (p->wrap == SHD_WRAP_CLAMP) return fmin(fmax(s, 0), 1);
    if (p->wrap == SHD_WRAP_REPEAT) return fraction(s);
    return fabs(s - 2 * round(s / 2));
}

/* The mean over so many points a side, each somewhere in its cell. */
static double brute_force(const shd_pattern *p, const shd_footprint *f, int side) {
    double sum = 0;
    for (int i = 0; i < side; i++)
        for (int k = 0; k < side; k++) {
            const double a = (i + uniform(0, 1)) / side - 0.5, b = (k + uniform(0, 1)) / side - 0.5;
            sum += value_of(p, f->at[0] + a * f->x[0] + b * f->y[0],
                            f->at[1] + a * f->x[1] + b * f->y[1]);
        }
    return sum / side / side;
}

static shd_pattern random_pattern(int k) {
    const double turn = uniform(0, 7), c = cos(turn), s = sin(turn), x = uniform(0.5, 2),
                 y = uniform(0.5, 2);
    return (shd_pattern){.kind = k % 5 == 0   ? SHD_CHECKER
                                 : k % 5 == 1 ? SHD_GRID
                                              : SHD_GRADIENT,
                         .map = {{c * x, -s * y, uniform(-3, 3)}, {s * x, c * y, uniform(-3, 3)}},
                         .wrap = k % 5 < 2 ? SHD_WRAP_CLAMP : (shd_wrap)(k % 5 - 2),
                         .width = k % 5 == 1 ? uniform(0.02, 0.98) : 0};
}

/* Parallelograms of any slant: as long as 40 cells, as narrow as a thousandth. Where they are wider
 * than half a cell, checks and lines fade (below), so they are narrower here. */
static void means_are_those_of_all_points(void **state) {
    (void)state;
    for (int k = 0; k < 150; k++) {
        const shd_pattern p = random_pattern(k);
        const double turn = uniform(0, 7), lean = uniform(-1, 1), long_side = exp(uniform(-5, 3.5)),
                     short_side = exp(uniform(-7, -1.6));
        const double a[2] = {cos(turn), sin(turn)};
        shd_footprint f = {{uniform(-9, 9), uniform(-9, 9)},
                           {long_side * a[0], long_side * a[1]},
                           {short_side * (lean * a[0] - a[1]), short_side * (lean * a[1] + a[0])}};
        /* Points in cells err by the square root of edges' cells, over all of them. */
        enum { SIDE = 200 };
        const double mean = shd_pattern_mean(&p, &f), sum = brute_force(&p, &f, SIDE);
        if (fabs(mean - sum) > 0.01) fail_msg("case %d: %.6f, but %.6f by force", k, mean, sum);
    }
}

/* Gradients alone are neither 0 nor 1 as well as smooth. */
static void variances_are_those_of_all_points(void **state) {
    (void)state;
    enum { SIDE = 100 };
    for (int k = 0; k < 60; k++) {
        const shd_pattern p = random_pattern(5 * k + 2 + k % 3);
        const double size = exp(uniform(-6, 2)), other = exp(uniform(-6, 2));
        const shd_footprint f = {{uniform(-3, 3), uniform(-3, 3)},
                                 {uniform(-size, size), uniform(-size, size)},
                                 {uniform(-other, other), uniform(-other, other)}};
        double sum = 0, squares = 0;
        for (int i = 0; i < SIDE * SIDE; i++) {
            const double a = (i % SIDE + uniform(0, 1)) / SIDE - 0.5,
                         b = ((double)(i / SIDE) + uniform(0, 1)) / SIDE - 0.5,
                         w = value_of(&p, f.at[0] + a * f.x[0] + b * f.y[0],
                                      f.at[1] + a * f.x[1] + b * f.y[1]);
            sum += w / SIDE / SIDE;
            squares += w * w / SIDE / SIDE;
        }
        const double told = shd_pattern_variance(&p, &f, shd_pattern_mean(&p, &f));
        if (fabs(told - (squares - sum * sum)) > 0.002)
            fail_msg("case %d: %.6f, but %.6f by force", k, told, squares - sum * sum);
    }
}

/* Of noise it is what footprints have on the average. */
static void noise_varies_as_much_as_is_expected(void **state) {
    (void)state;
    enum { PLACES = 900, POINTS = 60 };
    for (int k = 0; k < 12; k++) {
        const shd_pattern p = {
            .kind = SHD_NOISE, .map = {{1, 0, 0}, {0, 1, 0}}, .octaves = 1 + k % 3};
        const double wide = 0.05 * pow(2.5, k % 6), narrow = k < 6 ? wide : 0.2 * wide;
        double sum = 0;
        for (int i = 0; i < PLACES; i++) {
            const double s = uniform(-99, 99), t = uniform(-99, 99);
            double mean = 0, squares = 0;
            for (int j = 0; j < POINTS; j++) {
                const shd_footprint point = {
                    {s + wide * uniform(-0.5, 0.5), t + narrow * uniform(-0.5, 0.5)}, {0}, {0}};
                const double w = shd_pattern_mean(&p, &point);
                mean += w / POINTS;
                squares += w * w / POINTS;
            }
            sum += (squares - mean * mean) * POINTS / (POINTS - 1.0) / PLACES;
        }
        const shd_footprint f = {{0.3, 0.4}, {wide, 0}, {0, narrow}};
        const double told = shd_pattern_variance(&p, &f, 0.5);
        if (!(fabs(told / sum - 1) < 0.2)) fail_msg("case %d: %g, but %g by force", k, told, sum);
        if (getenv("SHADED_MEASURE"))
            printf("%.3g x %.3g, %d octaves: %.4g by %.4g\n", wide, narrow, p.octaves, told, sum);
    }
}

/* Along an axis the mean of an edge is how much of the pixel is beyond it. */
static void edges_are_as_sharp_as_pixels(void **state) {
    (void)state;
    const shd_pattern p = {.kind = SHD_CHECKER, .map = {{1, 0, 0}, {0, 1, 0}}};
    for (double at = -0.06; at < 0.06; at += 0.0113) {
        const shd_footprint f = {{1 + at, 0.5}, {0.1, 0}, {0, 0.1}};
        const double beyond = fmin(fmax(at / 0.1 + 0.5, 0), 1);
        assert_true(fabs(shd_pattern_mean(&p, &f) - beyond) < 1e-6);
    }
    /* At a corner of four checks, half of any pixel is dark. */
    for (double size = 1e-6; size < 0.5; size *= 7) {
        const shd_footprint f = {{3, 5}, {size, 0}, {0, size}};
        assert_true(fabs(shd_pattern_mean(&p, &f) - 0.5) < 1e-6);
    }
    const shd_footprint point = {{0.3, 0.4}, {0, 0}, {0, 0}};
    assert_true(shd_pattern_mean(&p, &point) < 1e-9);
}

static void what_is_finer_than_pixels_is_its_mean(void **state) {
    (void)state;
    const shd_pattern checker = {.kind = SHD_CHECKER, .map = {{1, 0, 0}, {0, 1, 0}}},
                      grid = {.kind = SHD_GRID, .map = {{1, 0, 0}, {0, 1, 0}}, .width = 0.3},
                      noise = {.kind = SHD_NOISE, .map = {{1, 0, 0}, {0, 1, 0}}, .octaves = 5};
    for (int k = 0; k < 50; k++) {
        const double size = exp(uniform(0.1, 9)), turn = uniform(0, 7), c = cos(turn),
                     s = sin(turn);
        const shd_footprint f = {
            {uniform(-99, 99), uniform(-99, 99)}, {size * c, size * s}, {-size * s, size * c}};
        assert_true(fabs(shd_pattern_mean(&checker, &f) - 0.5) < 1e-9);
        assert_true(fabs(shd_pattern_mean(&grid, &f) - 0.51) < 1e-9);
        if (size > 2) assert_true(fabs(shd_pattern_mean(&noise, &f) - 0.5) < 1e-9);
    }
}

/* Values are the same on every machine, in [0, 1], smooth, and finer octaves weigh half. */
static void noise_is_one_field(void **state) {
    (void)state;
    const shd_pattern p = {.kind = SHD_NOISE, .map = {{1, 0, 0}, {0, 1, 0}}, .octaves = 1};
    double least = 1, most = 0, sum = 0;
    for (int k = 0; k < 4000; k++) {
        const shd_footprint f = {{k % 80 - 40, k / 80 - 20}, {0, 0}, {0, 0}};
        const double w = shd_pattern_mean(&p, &f);
        least = fmin(least, w);
        most = fmax(most, w);
        sum += w;
    }
    assert_true(least >= 0 && least < 0.01 && most <= 1 && most > 0.99);
    assert_true(fabs(sum / 4000 - 0.5) < 0.02);
    const shd_footprint one = {{0, 0}, {0, 0}, {0, 0}}, other = {{-1, 2}, {0, 0}, {0, 0}};
    assert_true(fabs(shd_pattern_mean(&p, &one) - 0.0) < 1e-12);
    assert_true(fabs(shd_pattern_mean(&p, &other) - shd_pattern_mean(&p, &other)) == 0);
    for (int k = 0; k < 1000; k++) {
        const double s = uniform(-50, 50), t = uniform(-50, 50);
        const shd_footprint here = {{s, t}, {0, 0}, {0, 0}},
                            beside = {{s + 1e-5, t}, {0, 0}, {0, 0}};
        assert_true(fabs(shd_pattern_mean(&p, &here) - shd_pattern_mean(&p, &beside)) < 1.6e-5);
    }
}

/* Nothing that numbers can say makes more of it. */
static void any_footprint_has_a_mean(void **state) {
    (void)state;
    static const double odd[] = {0, 1e-300, 1e-9, 1, 3e5, 1e12, 1e300, INFINITY, NAN, -1e-5, -7};
    enum { COUNT = sizeof odd / sizeof odd[0] };
    for (int kind = 0; kind < SHD_PATTERN_COUNT; kind++)
        for (int k = 0; k < 3000; k++) {
            const shd_pattern p = {.kind = (shd_pattern_kind)kind,
                                   .map = {{1, 0.5, 0}, {-0.25, 1, 0}},
                                   .wrap = (shd_wrap)(k % 3),
                                   .width = 0.2,
                                   .octaves = 8};
            double v[6];
            for (int i = 0; i < 6; i++) v[i] = odd[(int)uniform(0, COUNT)];
            const shd_footprint f = {{v[0], v[1]}, {v[2], v[3]}, {v[4], v[5]}};
            const double mean = shd_pattern_mean(&p, &f);
            assert_true(mean >= 0 && mean <= 1);
            const double variance = shd_pattern_variance(&p, &f, mean);
            assert_true(variance >= 0 && variance <= mean * (1 - mean));
        }
}

/* ---- Charts. ---- */

/* A point of a unit form, and its normal there. */
static void place_on(shd_shape shape, int part, double a, double b, shd_vec3 *p, shd_vec3 *n) {
    const double around = 2 * SHD_PI * a, c = cos(around), s = sin(around);
    const double high = SHD_PI * (b - 0.5) * 0.98;
    switch (shape) {
    case SHD_SPHERE:
        *n = *p = (shd_vec3){cos(high) * s, sin(high), cos(high) * c};
        return;
    case SHD_CYLINDER:
        *p = (shd_vec3){s, b - 0.5, c}, *n = (shd_vec3){s, 0, c};
        if (!part) return;
        *p = (shd_vec3){b * s, part == 1 ? 0.5 : -0.5, b * c};
        *n = (shd_vec3){0, part == 1 ? 1 : -1, 0};
        return;
    case SHD_CONE:
        *p = (shd_vec3){(1 - b) * s, b - 0.5, (1 - b) * c}, *n = (shd_vec3){s, 1, c};
        return;
    case SHD_TORUS: {
        const double tube = 2 * SHD_PI * b, r = 1 + 0.3 * cos(tube);
        *p = (shd_vec3){r * s, 0.3 * sin(tube), r * c};
        *n = (shd_vec3){cos(tube) * s, sin(tube), cos(tube) * c};
        return;
    }
    case SHD_BOX: {
        const double face[2] = {a - 0.5, b - 0.5}, out = part & 1 ? 0.5 : -0.5;
        const int axis = part / 2;
        *p = axis == 0   ? (shd_vec3){out, face[0], face[1]}
             : axis == 1 ? (shd_vec3){face[0], out, face[1]}
                         : (shd_vec3){face[0], face[1], out};
        *n = axis == 0   ? (shd_vec3){2 * out, 0, 0}
             : axis == 1 ? (shd_vec3){0, 2 * out, 0}
                         : (shd_vec3){0, 0, 2 * out};
        return;
    }
    default:
        *p = (shd_vec3){a - 0.5, 0, b - 0.5}, *n = (shd_vec3){0, 1, 0};
    }
}

static shd_footprint footprint_at(const shd_chart *chart, const shd_affine *normals, shd_vec3 local,
                                  shd_vec3 normal, const shd_seen_by *ray) {
    shd_charted_point point = {.position = shd_transform(&chart->to_world, local)};
    shd_normalize(shd_linear(normals, normal), &point.normal);
    return shd_chart_footprint(chart, &point, ray);
}

/* Sides of footprints are how the chart changes where neighboring pixels see the tangent plane. */
static void footprints_are_slopes_of_charts(void **state) {
    (void)state;
    static const struct {
        shd_shape shape;
        int parts;
    } shapes[] = {{SHD_SPHERE, 1},   {SHD_PLANE, 1}, {SHD_DISC, 1}, {SHD_BOX, 6},
                  {SHD_CYLINDER, 3}, {SHD_CONE, 1},  {SHD_TORUS, 1}};
    for (int k = 0; k < 700; k++) {
        const shd_shape shape = shapes[k % 7].shape;
        const shd_object object = {
            .shape = shape,
            .radius = 2,
            .tube = 0.6,
            .height = 3,
            .size = {1, 2, 3},
            .transform = {{{1.1, 0.2, 0}, {-0.3, 0.9, 0.4}, {0.1, 0, 1.3}}, {3, 1, -2}}};
        const shd_chart chart = shd_chart_of(&object);
        const shd_affine normals = shd_normal_map(&chart.to_world);
        shd_vec3 p, n;
        place_on(shape, k / 7 % shapes[k % 7].parts, uniform(0.05, 0.95), uniform(0.05, 0.95), &p,
                 &n);
        shd_vec3 world = {0, 1, 0};
        shd_normalize(shd_linear(&normals, n), &world);
        const double step = 1e-6;
        const shd_seen_by ray = {shd_sub((shd_vec3){uniform(-1, 1), uniform(-1, 1), uniform(-1, 1)},
                                         shd_scale(world, 2)),
                                 {step, 2e-7, 0},
                                 {0, -step, 3e-7},
                                 false,
                                 0,
                                 0};
        const shd_footprint f = footprint_at(&chart, &normals, p, n, &ray);
        const shd_vec3 sides[2] = {ray.right, ray.down};
        for (int i = 0; i < 2; i++) {
            const double facing = shd_dot(world, ray.way);
            const shd_vec3 slid = shd_madd(sides[i], ray.way, -shd_dot(world, sides[i]) / facing);
            const shd_footprint there = footprint_at(
                &chart, &normals, shd_add(p, shd_linear(&chart.from_world, slid)), n, &ray);
            const double *side = i ? f.y : f.x;
            for (int c = 0; c < 2; c++)
                if (fabs(there.at[c] - f.at[c] - side[c]) > 1e-9)
                    fail_msg("case %d, shape %d: (u, v)[%d] moves by %g, not %g", k, (int)shape, c,
                             there.at[c] - f.at[c], side[c]);
        }
    }
}

/* What docs/textures.md says of each. */
static void charts_are_where_they_are_documented(void **state) {
    (void)state;
    static const struct {
        shd_shape shape;
        shd_vec3 at, normal;
        double u, v;
    } cases[] = {
        {SHD_SPHERE, {0, 0, 1}, {0, 0, 1}, .5, .5},
        {SHD_SPHERE, {1, 0, 0}, {1, 0, 0}, .75, .5},
        {SHD_SPHERE, {0, 1, 0}, {0, 1, 0}, .5, 1},
        {SHD_SPHERE, {-1, 0, 0}, {-1, 0, 0}, .25, .5},
        {SHD_PLANE, {3, 0, 2}, {0, 1, 0}, 3, -2},
        {SHD_DISC, {1, 0, 0}, {0, 1, 0}, 1, .5},
        {SHD_DISC, {0, 0, 1}, {0, 1, 0}, .5, 0},
        {SHD_BOX, {.5, .5, .5}, {0, 0, 1}, 1, 1},
        {SHD_BOX, {.5, .5, .5}, {1, 0, 0}, 0, 1},
        {SHD_BOX, {-.5, .5, .5}, {-1, 0, 0}, 1, 1},
        {SHD_BOX, {.5, .5, -.5}, {0, 0, -1}, 0, 1},
        {SHD_BOX, {.5, .5, .5}, {0, 1, 0}, 1, 0},
        {SHD_BOX, {.5, -.5, .5}, {0, -1, 0}, 1, 1},
        {SHD_CYLINDER, {0, .5, 1}, {0, 0, 1}, .5, 1},
        {SHD_CYLINDER, {1, .5, 0}, {0, 1, 0}, 1, .5},
        {SHD_CYLINDER, {0, -.5, 1}, {0, -1, 0}, .5, 1},
        {SHD_CONE, {0, -.5, 1}, {0, 1, 1}, .5, 0},
        {SHD_TORUS, {0, 0, 1.3}, {0, 0, 1}, .5, .5},
        {SHD_TORUS, {1, .3, 0}, {0, 1, 0}, .75, .75},
    };
    const shd_seen_by ray = {{0.1, 0.2, -1}, {1e-3, 0, 0}, {0, -1e-3, 0}, false, 0, 0};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const shd_object object = {.shape = cases[i].shape,
                                   .radius = 1,
                                   .tube = 0.3,
                                   .height = 1,
                                   .size = {1, 1, 1},
                                   .transform = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}};
        const shd_chart chart = shd_chart_of(&object);
        const shd_charted_point point = {.position = cases[i].at, .normal = cases[i].normal};
        const shd_footprint f = shd_chart_footprint(&chart, &point, &ray);
        if (fabs(f.at[0] - cases[i].u) > 1e-12 || fabs(f.at[1] - cases[i].v) > 1e-12)
            fail_msg("case %zu: (%g, %g)", i, f.at[0], f.at[1]);
    }
}

/* Sides as long as each other, at any angle or at a right one, and ones that are both too short. */
static shd_footprint even_footprint(int k) {
    const double turn = uniform(0, 7), open = k % 3 == 1 ? 1.5707963267948966 : uniform(0.1, 3),
                 size = k % 3 == 2 ? pow(10, uniform(-7, -4.1)) : pow(10, uniform(-5, 2)),
                 other = k % 3 == 2 ? pow(10, uniform(-7, -4.1)) : size;
    const double near = k % 2 ? 1e-4 : 1; /* to an edge */
    return (shd_footprint){{(k % 7) + uniform(-near, near), uniform(-near, near)},
                           {size * cos(turn), size * sin(turn)},
                           {other * cos(turn + open), other * sin(turn + open)}};
}

/* Tiers know points to some 1e-15, and must see the same. */
static void rounding_moves_no_mean(void **state) {
    (void)state;
    for (int k = 0; k < 20000; k++) {
        shd_pattern p = random_pattern(k);
        const double turn = uniform(0, 7), c = cos(turn), s = sin(turn);
        const double map[2][3] = {{c, -s, 0}, {s, c, 0}};
        if (k % 5 == 4) p = (shd_pattern){.kind = SHD_NOISE, .octaves = 1 + k % 8};
        for (int i = 0; i < 6; i++) p.map[i / 3][i % 3] = map[i / 3][i % 3];
        const shd_footprint f = even_footprint(k);
        shd_footprint beside = f;
        for (int i = 0; i < 2; i++) {
            beside.at[i] += uniform(-1e-15, 1e-15);
            beside.x[i] *= 1 + uniform(-1e-15, 1e-15);
            beside.y[i] *= 1 + uniform(-1e-15, 1e-15);
        }
        const double one = shd_pattern_mean(&p, &f), other = shd_pattern_mean(&p, &beside);
        if (fabs(one - other) > 1e-6)
            fail_msg("%s %d: %.9g and %.9g", shd_pattern_names[p.kind], k, one, other);
        const double spread = shd_pattern_variance(&p, &f, one),
                     spreads = shd_pattern_variance(&p, &beside, other);
        if (fabs(spread - spreads) > 1e-6)
            fail_msg("%s %d: %.9g and %.9g", shd_pattern_names[p.kind], k, spread, spreads);
    }
}

/* Rounding of what is farther out must not lose a line, or count it twice. */
static void lines_are_the_same_a_whole_number_aside(void **state) {
    (void)state;
    for (int k = 0; k < 5000; k++) {
        const shd_pattern p = {
            .kind = SHD_GRID, .map = {{1, 0, 0}, {0, 1, 0}}, .width = uniform(0.01, 0.99)};
        const double size = pow(10, uniform(-2, 1));
        const shd_footprint f = {{uniform(0, 1), uniform(0, 1)},
                                 {uniform(-size, size), uniform(-size, size)},
                                 {uniform(-1, 1), uniform(-1, 1)}};
        shd_footprint aside = f;
        aside.at[0] += k % 17;
        aside.at[1] -= k % 13;
        const double one = shd_pattern_mean(&p, &f), other = shd_pattern_mean(&p, &aside);
        if (fabs(one - other) > 1e-6) fail_msg("%d: %.9g and %.9g", k, one, other);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(means_are_those_of_all_points),
        cmocka_unit_test(variances_are_those_of_all_points),
        cmocka_unit_test(noise_varies_as_much_as_is_expected),
        cmocka_unit_test(edges_are_as_sharp_as_pixels),
        cmocka_unit_test(what_is_finer_than_pixels_is_its_mean),
        cmocka_unit_test(noise_is_one_field),
        cmocka_unit_test(any_footprint_has_a_mean),
        cmocka_unit_test(footprints_are_slopes_of_charts),
        cmocka_unit_test(charts_are_where_they_are_documented),
        cmocka_unit_test(rounding_moves_no_mean),
        cmocka_unit_test(lines_are_the_same_a_whole_number_aside),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
