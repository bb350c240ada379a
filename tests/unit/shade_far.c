/* Light of far lights by one polynomial, against the lights themselves. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "far_support.h"

/* Fills rows with points within `radius` of the origin, some of them on its sphere. */
static void make_points(uint64_t *random, const shd_plan *plan, double radius, shd_vec3 toward,
                        float (*position)[POINTS], float (*normal)[POINTS]) {
    for (int i = 0; i < POINTS; i++) {
        /* The series is farthest off toward the light and away from it. */
        shd_vec3 h = i < 2 ? shd_scale(toward, i ? -1 : 1) : any_direction(random);
        h = shd_scale(h, radius * (i % 2 ? 1 - 1e-6 : uniform(random, 0, 1)) * plan->scale);
        const shd_vec3 n = i < 4 ? toward : any_direction(random);
        const double p[] = {h.x, h.y, h.z}, v[] = {n.x, n.y, n.z};
        for (int c = 0; c < 3; c++) position[c][i] = (float)p[c], normal[c][i] = (float)v[c];
    }
}

static void what_is_left_out_is_bounded(void **state) {
    (void)state;
    uint64_t random = 15;
    double nearest[KINDS] = {0}; /* to the bound */
    for (int round = 0; round < 6000; round++) {
        const int kind = round % KINDS;
        const double distance = pow(10, uniform(&random, -3, 3));
        const double radius =
            distance * (round / KINDS % 2 ? 0.399 : pow(10, uniform(&random, -3, -0.3)));
        const shd_plan plan = {.scale = ldexp(1, -ilogb(radius))};
        const shd_plan_light light = any_light(&random, kind, distance);
        const int degree = degrees[round / KINDS / 2 % DEGREES];
        const double rest = shd_far_rest(&light, distance, radius, degree);
        if (!(rest < INFINITY)) continue;
        shd_far far = {.channels = 1, .degree = degree};
        shd_far_add(&light, &far);
        assert_int_equal(far.lights, 1);
        float position[3][POINTS], normal[3][POINTS], out[3][POINTS] = {{0}};
        const float *p[] = {position[0], position[1], position[2]}, *none[3] = {NULL},
                    *n[] = {normal[0], normal[1], normal[2]};
        float *rows[] = {out[0], out[1], out[2]};
        make_points(&random, &plan, radius, light.toward, position, normal);
        shd_far_kernel_of(SHD_PORTABLE)->light(&plan, &far, POINTS, p, none, n, rows);
        const double whole = light.directional ? 1 : shd_attenuation(&light, distance);
        for (int i = 0; i < POINTS; i++) {
            const shd_vec3 at = {(double)position[0][i] / plan.scale,
                                 (double)position[1][i] / plan.scale,
                                 (double)position[2][i] / plan.scale},
                           up = {(double)normal[0][i], (double)normal[1][i], (double)normal[2][i]};
            const double wanted = shd_dot(field_of(&light, at), up);
            if (!(wanted > 0)) continue; /* not what it is for */
            const double off = fabs((double)out[0][i] - wanted) - 0x1p-24 * wanted;
            if (!(off <= rest * whole * (1 + 1e-6)))
                fail_msg("kind %d at %g, radius %g: %g off, %g told", kind, distance, radius, off,
                         rest * whole);
            if (rest > 1e-5) nearest[kind] = fmax(nearest[kind], off / (rest * whole));
        }
    }
    /* Bounds are no looser than they must be, but where terms of the attenuation are mixed. */
    for (int kind = 1; kind < KINDS; kind++)
        if (!(nearest[kind] > (kind < 4 ? 0.08 : 0.005)))
            fail_msg("kind %d: at most %g of the bound", kind, nearest[kind]);
}

static void lights_add_up_by_their_colors(void **state) {
    (void)state;
    uint64_t random = 3;
    const shd_plan plan = {.scale = 0.5, .origin = {1, 2, 3}};
    shd_far far = {.channels = 3, .degree = 4, .center = {1.1, 2, 3}};
    shd_plan_light lights[40];
    for (int j = 0; j < 40; j++) {
        lights[j] = any_light(&random, j % KINDS, 60);
        lights[j].position.z = fabs(lights[j].position.z);
        lights[j].toward.z = fabs(lights[j].toward.z);
        for (int c = 0; c < 3; c++) lights[j].color[c] = uniform(&random, 0, 1);
        shd_far_add(&lights[j], &far);
    }
    const float x[] = {0.1f, 0}, y[] = {0, 0.2f}, z[] = {0.02f, 0}, low[] = {1e-9f, 0},
                zero[] = {0, 0}, one[] = {1, 1};
    const float *position[] = {x, y, z}, *lows[] = {low, low, low}, *normal[] = {zero, zero, one};
    float out[3][2] = {{1, 2}, {3, 4}, {5, 6}}, *rows[] = {out[0], out[1], out[2]};
    shd_far_kernel_of(SHD_PORTABLE)->light(&plan, &far, 2, position, lows, normal, rows);
    for (int i = 0; i < 2; i++)
        for (int c = 0; c < 3; c++) {
            const shd_vec3 at = {1 + 2 * (double)x[i], 2 + 2 * (double)y[i], 3 + 2 * (double)z[i]};
            double wanted = 1 + i + 2 * c;
            for (int j = 0; j < 40; j++) wanted += lights[j].color[c] * field_of(&lights[j], at).z;
            assert_true(fabs((double)out[c][i] - wanted) < 1e-5 * wanted);
        }
}

