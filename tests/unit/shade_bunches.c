/* Light of far lights that lie together: one polynomial of all of them, against the lights
 * themselves.
 */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "far_support.h"

/* Adds a bunch by all kernels, which have the same bits. */
static void add_bunch(const shd_bunches *bunches, uint32_t index, shd_far *to) {
    const shd_far before = *to;
    for (int isa = 0; isa < SHD_ISA_COUNT; isa++) {
        shd_isa same;
        if (!shd_isa_find(shd_isa_name((shd_isa)isa), &same)) continue;
        shd_far sum = before;
        shd_far_kernel_of((shd_isa)isa)->add_bunches(bunches, &index, 1, &sum);
        if (isa == SHD_PORTABLE) *to = sum;
        assert_int_equal(sum.lights, to->lights);
        for (int c = 0; c < sum.channels; c++)
            assert_memory_equal(sum.terms[c], to->terms[c], sizeof sum.terms[c]);
    }
}

/* Moments that parts' are made of are those of all lights, in every tree. */
static void moments_are_sums_over_lights(void **state) {
    (void)state;
    uint64_t random = 23;
    for (int round = 0; round < 6; round++) {
        shd_arena *arena = shd_arena_new(1 << 20);
        shd_plan_light lights[CROWD];
        make_crowd(&random, 3, (shd_vec3){round, -20, 5}, lights);
        const bool grey = round % 2;
        for (int j = 0; j < CROWD; j++)
            if (grey) lights[j].color[1] = lights[j].color[2] = lights[j].color[0];
        const shd_plan plan = {
            .lights = lights, .light_count = CROWD, .scale = 1, .grey_lights = grey};
        const shd_bunches *bunches;
        assert_true(shd_bunches_new(&plan, arena, &bunches));
        assert_true(bunches->count > bunches->roots);
        for (size_t i = 0; i < bunches->count; i++) {
            const shd_bunch *bunch = &bunches->list[i];
            for (int c = 0; c < (grey ? 1 : 3); c++) {
                double wanted[SHD_BUNCH_MOMENTS] = {0};
                for (uint32_t k = bunch->first; k < bunch->end; k++) {
                    const shd_plan_light *l = &lights[bunches->lights[k]];
                    const double weight = l->color[c] * l->gain / bunches->falls[bunch->fall].gain;
                    double m[SHD_BUNCH_MOMENTS];
                    shd_moments(shd_sub(bunch->center, l->position), m);
                    for (int t = 0; t < SHD_BUNCH_MOMENTS; t++) wanted[t] += weight * m[t];
                }
                /* Lights are within 1 of each other, some 20 from the origin. */
                for (int t = 0; t < SHD_BUNCH_MOMENTS; t++)
                    assert_true(fabs(bunch->moments[c][t] - wanted[t]) <=
                                1e-13 * bunch->strength[c]);
            }
        }
        shd_arena_drop(arena);
    }
}

/* Parts are halves along the row of lights, which is listed such that whatever is in the middle of
 * what a selection has left is the first of it. */
static void lights_are_halved_in_any_order(void **state) {
    (void)state;
    enum { COUNT = 400 };
    shd_arena *arena = shd_arena_new(1 << 20);
    shd_plan_light lights[COUNT];
    int order[COUNT];
    for (int i = 0; i < COUNT; i++) order[i] = i;
    for (int low = 0; low < COUNT; low++) {
        const int middle = low + (COUNT - 1 - low) / 2, first = order[middle];
        order[middle] = order[low];
        order[low] = first;
        lights[first] = (shd_plan_light){
            .position = {low, 0, 9}, .color = {1, 1, 1}, .gain = 1, .attenuated = true, .c = 1};
    }
    const shd_plan plan = {.lights = lights, .light_count = COUNT, .scale = 1, .grey_lights = true};
    const shd_bunches *bunches;
    assert_true(shd_bunches_new(&plan, arena, &bunches));
    assert_int_equal(bunches->roots, 1);
    for (size_t i = 0; i < bunches->count; i++) {
        const shd_bunch *bunch = &bunches->list[i];
        if (!bunch->parts) continue;
        const uint32_t middle = bunches->list[bunch->parts].end;
        assert_int_equal(middle, bunch->first + (bunch->end - bunch->first) / 2);
        double before = -1, behind = COUNT;
        for (uint32_t k = bunch->first; k < bunch->end; k++) {
            const double x = lights[bunches->lights[k]].position.x;
            if (k < middle)
                before = fmax(before, x);
            else
                behind = fmin(behind, x);
        }
        assert_true(before < behind);
    }
    shd_arena_drop(arena);
}

