/* Weights of a light against 113-bit floats, and the hard cases of the model: each beside the
 * naive formula, which fails it. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "unit/shade_support.h"

static kernel kernels[MOST_KERNELS];
static size_t kernel_count;

static int list_kernels(void **state) {
    (void)state;
    kernel_count = find_kernels(kernels);
    return 0;
}

/* The scale of a plan whose scene is as large as this. */
static double scale_of(double size) {
    return ldexp(1, -ilogb(size));
}

/* Weighs one light at one point that stands in every lane; checks that the lanes agree. */
static pair weigh(const kernel *k, double scale, const shd_plan_light *light, double shininess,
                  shd_vec3 p, shd_vec3 n, shd_vec3 v) {
    static points at;
    double diffuse[SHD_LANES + 3] = {0}, specular[SHD_LANES + 3] = {0};
    at.count = SHD_LANES + 3;
    for (size_t i = 0; i < at.count; i++) set_point(&at, i, p, n, v);
    weigh_points(k, scale, light, shininess, &at, true, diffuse, specular);
    for (size_t i = 1; i < at.count; i++) {
        assert_true(diffuse[i] == diffuse[0]);
        assert_true(specular[i] == specular[0]);
    }
    return (pair){diffuse[0], specular[0]};
}

/* Random points of a unit scene whose viewer is near the mirror direction, where the lobe is. */
static void scatter_points(const shd_plan_light *light, double shininess, points *at) {
    for (at->count = 0; at->count < MOST_POINTS;) {
        shd_vec3 p = shd_scale(random_unit(), uniform()), n = random_unit();
        shd_vec3 toward = light->toward, v = n;
        if (!light->directional) shd_normalize(shd_sub(light->position, p), &toward);
        if (shd_dot(n, toward) < 0.05) continue;
        shd_vec3 mirrored = shd_sub(shd_scale(n, 2 * shd_dot(n, toward)), toward);
        double spread = 2 / sqrt(shininess + 1) * uniform();
        shd_normalize(shd_madd(mirrored, random_unit(), spread), &v);
        set_point(at, at->count++, p, n, v);
    }
}

typedef struct errors {
    double diffuse, specular; /* relative; absolute, for f = 1 */
} errors;

/* The largest errors of all kernels, without and with low parts of positions, under lights without
 * attenuation. */
static void measure_errors(double shininess, errors out[MOST_KERNELS][2]) {
    static points at;
    static pair wanted[MOST_POINTS];
    static double diffuse[MOST_POINTS], specular[MOST_POINTS];
    srand(1);
    memset(out, 0, MOST_KERNELS * sizeof *out);
    for (int round = 0; round < 8; round++) {
        shd_plan_light light = point_light(shd_scale(random_unit(), 1.2 + 3 * uniform()));
        light.directional = round % 4 == 3;
        light.toward = random_unit();
        scatter_points(&light, shininess, &at);
        for (size_t i = 0; i < at.count; i++)
            wanted[i] = exact_weights(&light, shininess, lane_of(at.position, i),
                                      lane_of(at.normal, i), lane_of(at.view, i));
        for (size_t k = 0; k < kernel_count; k++) {
            for (int split = 0; split < 2; split++) {
                errors *worst = &out[k][split];
                weigh_points(&kernels[k], 1, &light, shininess, &at, split, diffuse, specular);
                for (size_t i = 0; i < at.count; i++) {
                    worst->diffuse = fmax(worst->diffuse, fabs(diffuse[i] / wanted[i].diffuse - 1));
                    worst->specular = fmax(worst->specular, fabs(specular[i] - wanted[i].specular));
                }
            }
        }
    }
}

/* The tiers' errors as docs/model.md states them: exact below 1e-12; standard 4e-7, 2.4e-6 and 3e-5
 * for ns 10, 1e3 and 1e5. */
