/* Environments against sums over all texels of the same map, cut into smaller and smaller ones. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>

#include <cmocka.h>

#include "plan/tier.h"
#include "shade/environment.h"
#include "shade/prefilter.h"

static double uniform(void) {
    static uint64_t random = 5;
    random = random * 6364136223846793005u + 1442695040888963407u;
    return (double)(random >> 11) * 0x1p-53;
}

static shd_vec3 direction(double down, double turn) {
    return (shd_vec3){-sin(down) * sin(turn), cos(down), sin(down) * cos(turn)};
}

static shd_vec3 any_direction(void) {
    return direction(acos(1 - 2 * uniform()), 2 * SHD_PI * uniform());
}

/* A normal whose horizon is `height` away from w, to the side `turn`. */
static shd_vec3 lean(shd_vec3 w, double height, double turn) {
    shd_vec3 a = {1, 0, 0};
    shd_normalize(shd_cross(fabs(w.x) < 0.5 ? (shd_vec3){1, 0, 0} : (shd_vec3){0, 1, 0}, w), &a);
    const shd_vec3 b = shd_cross(w, a);
    return shd_madd(shd_madd(shd_scale(w, sin(height)), a, cos(height) * cos(turn)), b,
                    cos(height) * sin(turn));
}

/* Each texel as cut x cut lights from their middles. */
static void brute_force(const shd_surroundings *map, double n, shd_vec3 w, shd_vec3 normal, int cut,
                        double out[3]) {
    const int high = map->height * cut, wide = map->width * cut;
    out[0] = out[1] = out[2] = 0;
    for (int j = 0; j < high; j++) {
        const double angle = (cos(SHD_PI * j / high) - cos(SHD_PI * (j + 1) / high)) * 2 / wide;
        for (int i = 0; i < wide; i++) {
            const shd_vec3 l = direction(SHD_PI * (j + 0.5) / high, 2 * SHD_PI * (i + 0.5) / wide);
            const double x = shd_dot(l, w);
            double rgb[3];
            if (!(x > 0) || !(shd_dot(l, normal) > 0)) continue;
            const double by = pow(x, n) * angle;
            if (by < 1e-14) continue;
            shd_surroundings_at(map, l, rgb);
            for (int c = 0; c < 3; c++) out[c] += by * rgb[c];
        }
    }
}

static double differ(const double a[3], const double b[3]) {
    return fmax(fabs(a[0] - b[0]), fmax(fabs(a[1] - b[1]), fabs(a[2] - b[2])));
}

/* Cells on the horizon make brute force err by about their width, so that its own change tells how
 * far off it may be. */
static void integrals_are_as_all_texels(void **state) {
    (void)state;
    static const struct {
        const char *map;
        double n, height;
    } cases[] = {{"studio", 1, SHD_PI / 2}, {"sky", 1, SHD_PI / 2}, {"studio", 30, 0.1},
                 {"sky", 7.5, 0.4},         {"studio", 0, -0.3},    {"sky", 900, 0.02}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const shd_surroundings *map = shd_surroundings_find(cases[k].map);
        const double n = cases[k].n, most = shd_surroundings_most(map, n);
        const shd_vec3 w = any_direction(), normal = lean(w, cases[k].height, 1.3 * (double)k);
        double found[3], coarse[3], fine[3];
        shd_environment_integrate(map, n, w, normal, found);
        brute_force(map, n, w, normal, n > 100 ? 5 : 1, coarse);
        brute_force(map, n, w, normal, n > 100 ? 10 : 3, fine);
        const double off = differ(found, fine), itself = differ(coarse, fine);
        print_message("%s n %g: off %.1e of %.3g, brute force itself %.1e\n", cases[k].map, n, off,
                      most, itself);
        assert_true(off <= SHD_ENVIRONMENT_TOLERANCE * most / 2 + itself / 2);
    }
}

