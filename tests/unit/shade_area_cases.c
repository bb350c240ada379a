/* Lights with a shape: closed forms, limits, and the hard cases of docs/model.md. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "unit/area_support.h"

/* cmocka's assert_float_equal compares floats. */
#define assert_near(a, b, off) check_near(a, b, off, __LINE__)

static void check_near(double a, double b, double off, int line) {
    if (fabs(a - b) <= off) return;
    print_message("line %d: %.17g is not %.17g, to %g\n", line, a, b, off);
    fail();
}

/* A sphere that the horizon cuts: the closed form of Snyder, "Area Light Sources for Real-Time
 * Graphics", MSR-TR-96-11, 1996, for a sphere of angle a, whose middle is w over the horizon's
 * normal. */
static double snyder(double w, double a) {
    const double s = sin(a), c = cos(w), q = sin(w);
    if (w + a <= SHD_PI / 2) return SHD_PI * c * s * s;
    const double y = asin(cos(a) / q), t = cos(a) * cos(a);
    const double G = -2 * q * cos(a) * cos(y) + SHD_PI / 2 - y + sin(y) * cos(y);
    const double H =
        c * (cos(y) * sqrt(fmax(0, s * s - cos(y) * cos(y))) + s * s * asin(fmin(1, cos(y) / s)));
    (void)t;
    return w <= SHD_PI / 2 ? SHD_PI * c * s * s + G - H : G + H;
}

static void spheres_sink_as_in_snyders_closed_form(void **state) {
    (void)state;
    for (int i = 1; i < 200; i++) {
        const double w = SHD_PI / 2 + (i - 100) * 0.01;
        shd_light light =
            shape_light(SHD_LIGHT_SPHERE, (shd_vec3){3 * sin(w), 3 * cos(w), 0}, down);
        light.radius = 3 * sin(0.5);
        const weighed found = weigh_shape(&light, surface_at(zero, up, up, NULL), 1);
        const double wanted = w - 0.5 < SHD_PI / 2 ? snyder(w, 0.5) / shd_light_area(&light) : 0;
        assert_near(found.diffuse, wanted, 1e-13);
        assert_near(found.lobe, found.diffuse, 1e-9); /* V is N */
    }
}

static void parallel_discs_on_the_axis_have_the_textbooks_form(void **state) {
    (void)state;
    for (double h = 1e-6; h < 1e7; h *= 10) {
        shd_light light = shape_light(SHD_LIGHT_DISC, (shd_vec3){0, h, 0}, down);
        const double r = light.radius, wanted = 1 / (r * r + h * h);
        const weighed found = weigh_shape(&light, surface_at(zero, up, up, NULL), 1);
        assert_near(found.diffuse / wanted, 1, 1e-12);
        assert_near(found.lobe / wanted, 1, 2e-8);
    }
}

/* A rectangle's corner over the point: the form factor of two parallel plates' corner (Howell's
 * catalogue, B-4). */
static void corners_of_rectangles_have_the_textbooks_form(void **state) {
    (void)state;
    for (double h = 1e-3; h < 1e4; h *= 7) {
        shd_light light = shape_light(SHD_LIGHT_RECT, (shd_vec3){1, h, 0.5}, down);
        light.across = (shd_vec3){1, 0, 0};
        light.up = (shd_vec3){0, 0, 1};
        const double a = 2 / h, b = 1 / h, sa = sqrt(1 + a * a), sb = sqrt(1 + b * b);
        const double factor = (a / sa * atan(b / sa) + b / sb * atan(a / sb)) / (2 * SHD_PI);
        const weighed found = weigh_shape(&light, surface_at(zero, up, up, NULL), 1);
        assert_near(found.diffuse / (SHD_PI * factor / 2), 1, 1e-12);
        assert_near(found.lobe / (SHD_PI * factor / 2), 1, 1e-11);
    }
}

static void lights_all_over_the_sky_show_their_radiance(void **state) {
    (void)state;
    const shd_light_type types[] = {SHD_LIGHT_RECT, SHD_LIGHT_DISC};
    for (int i = 0; i < 2; i++) {
        shd_light light = shape_light(types[i], up, down);
        light.size[0] = light.size[1] = light.radius = 1e6;
        const weighed found = weigh_shape(&light, surface_at(zero, up, up, NULL), 3);
        const double area = shd_light_area(&light);
        assert_near(found.diffuse * area / SHD_PI, 1, 1e-10);
        assert_near(found.lobe * area / (2 * SHD_PI / 4), 1, 1e-7);
    }
}

