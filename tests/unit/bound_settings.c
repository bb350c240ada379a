/* Where lights set on balls, against places around each pixel. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include <cmocka.h>

#include "bound/light/sets.h"
#include "stage.h"

/* A light that sets in the block's middle, or near to it. */
static void set_setting_light(const stage *s, shd_plan_light *l, const shd_analytic *a,
                              uint64_t *random) {
    const double away = s->radius * decades(random, 0.01, 20);
    shd_vec3 toward = any_direction(random);
    toward = shd_madd(toward, a->normal,
                      -shd_dot(toward, a->normal) +
                          decades(random, 1e-6, 0.1) * (uniform(random, 0, 1) < 0.5 ? -1 : 1));
    shd_normalize(toward, &toward);
    *l = (shd_plan_light){.directional = uniform(random, 0, 1) < 0.3, .gain = 1};
    l->toward = toward;
    l->position = shd_madd(a->point, toward, away);
}

/* N.L, at a place of the picture. Not a number: nothing is there. */
static double facing_at(const stage *s, const shd_plan_light *l, double x, double y) {
    shd_vec3 p, n, v, way = l->toward;
    if (!hit_at(s, x, y, &p, &n, &v)) return NAN;
    if (!l->directional) shd_normalize(shd_sub(l->position, p), &way);
    return shd_dot(n, way);
}

/* No pixel that is told to be on one side of where a light sets has a place on the other one. */
static void settings_are_where_they_are_told(void **state) {
    (void)state;
    size_t known = 0, off = 0, apart = 0, parted = 0;
    for (uint64_t seed = 1; known < 1500; seed++) {
        uint64_t random = seed * 4001 + 5;
        stage s = {.samples = 4};
        set_object(&s, &random);
        if (!s.seen.is_ball) continue;
        const int part = (int)(seed % 2 ? SHD_WHOLE : seed / 2 % SHD_QUARTERS);
        shd_analytic a;
        shd_setting set;
        shd_plan_light light;
        if (!shd_sight_expand(&s.sight, &s.survey, 0, part, &a)) continue;
        set_setting_light(&s, &light, &a, &random);
        if (!shd_find_setting(&a, &light, &set)) continue;
        known++;
        const double reach = seed % 3 ? seed % 3 : 0.5;
        const uint64_t told = shd_off_setting(&set, reach);
        const double left = s.survey.rect.x + (part & 1) * a.side + 0.5,
                     top = s.survey.rect.y + (part >> 1 & 1) * a.side + 0.5;
        int some = 0;
        for (int k = 0; k < a.side * a.side; k++) {
            const double x = left + k % a.side, y = top + k / a.side,
                         middle = facing_at(&s, &light, x, y);
            bool one = true;
            for (int i = 0; i < 25; i++)
                one &= facing_at(&s, &light, x + (i % 5 - 2) * reach / 2,
                                 y + (i / 5 - 2) * reach / 2) *
                           middle >
                       0;
            apart += one;
            off += told >> k & 1;
            some += told >> k & 1;
            if (told >> k & 1 && !one) fail_msg("seed %llu: pixel %d", (unsigned long long)seed, k);
        }
        parted += some > 0 && some < a.side * a.side;
    }
    print_message("%zu of %zu pixels are told, some of %zu blocks\n", off, apart, parted);
    assert_true(off > apart / 2 && parted > known / 10);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(settings_are_where_they_are_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