/* Kernels look at lights as the plan's own functions do, or are more careful. */
static void kernels_agree_about_lights(void **state) {
    (void)state;
    uint64_t random = 11;
    for (int round = 0; round < 40; round++) {
        shd_arena *arena = shd_arena_new(1 << 20);
        shd_plan_light lights[CROWD];
        make_crowd(&random, 1 + round % (KINDS - 1), (shd_vec3){0, 1, 1.5}, lights);
        for (int j = 1; j < CROWD; j += 2) lights[j].color[2] = 0;
        const shd_plan plan = {.lights = lights, .light_count = CROWD, .scale = 1};
        const shd_bunches *bunches;
        assert_true(shd_bunches_new(&plan, arena, &bunches));
        shd_far_patch patch = {.axis = any_direction(&random),
                               .mirror = any_direction(&random),
                               .radius = uniform(&random, 0, 0.5),
                               .spread = {cos(0.3), sin(0.3)},
                               .glitter = {cos(0.5), sin(0.5)},
                               .diffuse = {1, round & 1 ? 0 : 0.5, 0.2},
                               .lobe_count = 1,
                               .degree = degrees[round / 2 % DEGREES],
                               .shininess = {40},
                               .specular = {{0.1, 0.2, 0.3}}};
        uint32_t places[CROWD];
        shd_far_look looks[SHD_ISA_COUNT][CROWD];
        shd_far_sums sent[SHD_ISA_COUNT];
        shd_far sums[SHD_ISA_COUNT];
        for (uint32_t j = 0; j < CROWD; j++) places[j] = CROWD - 1 - j;
        for (int isa = 0; isa < SHD_ISA_COUNT; isa++) {
            const shd_far_kernel *kernel = shd_far_kernel_of((shd_isa)isa);
            shd_isa same;
            if (!kernel || !shd_isa_find(shd_isa_name((shd_isa)isa), &same)) continue;
            sent[isa] = (shd_far_sums){{0, 0, 0}, 0};
            kernel->look(bunches, &patch, places, CROWD, looks[isa], &sent[isa]);
            sums[isa] = (shd_far){.channels = 3, .degree = patch.degree};
            kernel->add(bunches, places, CROWD, &sums[isa]);
            for (int j = 0; j < CROWD; j++) {
                const shd_far_look *a = &looks[isa][j], *b = &looks[SHD_PORTABLE][j];
                assert_true(a->behind == b->behind && a->certain == b->certain &&
                            a->rest == b->rest && a->told == b->told && a->gleam == b->gleam &&
                            a->most == b->most);
            }
            assert_memory_equal(&sums[isa], &sums[SHD_PORTABLE], sizeof sums[isa]);
            assert_memory_equal(&sent[isa], &sent[SHD_PORTABLE], sizeof sent[isa]);
        }
        shd_far wanted = {.channels = 3, .degree = patch.degree};
        for (int j = 0; j < CROWD; j++) shd_far_add(&lights[j], &wanted);
        for (int c = 0; c < 3; c++)
            for (size_t k = 0; k < shd_monomials_below(patch.degree + 1) - 1; k++)
                assert_true(fabs(wanted.terms[c][k] - sums[0].terms[c][k]) <=
                            1e-9 * (1 + fabs(wanted.terms[c][k])));
        for (int j = 0; j < CROWD; j++) {
            const shd_far_look *l = &looks[0][j];
            const shd_plan_light *light = &lights[bunches->lights[places[j]]];
            const double d = shd_length(light->position),
                         told = shd_far_rest(light, d, patch.radius, patch.degree) *
                                shd_attenuation(light, d);
            /* Points and normals of the patch: none lights up what is behind, and all have at least
             * what is certain. */
            for (int i = 0; i < 8; i++) {
                const shd_vec3 at = shd_scale(any_direction(&random), patch.radius);
                shd_vec3 n = shd_madd(patch.axis, any_direction(&random), sin(0.299));
                if (!shd_normalize(n, &n) || shd_dot(n, patch.axis) < cos(0.3)) continue;
                const shd_vec3 e = field_of(light, at);
                const double shows = shd_dot(e, n);
                if (l->behind) assert_true(shows <= 0);
                if (l->certain > 0) assert_true(shows >= l->certain);
                assert_true(l->behind || shows <= l->most);
                /* What is left out altogether, or sinks below the horizon. */
                if (!l->told) assert_true(l->rest >= light->color[0] * shows);
                if (l->told) assert_true(l->rest >= light->color[0] * -shows);
            }
            if (l->told) assert_true(l->rest >= light->color[0] * told * (1 - 1e-9));
        }
        shd_arena_drop(arena);
    }
}

