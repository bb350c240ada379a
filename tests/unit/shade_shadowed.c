/* Sums behind shadows by kernels: to the bit, what each light adds where nothing stops it times the
 * share that arrives; and the scalar reference's, to rounding. What stops light is made up here. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include "shade/area_seen.h"
#include "shade/extended.h"
#include "shade/packed.h"
#include "unit/shade_support.h"

enum { POINTS = 331, LIGHTS = 6, LOBES_MOST = 1 + SHD_LOBES_MOST, ROWS = 3 + 3 * LOBES_MOST };

typedef struct world {
    shd_scene scene;
    shd_material from;
    shd_plan_lobe lobes[LOBES_MOST];
    shd_plan_material material;
    shd_light shape;
    shd_plan_light lights[LIGHTS];
    shd_plan plan;
} world;

static const uint32_t which[LIGHTS] = {0, 1, 2, 3, 4, 5};
static double by_kernel[ROWS][POINTS], expected[ROWS][POINTS];
static int32_t objects[POINTS];
static size_t asked[LIGHTS]; /* how often, of each light */

static void set_world(world *w, shd_model model, size_t lobes, shd_isa isa) {
    srand(11);
    memset(w, 0, sizeof *w);
    w->shape = (shd_light){.type = SHD_LIGHT_RECT,
                           .position = {0, 0.4, 2},
                           .direction = {0, 0, -1},
                           .across = {1, 0, 0},
                           .up = {0, -1, 0},
                           .size = {1, 0.5}};
    for (int j = 0; j < LIGHTS; j++) {
        shd_plan_light *l = &w->lights[j];
        *l = point_light(shd_scale(random_unit(), 3));
        l->index = (size_t)j;
        for (int c = 0; c < 3; c++) l->color[c] = uniform() - 0.1 * j;
    }
    w->lights[1].directional = true;
    w->lights[1].toward = random_unit();
    w->lights[2].attenuated = true;
    w->lights[2].c = 0.3;
    w->lights[3].spot = true;
    w->lights[3].axis = shd_scale(w->lights[3].position, -1.0 / 3);
    w->lights[3].outer = 0.4;
    w->lights[4].shape = &w->shape;
    w->lights[4].position = w->shape.position;
    for (int c = 0; c < 3; c++) w->lights[5].color[c] = 1e308;
    w->lights[5].attenuated = true; /* what it adds is infinite */
    w->lights[5].a = 0;
    w->lights[5].c = 0.001;
    for (size_t k = 0; k < lobes; k++)
        w->lobes[k] = (shd_plan_lobe){{1, 1, 1}, (double)(1 + 3 * (k % 30))};
    w->from = (shd_material){.model = model, .sigma = 0.4};
    w->material = (shd_plan_material){.lobes = w->lobes,
                                      .lobe_count = lobes,
                                      .model = model,
                                      .has_diffuse = true,
                                      .from = &w->from};
    w->scene = (shd_scene){.light_count = LIGHTS, .material_count = 1};
    w->plan = (shd_plan){.scene = &w->scene,
                         .tier = SHD_EXACT,
                         .isa = isa,
                         .lights = w->lights,
                         .light_count = LIGHTS,
                         .materials = &w->material,
                         .scale = 0.5,
                         .extended = true};
}

/* Objects of one point, of some, and of more than a crowd. */
static void set_points(points *at) {
    at->count = POINTS;
    for (size_t i = 0; i < POINTS; i++) {
        const shd_vec3 p = random_unit();
        shd_vec3 n = i % 3 ? p : random_unit(), v = random_unit();
        if (i % 2) shd_normalize(shd_madd(v, n, 1.2), &v);
        set_point(at, i, p, n, v);
        objects[i] = i < 9 ? (int32_t)(i % 2) : i < 30 ? (int32_t)(i / 7) : i < 250 ? 7 : 8;
    }
}

/* ---- What stops light. ---- */

static uint64_t scramble(uint64_t x) {
    x = (x ^ (x >> 31)) * 0x7fb5d329728ea185;
    x = (x ^ (x >> 27)) * 0x81dadef4bc2dd44d;
    return x ^ (x >> 33);
}