/* The light as a point, whose equations are shade/exact.h's. */
static weighed as_point(const shd_light *light, shd_surface at, double exponent) {
    shd_plan_light point = {.position = light->position, .attenuated = true, .c = 1, .gain = 1};
    weighed out;
    double factor, off;
    out.diffuse = shd_weigh_light(&point, at.position, at.normal, at.mirror, &factor, &off);
    shd_vec3 toward = down;
    shd_normalize(shd_sub(at.position, light->position), &toward);
    const double shine = light->type == SHD_LIGHT_SPHERE ? 1 : shd_dot(toward, light->direction);
    out.diffuse *= shine;
    out.lobe = shine * shd_weigh_lobe(exponent, factor, off);
    return out;
}

/* A small shape is a point to the second order in its size, through the borders at which the code
 * takes other ways; the figure of shd_area_choose holds. */
static void small_and_far_shapes_become_points(void **state) {
    (void)state;
    srand(6);
    double far_off = 0;
    for (int i = 0; i < 3000; i++) {
        const shd_light_type type = (shd_light_type)(SHD_LIGHT_RECT + i % 3);
        const double size = pow(10, -1 - 9 * uniform()), n = exponents[i / 3 % 12];
        if (n > 0 && n < 2 && n != 1) continue;
        const shd_vec3 far = random_unit();
        shd_light light = shape_light(type, far, shd_madd(shd_scale(far, -1), random_unit(), 0.7));
        light.size[0] = 2 * size;
        light.size[1] = size;
        light.radius = size;
        const shd_surface at = surface_at(zero, shd_madd(far, random_unit(), 0.7),
                                          shd_madd(far, random_unit(), 0.7), NULL);
        const weighed found = weigh_shape(&light, at, n), point = as_point(&light, at, n);
        if (shd_dot(at.normal, far) < 2 * size || fabs(shd_dot(at.mirror, far)) < 2 * size)
            continue;
        double off;
        const shd_plan_lobe lobe = {{1, 1, 1}, n};
        const shd_area_method method = shd_area_choose(&light, &lobe, 1, 1, 0, &off);
        const double bound =
            method == SHD_AREA_POINT ? off : 1.3 * size * size * (n + 1 + 4 * sqrt(n) + 12);
        far_off = fmax(far_off, (fabs(found.lobe - point.lobe) - 1e-11) / bound);
        far_off = fmax(far_off, (fabs(found.diffuse - point.diffuse) - 1e-11) / bound);
        if (method == SHD_AREA_POINT) assert_true(off <= 1e-9);
        assert_true(fabs(found.lobe - point.lobe) <= bound + 1e-10);
        assert_true(fabs(found.diffuse - point.diffuse) <= bound + 1e-10);
    }
    print_message("as a point: at most %.2f of what is told\n", far_off);
}

/* No step where the code takes another way. */
static void weights_are_continuous_in_size(void **state) {
    (void)state;
    for (int i = 0; i < 3; i++) {
        weighed before = {0};
        for (double size = 0.5; size > 1e-12; size *= 0.999) {
            shd_light light =
                shape_light((shd_light_type)(SHD_LIGHT_RECT + i), (shd_vec3){0.3, 1, 0.2}, down);
            light.size[0] = light.size[1] = light.radius = size;
            const weighed now =
                weigh_shape(&light, surface_at(zero, up, (shd_vec3){0.1, 1, 0.3}, NULL), 40);
            if (before.lit) {
                assert_true(fabs(now.diffuse - before.diffuse) < 0.01 * size * size + 1e-9);
                assert_true(fabs(now.lobe - before.lobe) < 0.1 * size * size + 1e-8);
            }
            before = now;
        }
    }
}

static void nothing_comes_from_behind_inside_or_the_plane(void **state) {
    (void)state;
    for (int i = 0; i < 3; i++) {
        const shd_light_type type = (shd_light_type)(SHD_LIGHT_RECT + i);
        shd_light light = shape_light(type, (shd_vec3){0, 1, 0}, up); /* shines away */
        if (type != SHD_LIGHT_SPHERE)
            assert_false(weigh_shape(&light, surface_at(zero, up, up, NULL), 4).lit);
        /* Below the horizon. */
        light = shape_light(type, (shd_vec3){0, -2, 0}, up);
        assert_false(weigh_shape(&light, surface_at(zero, up, up, NULL), 4).lit);
        /* On the light, and in the sphere. */
        light = shape_light(type, (shd_vec3){7.3, 1e-17, 0.1}, down);
        assert_false(weigh_shape(&light, surface_at((shd_vec3){7.4, 0, 0}, up, up, NULL), 4).lit);
        /* Flush with the floor. */
        light = shape_light(type, zero, up);
        if (type != SHD_LIGHT_SPHERE)
            assert_false(
                weigh_shape(&light, surface_at((shd_vec3){0.1, 0, 0}, up, up, NULL), 4).lit);
        /* At the point itself. */
        light = shape_light(type, zero, down);
        assert_false(weigh_shape(&light, surface_at(zero, up, up, NULL), 4).lit);
    }
}

