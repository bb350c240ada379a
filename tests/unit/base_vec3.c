/* Vectors and affine maps: any length, any handedness, no digits lost. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include <cmocka.h>

#include "base/vec3.h"

/* A division, a product, a sum of three and a root: each rounds once, 2^-53. */
static const double UNIT = 8 * 0x1p-53;

static void vectors_of_any_length_become_unit(void **state) {
    (void)state;
    static const double lengths[] = {5e-324, 1e-310, 1e-300, 1e-160, 1e-25,
                                     1,      3e25,   1e160,  3e300,  1.7e308};
    for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
        shd_vec3 unit = {7, 7, 7};
        assert_true(shd_normalize((shd_vec3){0, -lengths[i], 0}, &unit));
        assert_true(unit.x == 0 && unit.y == -1 && unit.z == 0);
        assert_true(shd_normalize((shd_vec3){lengths[i], lengths[i], lengths[i]}, &unit));
        assert_true(fabs(unit.x - 1 / sqrt(3)) <= UNIT);
        assert_true(unit.x == unit.y && unit.y == unit.z);
        assert_true(fabs(shd_dot(unit, unit) - 1) <= UNIT);
    }
}

static void what_has_no_direction_is_refused(void **state) {
    (void)state;
    const shd_vec3 cases[] = {
        {0, 0, 0},        {-0.0, 0, -0.0},   {NAN, 1, 0},      {1, NAN, 0},     {0, 1, NAN},
        {INFINITY, 1, 0}, {0, -INFINITY, 0}, {1, 1, INFINITY}, {NAN, NAN, NAN}, {INFINITY, NAN, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_vec3 out = {7, 8, 9};
        assert_false(shd_normalize(cases[i], &out));
        assert_true(out.x == 7 && out.y == 8 && out.z == 9);
    }
}

static void lengths_neither_overflow_nor_underflow(void **state) {
    (void)state;
    static const double sizes[] = {1e-320, 1e-200, 1, 1e200, 1e307};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        double s = sizes[i];
        /* Denormals have steps of 5e-324: that is what 3 s and 4 s themselves are rounded by. */
        double slack = 5 * s * UNIT + 3 * 4.9e-324;
        assert_true(fabs(shd_length((shd_vec3){3 * s, 0, -4 * s}) - 5 * s) <= slack);
    }
    assert_true(shd_length((shd_vec3){0, 0, 0}) == 0);
    assert_true(shd_length((shd_vec3){1, -INFINITY, 0}) == INFINITY);
}

static double max_difference(const shd_affine *a, const shd_affine *b) {
    double most = shd_max_abs(shd_sub(a->origin, b->origin));
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) most = fmax(most, fabs(a->linear[r][c] - b->linear[r][c]));
    return most;
}

static const shd_affine identity = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};

static double next(uint64_t *random) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return (double)(*random >> 11) * 0x1p-53;
}

static shd_affine random_map(uint64_t *random, double spread) {
    shd_affine m;
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 3; c++) m.linear[r][c] = 2 * next(random) - 1 + (r == c ? spread : 0);
    m.origin = (shd_vec3){next(random) - 0.5, next(random) - 0.5, next(random) - 0.5};
    return m;
}

static void inverses_undo_their_maps(void **state) {
    (void)state;
    uint64_t random = 1;
    for (int i = 0; i < 200; i++) {
        shd_affine m = random_map(&random, i % 2 ? 2 : -2), inverse;
        assert_true(shd_invert(&m, &inverse));
        shd_affine there = shd_compose(&inverse, &m), back = shd_compose(&m, &inverse);
        /* Condition numbers of these maps stay below 1e3; times 2^-53 with room for sums. */
        assert_true(max_difference(&there, &identity) < 1e-12);
        assert_true(max_difference(&back, &identity) < 1e-12);
    }
}

static void maps_of_any_scale_are_inverted(void **state) {
    (void)state;
    static const double scales[] = {1e-100, 1e-20, 1e-5, 1e5, 1e20, 1e100};
    for (size_t i = 0; i < sizeof scales / sizeof scales[0]; i++) {
        double s = scales[i];
        /* Flat to 1e-9 of its width, turned, and mirrored: far from singular all the same. */
        shd_affine m = {{{0, -s, 0}, {s * 1e-9, 0, 0}, {0, 0, s}}, {s, 2 * s, 3 * s}}, inverse;
        assert_true(shd_invert(&m, &inverse));
        shd_affine there = shd_compose(&inverse, &m);
        assert_true(max_difference(&there, &identity) < 1e-12);
    }
}

