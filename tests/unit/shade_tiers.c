/* Kernels and the bounds of their errors mean the same by plan/tier.h: what one of them changes
 * alone is found here. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "bound/light/error.h"
#include "bound/light/misplaced.h"
#include "plan/tier.h"
#include "shade/packed.h"
#include "sight/tie.h"
#include "unit/shade_support.h"

static const double U32 = 0x1p-24;

static const double shininesses[] = {1, 5, 16, 18, 33, 34.5, 40, 100, 1e3, 1e5};
enum { SHININESSES = sizeof shininesses / sizeof shininesses[0] };

static const shd_plan_light overhead = {
    .directional = true, .toward = {0, 0, 1}, .gain = 1, .color = {1, 1, 1}};

/* (R.V)^shininess as the kernel has it, in a point that the light is right above. */
static double power_at(const kernel *k, double shininess, double cosine) {
    static points at;
    static double diffuse[MOST_POINTS], specular[MOST_POINTS];
    const shd_vec3 view = {sqrt((1 - cosine) * (1 + cosine)), 0, cosine};
    at.count = 1;
    set_point(&at, 0, (shd_vec3){0, 0, 0}, (shd_vec3){0, 0, 1}, view);
    weigh_points(k, 1, &overhead, shininess, &at, false, diffuse, specular);
    return specular[0];
}

/* Whether f32 lights it. */
static bool is_narrow(const kernel *k) {
    return k->tier == SHD_STANDARD;
}

static shd_rounding rounding_of(const kernel *k) {
    return shd_rounding_of(k->tier, k->isa);
}

static void lobes_are_cut_where_bounds_count_it(void **state) {
    (void)state;
    kernel kernels[MOST_KERNELS];
    const size_t count = find_kernels(kernels);
    for (size_t k = 1; k < count; k++) /* the reference cuts none */
        for (size_t i = 0; i < SHININESSES; i++) {
            const double shininess = shininesses[i];
            const shd_lobe_error e = shd_lobe_error_of(rounding_of(&kernels[k]), shininess, 1);
            double cut = is_narrow(&kernels[k]) ? e.faint : 0;
            if (!is_narrow(&kernels[k]) && shininess > SHD_EXACT_CUT)
                cut = exp(shininess * log1p(-SHD_EXACT_CUT / shininess));
            for (int side = -1; side <= 1; side += 2) {
                const double power = cut * (1 + 0.01 * side),
                             cosine = cut > 0 ? pow(power, 1 / shininess) : 0.3,
                             seen = power_at(&kernels[k], shininess, cosine);
                if ((seen > 0) != (cut == 0 || side > 0))
                    fail_msg("%s, ns %g: %g at %g, cut at %g", kernels[k].name, shininess, seen,
                             cosine, cut);
            }
        }
    /* What f64 cuts off is less than what its functions err by where bounds end to look. */
    for (size_t i = 0; i < SHININESSES; i++) {
        const shd_lobe_error e = shd_lobe_error_of(SHD_ROUNDS_64, shininesses[i], 1);
        const double least = shd_shine_most(0, 1e3);
        assert_true(exp(-SHD_EXACT_CUT) < shd_lobe_functions(&e, least));
    }
}

/* With more lights, fewer are; their bounds count as many as with one. */
static void lobes_that_are_short_have_the_errors_of_such(void **state) {
    (void)state;
    for (size_t lights = 1; lights <= 10000; lights *= 10)
        for (double shininess = 1; shininess < 100; shininess += 0.25) {
            const shd_scene scene = {.light_count = lights};
            const shd_plan plan = {.scene = &scene};
            const bool is_short = shd_pack_lobe(&plan, shininess).is_short,
                       rough = shd_lobe_error_of(SHD_ROUNDS_FUSED, shininess, lights).rough > 0;
            if (lights == 1 ? is_short != rough : is_short && !rough)
                fail_msg("ns %g, %zu lights: %d, %d", shininess, lights, is_short, rough);
        }
}

static void least_powers_are_counted_as_faint(void **state) {
    (void)state;
    kernel kernels[MOST_KERNELS];
    const size_t count = find_kernels(kernels);
    for (size_t k = 1; k < count; k++) {
        const shd_lobe_error e = shd_lobe_error_of(rounding_of(&kernels[k]), 16, 1);
        const double seen = power_at(&kernels[k], 16, 0x1p-20);
        if (!(seen <= shd_lobe_faint(&e, 0))) fail_msg("%s: %g", kernels[k].name, seen);
        if (is_narrow(&kernels[k])) assert_true(seen > 0);
    }
}