/* The sun on the horizon, where light changes most by where that lies. */
static void a_sun_that_sets_is_as_all_texels(void **state) {
    (void)state;
    const shd_surroundings *map = shd_surroundings_find("sky");
    const double high = 40 * SHD_PI / 180;
    const shd_vec3 sun = {cos(high) * 0.6, sin(high), cos(high) * 0.8};
    for (int k = 0; k < 4; k++) {
        const double n = k % 2 ? 40 : 6, most = shd_surroundings_most(map, n);
        const shd_vec3 w = lean(sun, SHD_PI / 2 - 0.1 * k, k),
                       normal = lean(sun, 0.02 * k - 0.03, k);
        double found[3], fine[3];
        shd_environment_integrate(map, n, w, normal, found);
        brute_force(map, n, w, normal, 6, fine);
        print_message("sun n %g: off %.1e of %.3g\n", n, differ(found, fine), most);
        assert_true(differ(found, fine) <= 2e-3 * most);
    }
}

/* An even map of 1, whose integrals are closed forms. */
static void an_even_map_gives_closed_forms(void **state) {
    (void)state;
    static float texels[3 * 64 * 32];
    for (size_t i = 0; i < sizeof texels / sizeof *texels; i++) texels[i] = 1;
    const shd_surroundings map = {
        .name = "even", .width = 64, .height = 32, .texels = texels, .most = 1};
    static const shd_vec3 poles[] = {{0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {0, 0, -1}};
    for (int k = 0; k < 12; k++) {
        const shd_vec3 w = k < 4 ? poles[k] : any_direction();
        double found[3];
        shd_environment_integrate(&map, 1, w, w, found);
        assert_true(fabs(found[1] - 1) < 1e-6);
        for (double n = 0; n < 5000; n = 3 * n + 0.75) {
            const shd_vec3 edge = lean(w, 0, k);
            shd_environment_integrate(&map, n, w, w, found);
            /* The end of a lobe of a low exponent is no polynomial, and these texels are large. */
            assert_true(fabs(found[0] * (n + 1) / 2 - 1) < (n < 3 ? 2e-3 : 2e-5));
            /* The horizon goes through W: a half is seen. */
            shd_environment_integrate(&map, n, w, edge, found);
            assert_true(fabs(found[2] * (n + 1) - 1) < (n < 3 ? 2e-3 : 2e-4));
            if (n < 0.5) continue; /* the edge of n = 0 is on the other horizon */
            shd_environment_integrate(&map, n, w, shd_scale(w, -1), found);
            assert_true(found[0] >= 0 && found[0] < 1e-9);
        }
    }
}

static shd_prefilter *make_table(const shd_surroundings *map, double n, bool lobe) {
    void *scratch = aligned_alloc(64, (shd_prefilter_scratch(n) + 63) / 64 * 64);
    shd_prefilter *table = aligned_alloc(64, shd_prefilter_size(n, lobe));
    assert_true(scratch && table);
    assert_true(shd_prefilter_make(map, n, lobe, NULL, scratch, table));
    free(scratch);
    return table;
}

static void tables_keep_their_bounds(void **state) {
    (void)state;
    static const struct {
        const char *map;
        double n;
    } cases[] = {{"studio", 1}, {"sky", 1}, {"studio", 24}, {"sky", 60.5}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        const shd_surroundings *map = shd_surroundings_find(cases[k].map);
        const double n = cases[k].n;
        const bool lobe = n > 1;
        shd_prefilter *table = make_table(map, n, lobe);
        const shd_vec3 sun = {cos(0.698) * 0.6, sin(0.698), cos(0.698) * 0.8},
                       box = direction(0.7, 0.84), lamp = k % 2 ? sun : box;
        double worst = 0;
        for (int i = 0; i < 60; i++) {
            /* Some on the seam and at the poles, and horizons near and far from the lobe. */
            const shd_vec3 aside = lean(lamp, SHD_PI / 2 - uniform() / sqrt(n), 7 * uniform()),
                           w = i < 10 ? direction(i % 2 ? SHD_PI * (i - 1) / 8 : 1e-4 * i,
                                                  i % 3 ? 1e-9 * (i - 5) : SHD_PI)
                               : i % 3 ? any_direction()
                                       : aside;
            shd_vec3 normal = lean(w, 3 * (uniform() - 0.4) / sqrt(n), 7 * uniform());
            /* And some through the sun, or a lamp. */
            if (i % 3 == 0) normal = lean(lamp, 0.1 * (uniform() - 0.5), 7 * uniform());
            double found[3], exact[3];
            shd_prefilter_weigh(table, w, lobe ? &normal : NULL, found);
            shd_environment_integrate(map, n, w, lobe ? normal : w, exact);
            worst = fmax(worst, differ(found, exact));
        }
        const double told = table->error + table->cut_error;
        print_message("%s n %g: off %.1e, told %.1e\n", cases[k].map, n, worst, told);
        assert_true(worst <= told);
        assert_true(told < 0.02 * shd_surroundings_most(map, n));
        free(table);
    }
}

/* Maps on which a table is as far off as can be, at horizons through what is bright in them. */
static void tables_of_hostile_maps_keep_their_bounds(void **state) {
    (void)state;
    enum { H = 64, W = 2 * H };
    static float texels[3 * W * H];
    static const double exponents[] = {5, 24, 5, 70};
    for (int kind = 0; kind < 4; kind++) {
        const double n = exponents[kind];
        for (int j = 0; j < H; j++)
            for (int i = 0; i < W; i++) {
                const bool sun = i == W / 3 && j == H / 3, stars = j == H / 2 && i % 2,
                           squares = (i / 3 + j / 3) % 2,
                           bright = kind < 2    ? sun
                                    : kind == 2 ? stars
                                                : squares;
                for (int c = 0; c < 3; c++)
                    texels[3 * (j * W + i) + c] = bright ? (kind < 3 ? 1e4F : 1) : 0.05F * (float)c;
            }
        shd_surroundings map = {.name = "a", .key = "a", .width = W, .height = H, .texels = texels};
        assert_true(shd_surroundings_measure(&map, true, NULL));
        shd_prefilter *table = make_table(&map, n, true);
        double worst = 0, cut = 0;
        for (int i = 0; i < 120; i++) {
            const double row = kind < 2    ? H / 3.0
                               : kind == 2 ? H / 2.0
                                           : 1 + (H - 2) * uniform(),
                         column = kind < 2 ? W / 3 : W * uniform();
            const shd_vec3 spot = direction(SHD_PI * (row + 0.2 + 0.6 * uniform()) / H,
                                            2 * SHD_PI * (column + 0.2 + 0.6 * uniform()) / W),
                           w = lean(spot, SHD_PI / 2 - 1.5 * uniform() / sqrt(n), 7 * uniform()),
                           normal = lean(spot, 1.5 * SHD_PI / H * (uniform() - 0.5), 7 * uniform());
            double found[3], exact[3];
            shd_prefilter_weigh(table, w, NULL, found);
            shd_environment_integrate(&map, n, w, w, exact);
            worst = fmax(worst, differ(found, exact));
            shd_prefilter_cut(table, w, normal, found);
            shd_environment_integrate(&map, n, w, shd_scale(normal, -1), exact);
            cut = fmax(cut, differ(found, exact));
        }
        print_message("hostile map %d n %g: off %.2g of what is told, and of the cut %.2g\n", kind,
                      n, worst / table->error, cut / table->cut_error);
        assert_true(worst <= table->error && cut <= table->cut_error);
        assert_true(table->error + table->cut_error < 0.02 * shd_surroundings_most(&map, n));
        free(table);
    }
}

/* No direction gets more than what bounds count on, and not much less at the brightest. */
static void the_most_is_no_less_than_any(void **state) {
    (void)state;
    for (int k = 0; shd_surroundings_names[k]; k++) {
        const shd_surroundings *map = shd_surroundings_find(shd_surroundings_names[k]);
        for (double n = 0; n < 3000; n = 4 * n + 1) {
            const double most = shd_surroundings_most(map, n);
            for (int i = 0; i < 8; i++) {
                const shd_vec3 w = any_direction();
                double found[3];
                shd_environment_integrate(map, n, w, w, found);
                for (int c = 0; c < 3; c++) assert_true(found[c] >= 0 && found[c] <= most);
            }
        }
    }
    assert_null(shd_surroundings_find("nowhere"));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(integrals_are_as_all_texels),
        cmocka_unit_test(a_sun_that_sets_is_as_all_texels),
        cmocka_unit_test(an_even_map_gives_closed_forms),
        cmocka_unit_test(tables_keep_their_bounds),
        cmocka_unit_test(tables_of_hostile_maps_keep_their_bounds),
        cmocka_unit_test(the_most_is_no_less_than_any),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
