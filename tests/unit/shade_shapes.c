/* Lights with a shape by kernels: against the scalar reference, which unit.shade_area holds against
 * independent integrals, and against each other. The reference takes some points on the shape where
 * that is within 1e-9 of the most that the light adds; all else is rounding. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "shade/area.h"
#include "shade/area_seen.h"
#include "shade/extended.h"
#include "unit/shade_support.h"

enum { POINTS = 301, LOBES = 9, ROWS = 3 + 3 * LOBES, WORLDS = 60 };

typedef struct world {
    shd_scene scene;
    shd_material from;
    shd_plan_lobe lobes[LOBES];
    shd_plan_material material;
    shd_light shapes[1];
    shd_plan_light lights[2];
    shd_plan plan;
} world;

static const shd_light_type types[3] = {SHD_LIGHT_RECT, SHD_LIGHT_DISC, SHD_LIGHT_SPHERE};
static double by_kernel[ROWS][POINTS], by_reference[ROWS][POINTS], first[ROWS][POINTS];
static int32_t objects[POINTS];

/* A shape at some place of sizes from 0.002 to 20, as often of each kind. */
static void set_world(world *w, int seed, shd_isa isa) {
    static const double exponents[2][LOBES] = {{0, 1, 2, 3, 7, 20, 31, 64, 96},
                                               {0, 0.5, 1, 2.5, 7, 20, 31.3, 128, 4000}};
    srand((unsigned)seed);
    memset(w, 0, sizeof *w);
    const double size = 0.002 * pow(1e4, uniform());
    shd_light *l = &w->shapes[0];
    *l = (shd_light){.type = types[seed % 3],
                     .radius = size / 2,
                     .position = shd_scale(random_unit(), 1 + 2 * uniform()),
                     .size = {size, size * (0.1 + uniform())}};
    const shd_vec3 aside = shd_madd(l->position, random_unit(), 1.5 * uniform());
    shd_normalize(shd_scale(aside, -1), &l->direction);
    shd_perpendicular(l->direction, &l->across, &l->up);
    for (int j = 0; j < 2; j++) {
        w->lights[j] = point_light(l->position);
        w->lights[j].index = (size_t)j;
        for (int c = 0; c < 3; c++) w->lights[j].color[c] = 0.5 + c;
    }
    w->lights[0].shape = l;
    for (int k = 0; k < LOBES; k++)
        w->lobes[k] = (shd_plan_lobe){{1, 1, 1}, exponents[seed % 3 > 0][k]};
    w->material = (shd_plan_material){
        .lobes = w->lobes, .lobe_count = LOBES, .has_diffuse = true, .from = &w->from};
    w->scene = (shd_scene){.light_count = 2, .material_count = 1};
    w->plan = (shd_plan){.scene = &w->scene,
                         .tier = SHD_EXACT,
                         .isa = isa,
                         .lights = w->lights,
                         .light_count = 2,
                         .materials = &w->material,
                         .scale = 0.5,
                         .extended = true};
}

/* Everywhere around, some on the light's plane, on the light, and right before it. */
static void set_points(const world *w, points *at) {
    const shd_light *l = w->shapes;
    at->count = POINTS;
    for (size_t i = 0; i < POINTS; i++) {
        shd_vec3 p = shd_scale(random_unit(), 2 * uniform()), n = random_unit(), v = random_unit();
        if (i % 5 == 1) p = shd_area_point(l, p, uniform(), uniform());
        if (i % 10 == 1) p = shd_madd(p, l->direction, l->radius * uniform());
        if (i % 3) shd_normalize(shd_sub(l->position, p), &n);
        if (i % 3 == 1) shd_normalize(shd_madd(n, random_unit(), 0.9), &n);
        if (i % 7 == 2) n = l->across;
        if (i % 7 == 3) n = shd_scale(l->direction, -1);
        if (i % 2) shd_normalize(shd_madd(v, n, 1.2), &v);
        if (i % 11 == 4) v = n;
        set_point(at, i, p, n, v);
    }
}