static void attenuation_is_held_at_one_value(void **state) {
    (void)state;
    const shd_vec3 up = {0, 0, 1}, at = {0, 0, 0};
    const shd_plan_light light = {
        .position = {0, 0, 1e-160}, .attenuated = true, .c = 1, .gain = 1, .color = {1, 1, 1}};
    const shd_scene scene = {.light_count = 1};
    const shd_piece piece = {.axis = up, .spread = {1, 0}, .mirror = up, .glitter = {1, 0}};
    double factor, off;
    shd_lit lit;
    shd_weigh_light(&light, at, up, up, &factor, &off);
    assert_true(shd_piece_lit(&scene, &piece, &light, 0, &lit));
    assert_true(lit.fall_high >= factor && lit.fall_high <= factor * (1 + 1e-5));
}

static void rims_are_wider_than_directions_are_off(void **state) {
    (void)state;
    const double direction = shd_path_error_of(SHD_ROUNDS_LOOSE, SHD_PATH_ATTENUATED)->direction;
    const shd_scene scene = {.light_count = 1};
    const shd_plan plan = {.scene = &scene, .scale = 1};
    for (double outer = 1e-9; outer <= 2; outer *= 1.5) {
        const shd_plan_light light = {.spot = true,
                                      .axis = {0, 0, -1},
                                      .a = 1,
                                      .gain = 1,
                                      .color = {1, 1, 1},
                                      .outer = outer,
                                      .inner = outer};
        const double off = sqrt(2 * outer) * direction + 4 * U32 * outer;
        assert_true((double)shd_pack_light(&plan, &light).rim >= off);
    }
}

static void colors_count_the_lights_of_a_group(void **state) {
    (void)state;
    const shd_scene scene = {.light_count = 9, .raster = {.samples = 1}};
    const shd_plan plan = {.scene = &scene, .scale = 1, .isa = SHD_AVX2};
    size_t together = 0;
    for (size_t i = 0; i < 9; i++) {
        shd_plan_light light = overhead;
        light.index = i;
        together += shd_pack_light(&plan, &light).group == 1;
    }
    const double more = shd_color_error(&plan, SHD_STANDARD) - shd_color_error(&plan, SHD_EXACT);
    assert_true(more == (double)together * U32);
}

static void sheer_lobes_are_lit_in_f64(void **state) {
    (void)state;
    const kernel standard = {"", false, SHD_STANDARD, SHD_PORTABLE};
    shd_arena *arena = shd_arena_new(1 << 20);
    for (double shininess = 0.05; shininess < 1.5; shininess += 0.05) {
        stage s;
        set_stage(&s, &standard, 1, &overhead, 1, shininess);
        const shd_lighting *lighting = shd_lighting_new(&s.plan, NULL, arena);
        assert_non_null(lighting);
        /* Bounds take such a lobe to be twice as steep, and more. */
        const bool steep = shd_lobe_error_of(SHD_ROUNDS_LOOSE, shininess, 1).slope >= 2;
        if ((lighting->materials[0].sums == lighting->sums64) != steep)
            fail_msg("ns %g", shininess);
    }
    shd_arena_drop(arena);
}

/* Of a disc, right below the eye. */
static void hits_are_off_by_what_counts_as_a_tie(void **state) {
    (void)state;
    const double height = 3;
    shd_material material = {.model = SHD_MODEL_PHONG};
    shd_scene scene = {.camera = {.position = {0, height, 0}, .projection = SHD_PERSPECTIVE},
                       .materials = &material};
    const shd_affine same = {.linear = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    const shd_lens lens = {.camera = &scene.camera};
    const shd_item item = {.shape = SHD_DISC, .to_world = same, .from_world = same};
    const shd_met met = {.ray = {0, -1, 0}, .t = height};
    const shd_vec3 point = {0, 0, 0}, normal = {0, 1, 0};
    const double tie = shd_shape_rounding(&item, &lens, &met, 0, point, normal);

    const shd_object disc = {.shape = SHD_DISC, .radius = 1, .transform = same};
    const shd_plan_object bounds = {.bounded = true, .radius = 1};
    const shd_place place = shd_place_of(&disc, &bounds);
    const shd_misplaced misplaced = shd_misplaced_of(&scene, &place);
    assert_true(tie / (2 * height) == misplaced.moved / misplaced.span);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lobes_are_cut_where_bounds_count_it),
        cmocka_unit_test(lobes_that_are_short_have_the_errors_of_such),
        cmocka_unit_test(least_powers_are_counted_as_faint),
        cmocka_unit_test(attenuation_is_held_at_one_value),
        cmocka_unit_test(rims_are_wider_than_directions_are_off),
        cmocka_unit_test(colors_count_the_lights_of_a_group),
        cmocka_unit_test(sheer_lobes_are_lit_in_f64),
        cmocka_unit_test(hits_are_off_by_what_counts_as_a_tie)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