static void tiers_keep_the_errors_of_the_table(void **state) {
    (void)state;
    static const double shininess[] = {0, 1, 10, 34, 35, 100, 1e3, 1e4, 1e5, 1e6};
    static const double standard[] = {4e-7, 4e-7, 4e-7, 7e-7, 7e-7, 1e-6, 2.4e-6, 1e-5, 3e-5, 1e-4};
    for (size_t i = 0; i < sizeof shininess / sizeof shininess[0]; i++) {
        errors found[MOST_KERNELS][2];
        measure_errors(shininess[i], found);
        for (size_t k = 0; k < kernel_count; k++) {
            const shd_tier tier = kernels[k].tier;
            for (int split = 0; split < 2; split++) {
                const errors e = found[k][split];
                if (kernels[k].isa == shd_cpu_best() || kernels[k].isa == SHD_PORTABLE)
                    print_message("ns %-6g %s%s: diffuse %.1e specular %.1e\n", shininess[i],
                                  kernels[k].name, split ? " split" : "", e.diffuse, e.specular);
                assert_true(e.specular < (tier == SHD_EXACT ? 1e-12 : standard[i]));
            }
        }
    }
}

static const shd_vec3 origin = {0, 0, 0}, up = {0, 1, 0};

static void specular_at_the_mirror_direction_is_one(void **state) {
    (void)state;
    srand(2);
    double naive_worst = 0;
    for (int i = 0; i < 1000; i++) {
        shd_vec3 n = random_unit(), toward = random_unit(), v = n;
        if (shd_dot(n, toward) < 0.1) continue;
        shd_normalize(shd_sub(shd_scale(n, 2 * shd_dot(n, toward)), toward), &v);
        shd_plan_light light = point_light(toward);
        const double plan = scale_of(1);
        for (size_t k = 0; k < kernel_count; k++) {
            pair got = weigh(&kernels[k], plan, &light, 1e6, origin, n, v);
            assert_true(got.specular <= 1);
            /* standard: |L - W| is off by some 1e-7, d by 1e-14, times ns */
            assert_true(got.specular > 1 - 1e-6);
        }
        float nl = (float)n.x * (float)toward.x + (float)n.y * (float)toward.y +
                   (float)n.z * (float)toward.z;
        float rv = 0;
        const double nd[3] = {n.x, n.y, n.z}, ld[3] = {toward.x, toward.y, toward.z},
                     vd[3] = {v.x, v.y, v.z};
        for (int c = 0; c < 3; c++) rv += (2 * nl * (float)nd[c] - (float)ld[c]) * (float)vd[c];
        naive_worst = fmax(naive_worst, fabs(powf(rv, 1e6f) - 1));
    }
    print_message("naive float at ns = 1e6: off by %.2f\n", naive_worst);
    assert_true(naive_worst > 0.05); /* the naive formula fails */
}

static void specular_vanishes_behind_the_surface(void **state) {
    (void)state;
    /* N.L = -0.1, and R.V = 1: the naive formula would show a highlight. */
    shd_vec3 toward = {sqrt(1 - 0.01), -0.1, 0}, v = {-sqrt(1 - 0.01), -0.1, 0};
    shd_plan_light light = point_light(toward);
    const double plan = scale_of(1);
    double rv = -(toward.x * v.x) + (2 * -0.1 - toward.y) * v.y;
    assert_true(pow(rv, 10) > 0.8);
    for (size_t k = 0; k < kernel_count; k++) {
        pair got = weigh(&kernels[k], plan, &light, 10, origin, up, v);
        assert_true(got.specular == 0 && got.diffuse == 0);
    }
}

static void shininess_zero_is_one_in_front_and_zero_behind(void **state) {
    (void)state;
    const double plan = scale_of(1);
    shd_plan_light light = point_light(up);
    const shd_vec3 before = {0.6, 0.8, 0}, perpendicular = {1, 0, 0};
    for (size_t k = 0; k < kernel_count; k++) {
        assert_true(weigh(&kernels[k], plan, &light, 0, origin, up, before).specular == 1);
        /* R.V = 0 exactly: 0^0 is 0 here */
        assert_true(weigh(&kernels[k], plan, &light, 0, origin, up, perpendicular).specular == 0);
    }
    assert_true(pow(0, 0) == 1); /* the naive formula */
}