/* A wall light that goes through the floor, and grazing ones: finite, and the half above counts. */
static void lights_through_the_horizon_are_cut(void **state) {
    (void)state;
    for (int i = 0; i < 3; i++) {
        const shd_light_type type = (shd_light_type)(SHD_LIGHT_RECT + i);
        shd_light light = shape_light(type, (shd_vec3){0, 0, -2}, (shd_vec3){0, 0, 1});
        light.up = up;
        light.across = (shd_vec3){1, 0, 0};
        const weighed half =
            weigh_shape(&light, surface_at(zero, up, (shd_vec3){0, 1, 1}, NULL), 8);
        const weighed below =
            weigh_shape(&light, surface_at(zero, down, (shd_vec3){0, -1, 1}, NULL), 8);
        assert_true(half.lit && half.diffuse > 0 && half.lobe > 0);
        assert_near(half.diffuse, below.diffuse, 1e-13);
        assert_near(half.lobe, below.lobe, 1e-8);
        for (double h = 1e-1; h > 1e-17; h /= 10) { /* as near as it gets */
            const weighed close =
                weigh_shape(&light,
                            surface_at((shd_vec3){0, 0.3, -2 + h}, (shd_vec3){0, 0, -1},
                                       (shd_vec3){0, 1, -1}, NULL),
                            8);
            assert_true(isfinite(close.diffuse) && isfinite(close.lobe));
            assert_true(close.diffuse <= SHD_PI / shd_light_area(&light) * (1 + 1e-12));
        }
    }
}

static void scale_changes_nothing_but_the_fall(void **state) {
    (void)state;
    static const double scales[] = {1e-150, 1e-23, 1, 1e19, 1e150};
    for (int i = 0; i < 3; i++) {
        const shd_light_type type = (shd_light_type)(SHD_LIGHT_RECT + i);
        const shd_light light =
            shape_light(type, (shd_vec3){0.3, 1.5, 0.4}, (shd_vec3){0.1, -1, 0.2});
        const shd_surface at =
            surface_at((shd_vec3){0.2, 0.1, -0.3}, up, (shd_vec3){0.4, 1, 0.1}, NULL);
        const weighed one = weigh_shape(&light, at, 20);
        for (size_t k = 0; k < sizeof scales / sizeof *scales; k++) {
            const double s = scales[k];
            shd_light scaled = light;
            shd_surface there = at;
            scaled.position = shd_scale(light.position, s);
            there.position = shd_scale(at.position, s);
            scaled.size[0] *= s, scaled.size[1] *= s, scaled.radius *= s;
            const weighed found = weigh_shape(&scaled, there, 20);
            assert_near(found.diffuse * s * s / one.diffuse, 1, 1e-11);
            assert_near(found.lobe * s * s / one.lobe, 1, 1e-8);
        }
    }
}

static void lobes_as_sharp_as_a_mirror_show_the_shape(void **state) {
    (void)state;
    for (int i = 0; i < 3; i++) {
        const shd_light light =
            shape_light((shd_light_type)(SHD_LIGHT_RECT + i), (shd_vec3){0, 2, 0}, down);
        const double whole = 2 * SHD_PI / (1e6 + 1) / shd_light_area(&light);
        const weighed in =
            weigh_shape(&light, surface_at(zero, up, (shd_vec3){0.1, 1, 0.05}, NULL), 1e6);
        const weighed out =
            weigh_shape(&light, surface_at(zero, up, (shd_vec3){0.9, 1, 0}, NULL), 1e6);
        assert_near(in.lobe / whole, 1, 1e-7);
        assert_true(out.lobe >= 0 && out.lobe < 1e-7 * whole);
    }
}

typedef struct two {
    shd_vec3 normal, mirror;
    double exponent;
} two;

static void phong_at(const void *context, shd_vec3 toward, double *row) {
    const two *t = context;
    const double z = shd_dot(t->mirror, toward);
    row[0] = shd_dot(t->normal, toward);
    row[1] = z > 0 ? pow(z, t->exponent) : 0;
}