static void singular_maps_are_refused(void **state) {
    (void)state;
    const shd_affine cases[] = {
        {{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}}, {0, 0, 0}},
        {{{1, 0, 0}, {0, 0, 0}, {0, 0, 1}}, {0, 0, 0}},
        {{{1, 2, 3}, {2, 4, 6}, {0, 0, 1}}, {0, 0, 0}},
        {{{1, 1, 0}, {0, 0, 1}, {0, 0, 1}}, {0, 0, 0}},
        {{{1, 1, 0}, {1, 1 + 1e-14, 0}, {0, 0, 1}}, {0, 0, 0}},
        {{{NAN, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}},
        {{{INFINITY, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}},
        {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {NAN, 0, 0}},
        {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, INFINITY, 0}},
        {{{1e-320, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}}, /* its inverse is beyond f64 */
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_affine out, before;
        memset(&out, 42, sizeof out);
        memcpy(&before, &out, sizeof out);
        assert_false(shd_invert(&cases[i], &out));
        assert_memory_equal(&out, &before, sizeof out);
    }
}

/* The sphere point at (theta, phi), carried by m. */
static shd_vec3 carried(const shd_affine *m, double theta, double phi) {
    return shd_transform(m, (shd_vec3){sin(theta) * cos(phi), cos(theta), sin(theta) * sin(phi)});
}

/* The normal of the carried sphere from tangents by central differences, turned outward: away
 * from the image of the centre. */
static shd_vec3 normal_by_differences(const shd_affine *m, double theta, double phi) {
    const double h = 1e-5; /* error of the tangents: h^2/6 of the third derivative, 2e-11 */
    shd_vec3 a = shd_sub(carried(m, theta + h, phi), carried(m, theta - h, phi));
    shd_vec3 b = shd_sub(carried(m, theta, phi + h), carried(m, theta, phi - h));
    shd_vec3 normal = {0, 0, 0};
    assert_true(shd_normalize(a, &a) && shd_normalize(b, &b));
    assert_true(shd_normalize(shd_cross(a, b), &normal));
    double out = shd_dot(normal, shd_sub(carried(m, theta, phi), m->origin));
    return out < 0 ? shd_scale(normal, -1) : normal;
}

static void check_normal_map(const shd_affine *m, double tolerance) {
    const shd_affine map = shd_normal_map(m);
    assert_true(shd_max_abs(map.origin) == 0);
    for (double theta = 0.2; theta < 3; theta += 0.3)
        for (double phi = 0; phi < 6; phi += 0.5) {
            shd_vec3 n = {sin(theta) * cos(phi), cos(theta), sin(theta) * sin(phi)};
            shd_vec3 got = {0, 0, 0}, wanted = normal_by_differences(m, theta, phi);
            assert_true(shd_normalize(shd_linear(&map, n), &got));
            assert_true(shd_max_abs(shd_sub(got, wanted)) < tolerance);
        }
}

static void normals_agree_with_finite_differences(void **state) {
    (void)state;
    /* Tangents are known to 2e-11 plus 2^-53/h = 1e-11; squashing by 10 multiplies angles by as
     * much, and the sphere's own tangents are up to 5 times shorter near its poles. */
    const shd_affine squashed = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 0.1}}, {3, 2, 1}};
    const shd_affine mirrored = {{{-1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {0, 0, 0}};
    const shd_affine both = {{{1, 0, 0}, {0, -0.1, 0}, {0, 0, 2}}, {0, 0, 0}};
    const shd_affine inside_out = {{{-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {0, 0, 0}};
    check_normal_map(&identity, 1e-8);
    check_normal_map(&squashed, 1e-8);
    check_normal_map(&mirrored, 1e-8);
    check_normal_map(&both, 1e-8);
    check_normal_map(&inside_out, 1e-8);
    uint64_t random = 2;
    for (int i = 0; i < 20; i++) {
        shd_affine m = random_map(&random, i % 2 ? 2.5 : -2.5);
        check_normal_map(&m, 1e-8);
    }
}

static void a_squashed_sphere_has_the_normals_of_an_ellipsoid(void **state) {
    (void)state;
    /* model.md: scale (1,1,.1) by the matrix itself is 78.6 degrees off. */
    const shd_affine m = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 0.1}}, {0, 0, 0}};
    const shd_affine map = shd_normal_map(&m);
    shd_vec3 n = {0.6, 0, 0.8}, got = {0, 0, 0}, wanted = {0, 0, 0};
    /* Of x^2 + y^2 + (z/.1)^2 = 1 the gradient at (x, y, .1 z) is (x, y, 10 z). */
    shd_normalize((shd_vec3){0.6, 0, 8}, &wanted);
    assert_true(shd_normalize(shd_linear(&map, n), &got));
    assert_true(shd_max_abs(shd_sub(got, wanted)) < UNIT);
}

