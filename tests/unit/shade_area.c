/* Lights with a shape against integrals over all of the shape. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "unit/area_support.h"

/* Random shapes near a surface, most of them cut by its horizon or the lobe's. */
static void check_flat(shd_light_type type, double tolerance) {
    srand(4);
    double worst_diffuse = 0, worst_lobe = 0;
    for (int i = 0; i < 60; i++) {
        const shd_vec3 far = shd_scale(random_unit(), 0.6 + 2 * uniform());
        shd_light light = shape_light(type, far, shd_add(shd_scale(far, -1), random_unit()));
        const shd_surface at = surface_at(
            (shd_vec3){0, 0, 0}, shd_add(shd_scale(far, 0.3), random_unit()), random_unit(), NULL);
        const double exponent = exponents[i % (int)(sizeof exponents / sizeof *exponents)];
        const int parts = exponent > 50 ? 10 : 6;
        const weighed found = weigh_shape(&light, at, exponent);
        const double diffuse = integrate_flat(&(problem){&light, at, -1}, parts),
                     lobe = integrate_flat(&(problem){&light, at, (real)exponent}, parts);
        worst_diffuse = fmax(worst_diffuse, fabs(found.diffuse - diffuse));
        worst_lobe = fmax(worst_lobe, fabs(found.lobe - lobe));
        if (fabs(found.lobe - lobe) > fmax(tolerance, found.error))
            print_message("case %d n %g: %.12g, wanted %.12g, told %.1e\n", i, exponent, found.lobe,
                          lobe, found.error);
    }
    print_message("%s: diffuse %.1e, lobes %.1e\n", shd_light_names[type], worst_diffuse,
                  worst_lobe);
    assert_true(worst_diffuse < 1e-12);
    assert_true(worst_lobe < tolerance);
}

static void rectangles_are_as_their_integrals(void **state) {
    (void)state;
    check_flat(SHD_LIGHT_RECT, 1e-9);
}

static void discs_are_as_their_integrals(void **state) {
    (void)state;
    check_flat(SHD_LIGHT_DISC, 1e-9);
}

static void spheres_are_as_their_integrals(void **state) {
    (void)state;
    srand(5);
    double worst_diffuse = 0, worst_lobe = 0;
    for (int i = 0; i < 60; i++) {
        shd_light light = shape_light(SHD_LIGHT_SPHERE, shd_scale(random_unit(), 2), random_unit());
        light.radius = 0.1 + 1.3 * uniform(); /* at most 44 degrees */
        const shd_surface at =
            surface_at((shd_vec3){0, 0, 0}, shd_madd(light.position, random_unit(), 0.6),
                       shd_madd(light.position, random_unit(), 0.3), NULL);
        const double exponent = exponents[i % (int)(sizeof exponents / sizeof *exponents)];
        const weighed found = weigh_shape(&light, at, exponent);
        /* Both horizons are beside the light, or the reference does not hold. */
        const double angle = asin(light.radius / 2),
                     reach = acos(fmin(1, shd_dot(at.normal, shd_scale(light.position, 0.5))));
        const double bend =
            acos(fmax(-1, fmin(1, shd_dot(at.mirror, shd_scale(light.position, 0.5)))));
        if (angle + reach > SHD_PI / 2 || angle + bend > SHD_PI / 2) continue;
        worst_diffuse = fmax(worst_diffuse,
                             fabs(found.diffuse - integrate_sphere(&(problem){&light, at, -1}, 4)));
        const double lobe = integrate_sphere(&(problem){&light, at, (real)exponent}, 8);
        worst_lobe = fmax(worst_lobe, fabs(found.lobe - lobe));
        assert_true(fabs(found.lobe - lobe) <= found.error + 1e-12);
    }
    print_message("sphere: diffuse %.1e, lobes %.1e\n", worst_diffuse, worst_lobe);
    assert_true(worst_diffuse < 1e-12);
    assert_true(worst_lobe < 1e-9);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(rectangles_are_as_their_integrals),
        cmocka_unit_test(discs_are_as_their_integrals),
        cmocka_unit_test(spheres_are_as_their_integrals),
    };
    return cmocka_run_group_tests(tests, make_nodes, NULL);
}