/* Both ways of Phong's model agree to within what they tell. */
static void quadrature_over_directions_agrees_with_the_boundary(void **state) {
    (void)state;
    srand(7);
    static const double n[] = {1, 5, 40, 300, 2.5};
    double worst = 0, worst_told = 0;
    for (int i = 0; i < 600; i++) {
        const shd_vec3 far = shd_scale(random_unit(), 0.4 + 2 * uniform());
        const shd_light light = shape_light((shd_light_type)(SHD_LIGHT_RECT + i % 3), far,
                                            shd_add(shd_scale(far, -1), random_unit()));
        const double exponent = n[i % 5];
        const shd_surface at =
            surface_at(zero, shd_madd(random_unit(), far, 0.3), random_unit(), NULL);
        const weighed wanted = weigh_shape(&light, at, exponent);
        const two context = {at.normal, at.mirror, exponent};
        const shd_area_model model = {.weigh = phong_at,
                                      .context = &context,
                                      .count = 2,
                                      .sharpness = exponent,
                                      .creases = {at.mirror},
                                      .crease_count = 1};
        double row[2];
        const double told = shd_area_integrate(&light, &at, 0, &model, row);
        assert_true((told >= 0) == wanted.lit);
        if (!wanted.lit) continue;
        const double most = fmax(wanted.diffuse, wanted.lobe);
        const double off = fmax(fabs(row[0] - wanted.diffuse), fabs(row[1] - wanted.lobe));
        worst = fmax(worst, off / most);
        worst_told = fmax(worst_told, told / most);
        if (off > told + 1e-8 * most)
            print_message("case %d: off %.2e, told %.2e n %g: %.12g %.12g %.12g %.12g\n", i,
                          off / most, told / most, exponent, row[0], wanted.diffuse, row[1],
                          wanted.lobe);
        assert_true(off <= told + 1e-8 * most);
    }
    print_message("quadrature: off %.1e, told %.1e\n", worst, worst_told);
    assert_true(worst < 1e-6);
}

/* Squares of equal areas have points of equal areas of the shape. */
static void points_of_the_unit_square_are_spread_by_area(void **state) {
    (void)state;
    enum { SIDE = 400 };
    for (int i = 0; i < 3; i++) {
        const shd_light_type type = (shd_light_type)(SHD_LIGHT_RECT + i);
        const shd_light light = shape_light(type, (shd_vec3){0.5, 2, 0}, (shd_vec3){0.2, -1, 0});
        shd_vec3 mean = zero, axis = zero;
        double spread = 0, lowest = INFINITY;
        shd_normalize(shd_sub(zero, light.position), &axis);
        for (int k = 0; k < SIDE * SIDE; k++) {
            const shd_vec3 p = shd_sub(
                shd_area_point(&light, zero, (k % SIDE + 0.5) / SIDE, (k / SIDE + 0.5) / SIDE),
                light.position);
            mean = shd_madd(mean, p, 1.0 / SIDE / SIDE);
            spread += shd_dot(p, p) / SIDE / SIDE;
            lowest = fmin(lowest, shd_dot(p, axis));
        }
        const double r = light.radius, cut = r * r / shd_length(light.position);
        if (type == SHD_LIGHT_SPHERE) { /* the mean height of a zone is its middle */
            assert_near(shd_dot(mean, axis), (r + cut) / 2, 1e-4);
            assert_true(lowest >= cut - 1e-12);
            assert_near(spread, r * r, 1e-12);
        } else {
            assert_true(shd_length(mean) < 1e-12);
            assert_near(spread, type == SHD_LIGHT_DISC ? r * r / 2 : 5.0 / 12, 1e-4);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(spheres_sink_as_in_snyders_closed_form),
        cmocka_unit_test(parallel_discs_on_the_axis_have_the_textbooks_form),
        cmocka_unit_test(corners_of_rectangles_have_the_textbooks_form),
        cmocka_unit_test(lights_all_over_the_sky_show_their_radiance),
        cmocka_unit_test(small_and_far_shapes_become_points),
        cmocka_unit_test(weights_are_continuous_in_size),
        cmocka_unit_test(nothing_comes_from_behind_inside_or_the_plane),
        cmocka_unit_test(lights_through_the_horizon_are_cut),
        cmocka_unit_test(scale_changes_nothing_but_the_fall),
        cmocka_unit_test(lobes_as_sharp_as_a_mirror_show_the_shape),
        cmocka_unit_test(quadrature_over_directions_agrees_with_the_boundary),
        cmocka_unit_test(points_of_the_unit_square_are_spread_by_area),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