/* A bunch's polynomial is that of all of its lights, to within what is told for their middle. */
static void bunches_are_their_lights_together(void **state) {
    (void)state;
    uint64_t random = 7;
    double nearest = 0;
    for (int round = 0; round < 60; round++) {
        shd_arena *arena = shd_arena_new(1 << 20);
        shd_plan_light lights[CROWD];
        const double distance = uniform(&random, 4, 40), radius = 0.35 * distance - 1;
        make_crowd(&random, 1 + round % (KINDS - 1), (shd_vec3){0, 0, distance}, lights);
        const shd_plan plan = {
            .lights = lights, .light_count = CROWD, .scale = 1, .drop_tolerance = 1};
        const shd_bunches *bunches;
        assert_true(shd_bunches_new(&plan, arena, &bunches));
        assert_int_equal(bunches->roots, 1);
        const shd_bunch *root = bunches->list;
        const shd_plan_light *fall = &bunches->falls[root->fall];
        shd_plan_light middle = *fall;
        middle.position = root->center;
        const double away = shd_length(root->center),
                     rest = shd_far_rest(&middle, away, radius + root->radius,
                                         degrees[round / 2 % DEGREES]);
        shd_far far = {.channels = 3, .degree = degrees[round / 2 % DEGREES]};
        add_bunch(bunches, 0, &far);
        assert_int_equal(far.lights, CROWD);
        for (int i = 0; rest < INFINITY && i < POINTS; i++) {
            const shd_vec3 at = shd_scale(any_direction(&random), radius * (i % 2 ? 1 : 0.5));
            const float p[] = {(float)at.x, (float)at.y, (float)at.z}, up = 1, none = 0;
            const float *position[] = {p, p + 1, p + 2}, *low[3] = {NULL},
                        *normal[] = {&none, &none, &up};
            float out[3] = {0}, *rows[] = {out, out + 1, out + 2};
            shd_far_kernel_of(SHD_PORTABLE)->light(&plan, &far, 1, position, low, normal, rows);
            for (int c = 0; c < 3; c++) {
                double wanted = 0;
                for (int j = 0; j < CROWD; j++)
                    wanted +=
                        lights[j].color[c] *
                        field_of(&lights[j], (shd_vec3){(double)p[0], (double)p[1], (double)p[2]})
                            .z;
                const double most = rest * shd_attenuation(&middle, away) * root->strength[c];
                const double off = fabs((double)out[c] - wanted);
                if (!(off <= most + 0x1p-23 * wanted))
                    fail_msg("round %d: %g off, %g told", round, off, most);
                nearest = fmax(nearest, off / most);
            }
        }
        shd_arena_drop(arena);
    }
    assert_true(nearest > 1e-3); /* it is not told by far */
}

/* What is told of a bunch holds for all of its lights together, at points and normals of a patch.
 */
