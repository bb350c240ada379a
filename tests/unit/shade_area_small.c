/* Whole shapes by few points (shade/area_cells.h), where rules change and lobes are steep. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "unit/area_support.h"

/* The size at which a shape is off by so much as a point: shade/area.c. */
static double size_of(double off, double exponent) {
    return sqrt(off / (exponent + 1 + 4 * sqrt(exponent) + 12));
}

/* A light around `distance` 2 that no horizon cuts, some lobe widths beside the mirrored view. */
static void check_case(shd_light_type type, double size, double exponent, double *worst) {
    const shd_vec3 to = random_unit();
    shd_vec3 facing = random_unit(), aside = facing;
    if (shd_dot(facing, to) > 0) facing = shd_scale(facing, -1);
    shd_light light = shape_light(type, shd_scale(to, 2), facing);
    const double turn = SHD_PI / 2 * uniform(), extent = 2 * size;
    light.radius = extent;
    light.size[0] = 2 * extent * cos(turn);
    light.size[1] = 2 * extent * sin(turn);
    shd_normalize(shd_cross(to, random_unit()), &aside);
    const double most = fmin(1.2, size + 4 / sqrt(exponent + 1)), angle = most * uniform();
    shd_surface at = surface_at((shd_vec3){0, 0, 0}, shd_madd(to, random_unit(), 0.5), to, NULL);
    at.mirror = shd_madd(shd_scale(to, cos(angle)), aside, sin(angle));
    const weighed found = weigh_shape(&light, at, exponent);
    const problem lobe = {&light, at, (real)exponent}, diffuse = {&light, at, -1};
    const bool sphere = type == SHD_LIGHT_SPHERE;
    const double wanted = sphere ? integrate_sphere(&lobe, 2) : integrate_flat(&lobe, 2),
                 even = sphere ? integrate_sphere(&diffuse, 1) : integrate_flat(&diffuse, 1);
    *worst = fmax(*worst, 4 * fabs(found.lobe - wanted));
    if (4 * fabs(found.lobe - wanted) > 1e-9)
        print_message("%s of %g, n %g: %.12g, wanted %.12g\n", shd_light_names[type], size,
                      exponent, found.lobe, wanted);
    assert_true(4 * fabs(found.diffuse - even) < 1e-9);
}

/* The most that such a light adds is 1/4. */
static void few_points_are_within_a_billionth(void **state) {
    (void)state;
    static const double offs[] = {1.4e-9, 1e-6, 1.3e-4, 1.6e-4, 0.0088, 0.0092, 0.049,
                                  0.054,  0.06, 0.22,   0.24,   0.39,   0.49,   0.52},
                        powers[] = {1, 2, 7.5, 50, 1000, 1024.5, 1e6};
    static const shd_light_type types[] = {SHD_LIGHT_RECT, SHD_LIGHT_DISC, SHD_LIGHT_SPHERE};
    srand(12);
    for (size_t t = 0; t < 3; t++) {
        double worst = 0;
        for (size_t i = 0; i < sizeof offs / sizeof *offs; i++)
            for (size_t k = 0; k < sizeof powers / sizeof *powers; k++)
                for (int n = 0; n < 3; n++)
                    check_case(types[t], size_of(offs[i], powers[k]), powers[k], &worst);
        print_message("%s: %.1e\n", shd_light_names[types[t]], worst);
        assert_true(worst < 1e-9);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(few_points_are_within_a_billionth),
    };
    return cmocka_run_group_tests(tests, make_nodes, NULL);
}
