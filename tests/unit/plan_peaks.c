/* What bounds take models for: the most that facets mirror, that a lobe sends from one direction,
 * and that it sends of light from everywhere. */
#include "plan/peaks.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>

#include <cmocka.h>

#include "shade/brdf.h"

typedef struct subject {
    shd_material scene;
    shd_plan_lobe lobe;
    shd_plan_material plan;
} subject;

static void make(subject *s, shd_model model, double sharpness, double n) {
    *s = (subject){.scene = {.model = model, .fresnel = {.n = {n, n, n}}},
                   .lobe = {{1, 1, 1}, sharpness}};
    s->plan =
        (shd_plan_material){.model = model, .lobes = &s->lobe, .lobe_count = 1, .from = &s->scene};
}

static double uniform(double low, double high) {
    return low + (high - low) * rand() / RAND_MAX;
}

static void facets_mirror_no_more_than_is_told(void **state) {
    (void)state;
    srand(3);
    double loosest = 0;
    for (int i = 0; i < 4000; i++) {
        subject s;
        make(&s, SHD_MODEL_COOK_TORRANCE, 1, i % 3 ? 1 + pow(10, uniform(-6, 3)) : uniform(0, 1));
        if (i % 5 == 0) s.scene.fresnel.k[1] = uniform(0, 5);
        const double half = uniform(0, 1), told = shd_mirrored_most(&s.plan, half);
        double most = 0;
        for (int k = 0; k <= 200; k++)
            for (int c = 0; c < 3; c++)
                most = fmax(most, shd_fresnel_reflectance(&s.scene.fresnel, c,
                                                          half + (1 - half) * k / 200));
        assert_true(most <= told && told <= 1);
        if (i % 3 && i % 5) loosest = fmax(loosest, told / most);
    }
    print_message("of what facets mirror, up to %.3g times is told\n", loosest);
    assert_true(loosest < 2); /* only one of both directions may be at its end */
}

/* Of a pattern of f0 the largest index is told. */
static void patterns_mirror_no_more_than_is_told(void **state) {
    (void)state;
    srand(4);
    for (int i = 0; i < 4000; i++) {
        const shd_texture pattern = {.name = NULL};
        const double largest = i % 7 ? 1 + pow(10, uniform(-6, 5)) : INFINITY;
        subject s;
        make(&s, SHD_MODEL_COOK_TORRANCE, 1, largest);
        s.scene.fresnel.f0_texture = &pattern;
        const double half = i % 2 ? uniform(0, 1) : pow(10, uniform(-6, 0)),
                     told = shd_mirrored_most(&s.plan, half);
        for (int k = 0; k <= 60; k++)
            for (int j = 0; j <= 8; j++) {
                const double n = shd_smaller(1 + pow(10, -6 + 0.2 * k), largest);
                const shd_fresnel index = {.n = {n, n, n}};
                assert_true(shd_fresnel_reflectance(&index, 0, half + (1 - half) * j / 8) <= told);
            }
        assert_true(told <= 1);
    }
}

static void no_distribution_exceeds_its_most(void **state) {
    (void)state;
    for (int k = 0; k <= 45; k++) {
        const double roughness = 1e-4 * pow(1.3, k);
        const double square = roughness * roughness, told = shd_facets_most(roughness);
        double most = 0;
        for (int i = 0; i < 100000; i++) {
            const double x = 4 * square * i / 100000;
            most = fmax(most, (1 + x) * (1 + x) * exp(-x / square) / square);
        }
        assert_true(most <= told * (1 + 1e-14) && most > 0.999 * told);
    }
}

/* ---- Light from everywhere. ---- */

static double weigh(const subject *s, shd_vec3 view, shd_vec3 light) {
    const shd_vec3 up = {0, 0, 1};
    double row[SHD_BRDF_ROWS];
    shd_surface at = {.normal = up, .view = view, .material = &s->plan};
    at.mirror = shd_sub(shd_scale(up, 2 * view.z), view);
    return shd_brdf_weigh(&at, light, row) ? row[3] : 0;
}

static shd_vec3 at_angles(double cosine, double turn) {
    const double sine = sqrt((1 - cosine) * (1 + cosine));
    return (shd_vec3){sine * cos(turn), sine * sin(turn), cosine};
}

enum { NODES = 300 };

/* 1 / pi of the integral over all L, by H that are as frequent as facets are, D N.H: dw = 4 V.H
 * dwH.
 */
static double sum_facets(const subject *s, shd_vec3 view) {
    const double square = s->lobe.shininess * s->lobe.shininess;
    double sum = 0;
    for (int i = 0; i < NODES; i++)
        for (int j = 0; j < NODES; j++) {
            const double x = -square * log((i + 0.5) / NODES), cosine = 1 / sqrt(1 + x);
            const shd_vec3 half = at_angles(cosine, 2 * SHD_PI * (j + 0.5) / NODES);
            const double bent = shd_dot(view, half);
            if (!(bent > 0)) continue;
            const shd_vec3 light = shd_sub(shd_scale(half, 2 * bent), view);
            const double d = (1 + x) * (1 + x) * exp(-x / square) / square;
            sum += weigh(s, view, light) * 4 * bent / (d * cosine);
        }
    return sum / (NODES * NODES);
}

/* The same by L that are even in their solid angle. */
static double sum_even(const subject *s, shd_vec3 view) {
    double sum = 0;
    for (int i = 0; i < NODES; i++)
        for (int j = 0; j < NODES; j++)
            sum += weigh(s, view, at_angles((i + 0.5) / NODES, 2 * SHD_PI * (j + 0.5) / NODES));
    return 2 * sum / (NODES * NODES);
}

static void no_lobe_sends_more_than_is_told(void **state) {
    static const double views[] = {1, 0.9, 0.5, 0.2, 0.05, 1e-3};
    static const double slopes[] = {1e-3, 0.05, 0.3, 1, 4}, exponents[] = {0, 0.4, 1, 7, 60};
    static const shd_model models[] = {SHD_MODEL_PHONG, SHD_MODEL_BLINN_PHONG,
                                       SHD_MODEL_PHONG_NORMALIZED, SHD_MODEL_COOK_TORRANCE};
    (void)state;
    for (size_t m = 0; m < 4; m++) {
        const bool facets = models[m] == SHD_MODEL_COOK_TORRANCE;
        double tightest = 0;
        for (int k = 0; k < 5; k++)
            for (int v = 0; v < 6; v++) {
                subject s;
                make(&s, models[m], facets ? slopes[k] : exponents[k], INFINITY);
                const shd_vec3 view = at_angles(views[v], 0.3);
                const double told = shd_peak_of(&s.plan, 1).whole,
                             sum = facets ? sum_facets(&s, view) : sum_even(&s, view);
                if (!(sum <= told * 1.002)) /* what the sum is off by */
                    fail_msg("model %d, %g, view %g: %g, told %g", (int)m, s.lobe.shininess,
                             views[v], sum, told);
                tightest = fmax(tightest, sum / told);
            }
        print_message("model %d: %.3g of what is told\n", (int)m, tightest);
        assert_true(tightest > 0.9);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(facets_mirror_no_more_than_is_told),
        cmocka_unit_test(patterns_mirror_no_more_than_is_told),
        cmocka_unit_test(no_distribution_exceeds_its_most),
        cmocka_unit_test(no_lobe_sends_more_than_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