static void light_on_the_surface_point_gives_nothing(void **state) {
    (void)state;
    const double plan = scale_of(1);
    shd_plan_light light = point_light(origin);
    light.a = 0, light.c = 1, light.attenuated = true;
    for (size_t k = 0; k < kernel_count; k++) {
        pair got = weigh(&kernels[k], plan, &light, 10, origin, up, up);
        assert_true(got.diffuse == 0 && got.specular == 0);
    }
}

static void light_at_1e_30_stays_finite_and_has_its_direction(void **state) {
    (void)state;
    const double plan = scale_of(1);
    shd_plan_light light = point_light((shd_vec3){0, 1e-30, 0});
    float naive = 1 / (1e-30f * 1e-30f);
    assert_true(isinf(naive));
    for (size_t k = 0; k < kernel_count; k++) {
        assert_true(weigh(&kernels[k], plan, &light, 10, origin, up, up).diffuse == 1);
        light.a = 0, light.c = 1, light.attenuated = true;
        pair got = weigh(&kernels[k], plan, &light, 10, origin, up, up);
        /* sums of the other tiers are f32, and 1e60 is beyond it */
        assert_true(kernels[k].tier == SHD_EXACT ? fabs(got.diffuse / 1e60 - 1) < 1e-12
                                                 : isinf(got.diffuse) && !isnan(got.specular));
        light.a = 1, light.c = 0, light.attenuated = false;
    }
}

static void min_distance_stops_the_growth(void **state) {
    (void)state;
    const double plan = scale_of(1);
    shd_plan_light light = point_light((shd_vec3){0, 1e-3, 0});
    light.a = 0, light.c = 1, light.attenuated = true, light.min_distance = 0.5;
    for (size_t k = 0; k < kernel_count; k++)
        assert_true(fabs(weigh(&kernels[k], plan, &light, 1, origin, up, up).diffuse - 4) < 1e-6);
}

/* The scene scaled by s, attenuation with it, gives the same weights. */
static void extreme_scales_give_the_same_weights(void **state) {
    (void)state;
    static const double scales[] = {1e-23, 1e-20, 1e-3, 1, 1e3, 1e20};
    shd_vec3 v;
    shd_normalize((shd_vec3){0.3, 1, 0.2}, &v);
    for (size_t k = 0; k < kernel_count; k++) {
        pair first = {0, 0};
        for (size_t i = 0; i < sizeof scales / sizeof scales[0]; i++) {
            double s = scales[i];
            const double plan = scale_of(s);
            shd_plan_light light = point_light((shd_vec3){-0.5 * s, 2 * s, 0.1 * s});
            light.attenuated = true;
            light.a = 0.25, light.b = 0.5 / s, light.c = 1 / (s * s);
            shd_vec3 p = {0.25 * s, 0.5 * s, 0};
            pair got = weigh(&kernels[k], plan, &light, 50, p, up, v);
            if (!i) first = got;
            assert_true(got.diffuse > 0.1);
            assert_true(fabs(got.diffuse - first.diffuse) < 1e-6);
            assert_true(fabs(got.specular - first.specular) < 1e-6);
        }
    }
    float far = 1e20f;
    assert_true(isinf(far * far)); /* the naive formula's d^2 */
}