static void bunches_are_looked_at_for_all_their_lights(void **state) {
    (void)state;
    uint64_t random = 23;
    size_t told = 0, behind = 0;
    for (int round = 0; round < 120; round++) {
        shd_arena *arena = shd_arena_new(1 << 20);
        shd_plan_light lights[CROWD];
        const shd_vec3 middle =
            shd_scale(any_direction(&random), pow(10, uniform(&random, -1, 1.5)));
        make_crowd(&random, 1 + round % (KINDS - 1), middle, lights);
        const shd_plan plan = {.lights = lights, .light_count = CROWD, .scale = 1};
        const shd_bunches *bunches;
        assert_true(shd_bunches_new(&plan, arena, &bunches));
        const shd_far_patch patch = {.axis = any_direction(&random),
                                     .mirror = {0, 0, 1},
                                     .radius = uniform(&random, 0, 0.5),
                                     .spread = {cos(0.3), sin(0.3)},
                                     .glitter = {-1, 0},
                                     .diffuse = {1, 0.5, 0.2},
                                     .degree = degrees[round / 2 % DEGREES]};
        uint32_t all[CROWD];
        shd_far_look looks[SHD_ISA_COUNT][CROWD];
        assert_true(bunches->count <= CROWD);
        for (uint32_t k = 0; k < bunches->count; k++) all[k] = bunches->count - 1 - k;
        for (int isa = 0; isa < SHD_ISA_COUNT; isa++) {
            shd_isa same;
            if (!shd_isa_find(shd_isa_name((shd_isa)isa), &same)) continue;
            shd_far_kernel_of((shd_isa)isa)
                ->look_at_bunches(bunches, &patch, all, bunches->count, looks[isa]);
            for (size_t k = 0; k < bunches->count; k++) {
                const shd_far_look *a = &looks[isa][k], *b = &looks[SHD_PORTABLE][k];
                assert_true(a->behind == b->behind && a->certain == b->certain &&
                            a->rest == b->rest && a->told == b->told && a->most == b->most);
            }
        }
        for (size_t k = 0; k < bunches->count; k++) {
            const shd_far_look *l = &looks[SHD_PORTABLE][k];
            const shd_bunch *bunch = &bunches->list[all[k]];
            shd_far far = {.channels = 3, .degree = patch.degree};
            if (l->told) add_bunch(bunches, all[k], &far);
            told += l->told;
            behind += l->behind;
            for (int i = 0; i < 8; i++) {
                const shd_vec3 at = shd_scale(any_direction(&random), patch.radius * (1 - 1e-6));
                shd_vec3 n = shd_madd(patch.axis, any_direction(&random), sin(0.299));
                if (!shd_normalize(n, &n) || shd_dot(n, patch.axis) < cos(0.3)) continue;
                const float p[] = {(float)at.x, (float)at.y, (float)at.z},
                            up[] = {(float)n.x, (float)n.y, (float)n.z};
                double shows = 0;
                for (uint32_t j = bunch->first; j < bunch->end; j++) {
                    const shd_plan_light *light = &lights[bunches->lights[j]];
                    const shd_vec3 e =
                        field_of(light, (shd_vec3){(double)p[0], (double)p[1], (double)p[2]});
                    shows +=
                        light->color[0] *
                        fmax(shd_dot(e, (shd_vec3){(double)up[0], (double)up[1], (double)up[2]}),
                             0);
                }
                assert_true(!l->behind || shows <= 0);
                assert_true(l->behind || shows <= l->most * bunch->strength[0]);
                assert_true(shows >= l->certain * bunch->strength[0]);
                float out[3] = {0}, *rows[] = {out, out + 1, out + 2};
                if (l->told)
                    shd_far_kernel_of(SHD_PORTABLE)
                        ->light(&plan, &far, 1, (const float *[]){p, p + 1, p + 2},
                                (const float *[3]){NULL}, (const float *[]){up, up + 1, up + 2},
                                rows);
                const double off = fabs((double)out[0] - shows) - 0x1p-23 * shows;
                if (!l->behind && !(off <= l->rest))
                    fail_msg("round %d: %g off, %g told", round, off, l->rest);
            }
        }
        shd_arena_drop(arena);
    }
    assert_true(told > 500 && behind > 200);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(moments_are_sums_over_lights),
        cmocka_unit_test(lights_are_halved_in_any_order),
        cmocka_unit_test(bunches_are_their_lights_together),
        cmocka_unit_test(bunches_are_looked_at_for_all_their_lights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