/* A polynomial about another center tells the same. */
static void what_is_told_can_be_shifted(void **state) {
    (void)state;
    uint64_t random = 3;
    for (int d = 0; d < DEGREES; d++) {
        const int degree = degrees[d];
        const shd_plan plan = {.scale = 1};
        const shd_plan_light light = any_light(&random, 3, 2);
        shd_far from = {.channels = 3, .degree = degree, .center = {0.1, 0.2, -0.3}},
                to = {.channels = 3, .degree = 3, .center = {0.3, -0.1, 0}};
        shd_far_add(&light, &from);
        shd_far_shift(&from, &to);
        assert_int_equal(to.degree, degree);
        assert_int_equal(to.lights, 1);
        float out[2][3] = {{0}};
        const float x = 0.2f, y = 0.1f, z = -0.1f, up = 1, none = 0;
        for (int k = 0; k < 2; k++)
            shd_far_kernel_of(SHD_PORTABLE)
                ->light(&plan, k ? &to : &from, 1, (const float *[]){&x, &y, &z},
                        (const float *[3]){NULL}, (const float *[]){&none, &none, &up},
                        (float *[]){&out[k][0], &out[k][1], &out[k][2]});
        for (int c = 0; c < 3; c++)
            assert_true(fabsf(out[0][c] - out[1][c]) <= 0x1p-22f * out[0][c]);
    }
}

/* Powers and places at the ends of what numbers hold, and channels without light or color: nothing
 * that is not a number, and what is told has a series. */
static void extremes_are_numbers(void **state) {
    (void)state;
    static const double ends[] = {0, 1e-308, 1e-160, 1e-30, 1, 1e30, 1e160, 1e300};
    uint64_t random = 5;
    for (int round = 0; round < 200; round++) {
        shd_arena *arena = shd_arena_new(1 << 20);
        shd_plan_light lights[CROWD];
        make_crowd(&random, 1 + round % (KINDS - 1), (shd_vec3){0, 0, 0}, lights);
        for (int j = 0; j < CROWD; j++) {
            lights[j].position = shd_scale(lights[j].position, ends[(j + round) % 8]);
            lights[j].gain = fmax(ends[j / 8 % 8], 1e-308);
            for (int c = 0; c < 3; c++) lights[j].color[c] = ends[(j * (c + 1) + round / 8) % 8];
        }
        const shd_plan plan = {.lights = lights, .light_count = CROWD, .scale = 1};
        const shd_bunches *bunches;
        assert_true(shd_bunches_new(&plan, arena, &bunches));
        const shd_far_patch patch = {.axis = any_direction(&random),
                                     .mirror = any_direction(&random),
                                     .radius = ends[round % 5],
                                     .spread = {cos(0.3), sin(0.3)},
                                     .glitter = {cos(0.5), sin(0.5)},
                                     .diffuse = {0, round & 1 ? 0 : 1e100, ends[round % 7]},
                                     .lobe_count = 1,
                                     .degree = degrees[round / 2 % DEGREES],
                                     .shininess = {ends[round % 6]},
                                     .specular = {{0, 1, 1e60}}};
        uint32_t places[CROWD];
        for (uint32_t j = 0; j < CROWD; j++) places[j] = j;
        shd_far_look looks[CROWD];
        shd_far_sums sums = {{0, 0, 0}, 0};
        shd_far_kernel_of(SHD_PORTABLE)
            ->look_at_bunches(bunches, &patch, places, bunches->count, looks);
        for (size_t k = 0; k < bunches->count; k++)
            assert_true(looks[k].rest >= 0 && looks[k].certain >= 0 && looks[k].most >= 0);
        shd_far_kernel_of(SHD_PORTABLE)->look(bunches, &patch, places, CROWD, looks, &sums);
        for (int j = 0; j < CROWD; j++) {
            const shd_plan_light *light = &lights[bunches->lights[j]];
            assert_true(looks[j].rest >= 0 && looks[j].gleam >= 0 && looks[j].certain >= 0 &&
                        looks[j].most >= 0);
            if (looks[j].told)
                assert_true(shd_far_rest(light, shd_length(light->position), patch.radius,
                                         patch.degree) < INFINITY);
        }
        shd_arena_drop(arena);
    }
}

static void near_lights_are_refused(void **state) {
    (void)state;
    uint64_t random = 1;
    for (int kind = 1; kind < KINDS; kind++) {
        shd_plan_light light = any_light(&random, kind, 1);
        assert_false(shd_far_rest(&light, 1, 0.5, 4) < INFINITY);
        assert_false(shd_far_rest(&light, 0, 0, 3) < INFINITY);
        light.min_distance = 0.95; /* it bends where light stops growing */
        if (light.attenuated) assert_false(shd_far_rest(&light, 1, 0.1, 4) < INFINITY);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_left_out_is_bounded),
        cmocka_unit_test(lights_add_up_by_their_colors),
        cmocka_unit_test(kernels_agree_about_lights),
        cmocka_unit_test(what_is_told_can_be_shifted),
        cmocka_unit_test(extremes_are_numbers),
        cmocka_unit_test(near_lights_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