/* A spot from (0,0,h) down on a plane: points on either side of the edge by 1e-4 of its radius. */
static void narrow_spots_know_their_edge(void **state) {
    (void)state;
    static const double degrees[] = {1, 0.1, 0.01};
    for (size_t i = 0; i < 3; i++) {
        double angle = degrees[i] * SHD_PI / 180, height = 10;
        const double plan = scale_of(height);
        shd_plan_light light = point_light((shd_vec3){0, height, 0});
        light.spot = true;
        light.axis = (shd_vec3){0, -1, 0};
        light.outer = light.inner = 2 * sin(angle / 2) * sin(angle / 2);
        int naive_wrong = 0;
        for (int step = 0; step < 360; step++) {
            double around = step * SHD_PI / 180, radius = height * tan(angle);
            for (int side = -1; side <= 1; side += 2) {
                double r = radius * (1 + side * 1e-4);
                shd_vec3 p = {r * cos(around), 0, r * sin(around)};
                bool inside = side < 0;
                for (size_t k = 0; k < kernel_count; k++) {
                    pair got = weigh(&kernels[k], plan, &light, 1, p, up, up);
                    assert_true((got.diffuse > 0) == inside);
                }
                float x = (float)p.x, z = (float)p.z, h = (float)height;
                float cosine = h / sqrtf(x * x + h * h + z * z);
                naive_wrong += (cosine >= cosf((float)angle)) != inside;
            }
        }
        print_message("spot of %g degrees: naive float is wrong in %.1f %%\n", degrees[i],
                      naive_wrong / 7.2);
        assert_true(degrees[i] > 0.5 || naive_wrong > 0);
    }
}

static void equal_cones_are_a_hard_edge(void **state) {
    (void)state;
    const double plan = scale_of(1);
    shd_plan_light light = point_light(up);
    light.spot = true;
    light.axis = (shd_vec3){0, -1, 0};
    double angle = SHD_PI / 6;
    light.outer = light.inner = 2 * sin(angle / 2) * sin(angle / 2);
    for (size_t k = 0; k < kernel_count; k++) {
        shd_vec3 in = {0.99 * tan(angle), 0, 0}, out = {1.01 * tan(angle), 0, 0};
        double cosine = 1 / sqrt(1 + in.x * in.x);
        assert_true(fabs(weigh(&kernels[k], plan, &light, 1, in, up, up).diffuse - cosine) < 1e-6);
        assert_true(weigh(&kernels[k], plan, &light, 1, out, up, up).diffuse == 0);
    }
}

/* smoothstep(cos outer, cos inner, cos t) (cos t)^exponent, from cosines in f64 */
static void soft_spots_follow_smoothstep(void **state) {
    (void)state;
    const double plan = scale_of(1);
    shd_plan_light light = point_light(up);
    light.spot = true;
    light.axis = (shd_vec3){0, -1, 0};
    light.exponent = 8;
    double outer = 0.6, inner = 0.3;
    light.outer = 1 - cos(outer);
    light.inner = 1 - cos(inner);
    for (double t = 0.01; t < 0.8; t += 0.01) {
        double x = (cos(t) - cos(outer)) / (cos(inner) - cos(outer));
        x = fmin(fmax(x, 0), 1);
        double wanted = x * x * (3 - 2 * x) * pow(cos(t), 8) * cos(t);
        shd_vec3 p = {tan(t), 0, 0};
        for (size_t k = 0; k < kernel_count; k++) {
            double got = weigh(&kernels[k], plan, &light, 1, p, up, up).diffuse;
            assert_true(fabs(got - wanted) < (kernels[k].tier == SHD_EXACT ? 1e-12 : 2e-6));
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tiers_keep_the_errors_of_the_table),
        cmocka_unit_test(specular_at_the_mirror_direction_is_one),
        cmocka_unit_test(specular_vanishes_behind_the_surface),
        cmocka_unit_test(shininess_zero_is_one_in_front_and_zero_behind),
        cmocka_unit_test(light_on_the_surface_point_gives_nothing),
        cmocka_unit_test(light_at_1e_30_stays_finite_and_has_its_direction),
        cmocka_unit_test(min_distance_stops_the_growth),
        cmocka_unit_test(extreme_scales_give_the_same_weights),
        cmocka_unit_test(narrow_spots_know_their_edge),
        cmocka_unit_test(equal_cones_are_a_hard_edge),
        cmocka_unit_test(soft_spots_follow_smoothstep),
    };
    return cmocka_run_group_tests(tests, list_kernels, NULL);
}