static void normal_maps_hold_at_any_scale(void **state) {
    (void)state;
    const shd_affine one = {{{2, 0.5, 0}, {0, -1, 0.25}, {0.5, 0, 0.1}}, {0, 0, 0}};
    const shd_affine expected = shd_normal_map(&one);
    shd_vec3 wanted = {0, 0, 0};
    shd_normalize(shd_linear(&expected, (shd_vec3){0.36, 0.48, 0.8}), &wanted);
    for (int exponent = -1000; exponent <= 1000; exponent += 250) {
        shd_affine m = one;
        for (int r = 0; r < 3; r++)
            for (int c = 0; c < 3; c++) m.linear[r][c] = ldexp(one.linear[r][c], exponent);
        shd_affine map = shd_normal_map(&m);
        shd_vec3 got = {0, 0, 0};
        assert_true(shd_normalize(shd_linear(&map, (shd_vec3){0.36, 0.48, 0.8}), &got));
        assert_true(shd_max_abs(shd_sub(got, wanted)) < UNIT); /* a power of 2 rounds nothing */
    }
}

static void composing_is_applying_one_after_the_other(void **state) {
    (void)state;
    uint64_t random = 3;
    for (int i = 0; i < 50; i++) {
        shd_affine a = random_map(&random, 0), b = random_map(&random, 0);
        shd_affine ab = shd_compose(&a, &b);
        shd_vec3 p = {next(&random), next(&random), next(&random)};
        shd_vec3 once = shd_transform(&ab, p), twice = shd_transform(&a, shd_transform(&b, p));
        assert_true(shd_max_abs(shd_sub(once, twice)) < 32 * 0x1p-53); /* sums of about 20 terms */
    }
}

/* The largest factor by power iteration, from one of three directions. */
static double growth_of(const shd_affine *m) {
    double most = 0;
    for (int axis = 0; axis < 3; axis++) {
        shd_vec3 v = {axis == 0, axis == 1, axis == 2}, w;
        for (int i = 0; i < 20000; i++) {
            const shd_vec3 along = shd_linear(m, v);
            w.x = m->linear[0][0] * along.x + m->linear[1][0] * along.y + m->linear[2][0] * along.z;
            w.y = m->linear[0][1] * along.x + m->linear[1][1] * along.y + m->linear[2][1] * along.z;
            w.z = m->linear[0][2] * along.x + m->linear[1][2] * along.y + m->linear[2][2] * along.z;
            if (!shd_normalize(w, &v)) break;
        }
        most = fmax(most, shd_length(shd_linear(m, v)));
    }
    return most;
}

static void no_vector_grows_by_more_than_the_norm(void **state) {
    (void)state;
    uint64_t random = 5;
    for (int i = 0; i < 60; i++) {
        shd_affine m = random_map(&random, 0);
        if (i % 2) /* of which two are the same, more and more */
            m = (shd_affine){{{0, 3, 0}, {0, 0, 1}, {-3 * (1 - ldexp(1, -i)), 0, 0}}, {0, 0, 0}};
        const double growth = growth_of(&m), norm = shd_norm(&m);
        assert_true(norm >= growth * (1 - UNIT) && norm < growth * (1 + 1e-6));
    }
    const shd_affine none = {{{0}}, {0, 0, 0}};
    assert_true(shd_norm(&none) == 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vectors_of_any_length_become_unit),
        cmocka_unit_test(what_has_no_direction_is_refused),
        cmocka_unit_test(lengths_neither_overflow_nor_underflow),
        cmocka_unit_test(inverses_undo_their_maps),
        cmocka_unit_test(maps_of_any_scale_are_inverted),
        cmocka_unit_test(singular_maps_are_refused),
        cmocka_unit_test(normals_agree_with_finite_differences),
        cmocka_unit_test(a_squashed_sphere_has_the_normals_of_an_ellipsoid),
        cmocka_unit_test(normal_maps_hold_at_any_scale),
        cmocka_unit_test(composing_is_applying_one_after_the_other),
        cmocka_unit_test(no_vector_grows_by_more_than_the_norm),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