/* All, nothing, some, or some of a color: by the place and the light. */
static void share(const void *context, const shd_plan_light *light, const shd_surface *at,
                  double *out) {
    uint64_t bits;
    (void)context;
    memcpy(&bits, &at->position.x, sizeof bits);
    bits = scramble(bits + light->index);
    for (int c = 0; c < 3; c++)
        out[c] = bits % 4 == 0   ? 1
                 : bits % 4 == 1 ? 0
                 : bits % 4 == 2 ? (double)(bits >> 40) * 0x1p-24
                                 : (double)(bits >> (20 * c) & 15) / 15;
    if (light->index == 5) out[0] = out[1] = out[2] = 0;
}

static void gather(const void *context, shd_crowd *crowd) {
    (void)context;
    for (size_t i = 1; i < crowd->count; i++)
        assert_true(crowd->at[i].object == crowd->at[0].object);
}

static void shares(const void *context, const shd_plan_light *light, const shd_crowd *crowd,
                   const uint8_t *of, size_t n, double *out) {
    for (size_t i = 0; i < n; i++) {
        assert_true(of[i] < crowd->count && (!i || of[i] > of[i - 1]));
        share(context, light, &crowd->at[of[i]], out + 3 * i);
    }
    asked[light->index] += n;
}

static const shd_shadows shadows = {NULL, share, gather, shares};

/* ---- Sums. ---- */

typedef void summing(const shd_lighting *lighting, const shd_plan_material *material,
                     const uint32_t *lights, size_t n, const shd_points64 *points,
                     double *const diffuse[3], double *const *specular);

static void sum_rows(summing *sum, const shd_lighting *lighting, const points *at, size_t first,
                     size_t count, const uint32_t *lights, size_t n, double rows[ROWS][POINTS]) {
    double *pointers[ROWS];
    for (size_t k = 0; k < ROWS; k++) pointers[k] = rows[k];
    shd_points64 p = world_points(at);
    for (int c = 0; c < 3; c++) {
        p.position[c] += first;
        p.normal[c] += first;
        p.view[c] += first;
    }
    p.object = objects + first;
    p.count = count;
    sum(lighting, lighting->plan->materials, lights, n, &p, pointers, pointers + 3);
}

/* By what each light adds where nothing stops it. reached[j]: how many points that light j reaches.
 */
static void sum_by_shares(const world *w, const points *at, size_t reached[LIGHTS],
                          shd_arena *arena) {
    static double added[ROWS][POINTS];
    const shd_lighting *open = shd_lighting_new(&w->plan, NULL, arena);
    assert_non_null(open);
    bool infinite = false;
    memset(expected, 0, sizeof expected);
    for (uint32_t j = 0; j < LIGHTS; j++) {
        sum_rows(shd_light_sums64, open, at, 0, POINTS, &j, 1, added);
        reached[j] = 0;
        for (size_t i = 0; i < POINTS; i++) {
            const shd_surface here = {.position = lane_of(((points *)at)->position, i)};
            double part[3];
            bool any = false;
            share(NULL, &w->lights[j], &here, part);
            for (size_t k = 0; k < 3 + 3 * w->material.lobe_count; k++) {
                any |= added[k][i] != 0;
                if (part[k % 3] > 0) expected[k][i] += added[k][i] * part[k % 3];
            }
            reached[j] += any;
            infinite |= isinf(added[0][i]);
        }
    }
    assert_true(infinite);
}

