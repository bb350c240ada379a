/* Ways to the points of a light that shadows look at: by vectors as one by one, whatever is near.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "trace/aims.h"
#include "unit/shade_support.h"

enum { COUNT = 53 }; /* no multiple of any vector */

#ifdef __x86_64__
#define VARIANTS(name)                                                                             \
    { name##_portable, name##_avx2, name##_avx512 }
#else
#define VARIANTS(name)                                                                             \
    { name##_portable }
#endif
static shd_aim_function *const variants[SHD_ISA_COUNT] = VARIANTS(shd_aim);

static shd_light random_light(int i, double scale) {
    const double size = 0.01 * pow(1000, uniform()) * scale;
    shd_light l = {.type = (shd_light_type)(SHD_LIGHT_RECT + i % 3),
                   .position = shd_scale(random_unit(), 3 * scale),
                   .radius = size,
                   .size = {size, size * uniform()},
                   .direction = random_unit()};
    shd_normalize(shd_cross(random_unit(), l.direction), &l.across);
    l.up = shd_cross(l.direction, l.across);
    return l;
}

static void compare(const shd_aim_pattern *p, const shd_aim *aim, double scale) {
    shd_aims single, first, found;
    shd_aim_singly(aim, p, 0, p->count, &single);
    double most = 0;
    for (size_t i = 0; i < p->count; i++) most = fmax(most, single.weight[i]);
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
        if (!shd_cpu_has(isa)) continue;
        variants[isa](aim, p, 0, p->count, &found);
        for (size_t i = 0; i < p->count; i++) {
            assert_true(fabs(found.weight[i] - single.weight[i]) <= 1e-10 * most);
            if (!(single.weight[i] > 1e-9 * most)) continue;
            /* A sphere that is grazed ends where the root of a difference does. */
            assert_true(fabs(found.far[i] - single.far[i]) <= 1e-7 * scale);
            for (int c = 0; c < 3; c++)
                assert_true(fabs(found.toward[c][i] - single.toward[c][i]) <= 1e-12);
        }
        if (isa == SHD_PORTABLE) first = found;
        assert_memory_equal(first.weight, found.weight, p->count * sizeof(double));
        assert_memory_equal(first.far, found.far, p->count * sizeof(double));
        for (int c = 0; c < 3; c++)
            assert_memory_equal(first.toward[c], found.toward[c], p->count * sizeof(double));
    }
}

static void ways_are_those_of_single_points(void **state) {
    (void)state;
    shd_aim_pattern p;
    shd_arena *arena = shd_arena_new((size_t)1 << 20);
    assert_true(shd_aim_pattern_make(COUNT, arena, &p));
    static const double scales[] = {1, 1e-60, 1e60};
    for (int i = 0; i < 900; i++) {
        const double scale = scales[i / 3 % 3];
        const shd_light l = random_light(i, scale);
        shd_vec3 from = shd_scale(random_unit(), 2 * scale);
        if (i % 7 == 1) from = shd_madd(l.position, random_unit(), l.radius * uniform());
        const shd_aim aim = shd_aim_at(&l, from, random_unit());
        assert_true(shd_aim_is_held(&aim));
        compare(&p, &aim, scale);
    }
    shd_arena_drop(arena);
}

static void lengths_whose_squares_are_lost_are_not_for_vectors(void **state) {
    (void)state;
    for (int i = 0; i < 6; i++) {
        const double scale = i < 3 ? 1e-160 : 1e160;
        const shd_light l = random_light(i, scale);
        const shd_aim aim = shd_aim_at(&l, (shd_vec3){0, 0, 0}, random_unit());
        assert_false(shd_aim_is_held(&aim));
    }
    const shd_light l = random_light(2, 1);
    const shd_aim within = shd_aim_at(&l, l.position, random_unit());
    assert_false(shd_aim_is_held(&within));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ways_are_those_of_single_points),
        cmocka_unit_test(lengths_whose_squares_are_lost_are_not_for_vectors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