static void sum_rows(const shd_lighting *lighting, const world *w, const points *at, bool reference,
                     double rows[ROWS][POINTS]) {
    static const uint32_t which[2] = {0, 1};
    shd_points64 p = world_points(at);
    double *pointers[ROWS];
    for (size_t k = 0; k < ROWS; k++) pointers[k] = rows[k];
    p.object = objects;
    memset(rows, 0, ROWS * sizeof *rows);
    (reference ? shd_extended_sums : shd_light_sums64)(lighting, &w->material, which, 1, &p,
                                                       pointers, pointers + 3);
}

/* How far a row is off, of the most that the light adds: what is at most the whole of its radiance,
 * or a point's. */
static double worst_of(const world *w, const points *at, size_t row, double *most) {
    const shd_light *l = w->shapes;
    double worst = 0;
    for (size_t i = 0; i < POINTS; i++) {
        const shd_vec3 path = shd_sub(l->position, lane_of(((points *)at)->position, i));
        const double adds = fmin(2 * SHD_PI / shd_light_area(l), 4 / shd_dot(path, path)),
                     a = by_kernel[row][i], b = by_reference[row][i];
        assert_true(isfinite(a) && isfinite(b));
        worst = fmax(worst, fabs(a - b) / adds);
        *most = fmax(*most, b / adds);
    }
    return worst;
}

static void kernels_are_as_the_reference(void **state) {
    (void)state;
    static world w;
    static points at;
    double worst[2] = {0, 0}, most[ROWS] = {0};
    for (int seed = 1; seed <= WORLDS; seed++) {
        bool begun = false;
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
            if (!shd_cpu_has(isa)) continue;
            set_world(&w, seed, isa);
            set_points(&w, &at);
            shd_arena *arena = shd_arena_new((size_t)1 << 24);
            const shd_lighting *lighting = shd_lighting_new(&w.plan, NULL, arena);
            assert_non_null(lighting);
            sum_rows(lighting, &w, &at, false, by_kernel);
            sum_rows(lighting, &w, &at, true, by_reference);
            for (size_t k = 0; k < ROWS; k++) {
                const double off = worst_of(&w, &at, k, &most[k]);
                worst[k >= 3] = fmax(worst[k >= 3], off);
            }
            if (!begun) memcpy(first, by_kernel, sizeof first);
            begun = true;
            assert_memory_equal(first, by_kernel, sizeof first);
            shd_arena_drop(arena);
        }
    }
    print_message("diffuse %.2e, lobes %.2e\n", worst[0], worst[1]);
    for (size_t k = 0; k < ROWS; k++) assert_true(most[k] > 0.1);
    assert_true(worst[0] < 1e-12);
    assert_true(worst[1] < 1e-9);
}

/* A point's sums do not depend on what is beside it, nor on how many there are. */
static void look_alone(int seed) {
    static world w;
    static points at, one;
    set_world(&w, seed, shd_cpu_best());
    set_points(&w, &at);
    shd_arena *arena = shd_arena_new((size_t)1 << 24);
    const shd_lighting *lighting = shd_lighting_new(&w.plan, NULL, arena);
    assert_non_null(lighting);
    sum_rows(lighting, &w, &at, false, by_kernel);
    for (size_t i = 0; i < POINTS; i++) {
        one.count = 1;
        set_point(&one, 0, lane_of(at.position, i), lane_of(at.normal, i), lane_of(at.view, i));
        sum_rows(lighting, &w, &one, false, by_reference);
        for (size_t k = 0; k < ROWS; k++) assert_true(by_reference[k][0] == by_kernel[k][i]);
    }
    shd_arena_drop(arena);
}

static void points_do_not_see_each_other(void **state) {
    (void)state;
    for (int seed = 3; seed < 9; seed++) look_alone(seed);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kernels_are_as_the_reference),
        cmocka_unit_test(points_do_not_see_each_other),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