static void compare(shd_model model, size_t lobes, shd_isa isa) {
    static world w;
    static points at;
    static double by_reference[ROWS][POINTS];
    const size_t rows = 3 + 3 * lobes;
    size_t reached[LIGHTS];
    set_world(&w, model, lobes, isa);
    set_points(&at);
    shd_arena *arena = shd_arena_new((size_t)1 << 24);
    sum_by_shares(&w, &at, reached, arena);
    const shd_lighting *lighting = shd_lighting_new(&w.plan, &shadows, arena);
    assert_non_null(lighting);
    assert_true(shd_has_kernel(lighting, &w.material));
    memset(asked, 0, sizeof asked);
    sum_rows(shd_light_sums64, lighting, &at, 0, POINTS, which, LIGHTS, by_kernel);
    for (size_t j = 0; j < LIGHTS; j++) assert_true(reached[j] > 9 && asked[j] == reached[j]);
    sum_rows(shd_extended_sums, lighting, &at, 0, POINTS, which, LIGHTS, by_reference);
    for (size_t k = 0; k < rows; k++) {
        assert_memory_equal(by_kernel[k], expected[k], sizeof expected[k]);
        for (size_t i = 0; i < POINTS; i++) {
            const double a = by_kernel[k][i], b = by_reference[k][i];
            assert_true(isfinite(a));
            if (!(fabs(a - b) <= 1e-12))
                fail_msg("%s, row %zu, point %zu: %g is off by %g", shd_isa_name(isa), k, i, b,
                         a - b);
        }
    }
    shd_arena_drop(arena);
}

static void shares_of_what_lights_add_are_summed(void **state) {
    (void)state;
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
        if (!shd_cpu_has(isa)) continue;
        compare(SHD_MODEL_PHONG, 1, isa);
        compare(SHD_MODEL_PHONG, 9, isa);
        compare(SHD_MODEL_PHONG, LOBES_MOST, isa);
        compare(SHD_MODEL_BLINN_PHONG, 2, isa);
        compare(SHD_MODEL_OREN_NAYAR, 0, isa);
    }
}

/* Whatever stands beside a point, and whatever came before. */
static void points_do_not_see_each_other(void **state) {
    (void)state;
    static world w;
    static points at;
    static double alone[ROWS][POINTS];
    set_world(&w, SHD_MODEL_PHONG, 2, shd_cpu_best());
    set_points(&at);
    shd_arena *arena = shd_arena_new((size_t)1 << 24);
    const shd_lighting *lighting = shd_lighting_new(&w.plan, &shadows, arena);
    assert_non_null(lighting);
    sum_rows(shd_light_sums64, lighting, &at, 0, POINTS, which, LIGHTS, by_kernel);
    for (size_t first = 0; first < POINTS; first += 1 + first % 5) {
        const size_t count = first + 5 < POINTS ? 1 + first % 5 : 1;
        sum_rows(shd_light_sums64, lighting, &at, first, count, which, LIGHTS, alone);
        for (size_t k = 0; k < 9; k++)
            assert_memory_equal(alone[k], by_kernel[k] + first, count * sizeof(double));
    }
    shd_arena_drop(arena);
}

/* No diffuse rows: nobody asks for them, and where there are no highlights no ray is cast. */
static void rows_that_nobody_asks_for_cost_no_rays(void **state) {
    (void)state;
    static world w;
    static points at;
    static double both[ROWS][POINTS];
    double *pointers[3] = {by_kernel[0], by_kernel[1], by_kernel[2]};
    set_world(&w, SHD_MODEL_PHONG, 1, shd_cpu_best());
    w.lobes[0].shininess = 1000; /* others underflow to 0 */
    set_points(&at);
    shd_arena *arena = shd_arena_new((size_t)1 << 24);
    const shd_lighting *lighting = shd_lighting_new(&w.plan, &shadows, arena);
    assert_non_null(lighting);
    shd_points64 p = world_points(&at);
    p.object = objects;
    sum_rows(shd_light_sums64, lighting, &at, 0, POINTS, which, 1, both);
    memset(asked, 0, sizeof asked);
    shd_light_sums64(lighting, &w.material, which, 1, &p, NULL, pointers);
    for (size_t c = 0; c < 3; c++)
        assert_memory_equal(by_kernel[c], both[3 + c], POINTS * sizeof(double));
    assert_true(asked[0] > 0 && asked[0] < POINTS / 5);
    shd_arena_drop(arena);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shares_of_what_lights_add_are_summed),
        cmocka_unit_test(points_do_not_see_each_other),
        cmocka_unit_test(rows_that_nobody_asks_for_cost_no_rays),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
