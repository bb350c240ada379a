/* Lists of lights: what sums must not depend on, to the bit, and what order may do to them. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>
#include <xxhash.h>

#include "base/denormals.h"
#include "unit/shade_support.h"

enum { LIGHTS = 23, POINTS = 200, LOBES = 12 };

typedef struct world {
    shd_scene scene;
    shd_plan_light lights[LIGHTS];
    shd_plan_lobe lobes[LOBES + 2];
    shd_plan_material materials[4];
    shd_plan plan;
    points at;
} world;

/* Lights of every kind around a patch of surface, those with index % 3 == 1 behind all of it. Some
 * are as close as f32 cannot hold, or too steep for it. */
static void make_world(world *w, unsigned seed, bool grey) {
    srand(seed);
    memset(w, 0, sizeof *w);
    for (int i = 0; i < LIGHTS; i++) {
        shd_vec3 from = random_unit();
        from.y = (i % 3 == 1 ? -1 : 1) * (0.7 + fabs(from.y));
        shd_plan_light *light = &w->lights[i];
        *light = point_light(shd_scale(from, 0.6 + 3 * uniform()));
        light->index = 2 * (size_t)i + 1;
        for (int c = 0; c < 3; c++) light->color[c] = c && grey ? light->color[0] : uniform() - 0.1;
        light->directional = i % 5 == 2;
        shd_normalize(from, &light->toward);
        light->attenuated = i % 5 != 3 && !light->directional;
        if (light->attenuated) light->b = uniform(), light->c = uniform();
        light->min_distance = i % 4 ? 0 : 1.5;
        light->spot = i % 5 == 4;
        shd_normalize(shd_madd(shd_scale(from, -1), random_unit(), 0.3), &light->axis);
        light->outer = 0.05 + uniform();
        light->inner = i % 2 ? light->outer : light->outer * uniform();
        if (i == 14) light->inner = light->outer * 0.99; /* too narrow a fade for f32 */
        light->exponent = i % 2 ? 0 : 10 * uniform();
    }
    for (int k = 0; k < LOBES + 2; k++)
        w->lobes[k] = (shd_plan_lobe){{1, 1, 1}, pow(10, 4 * uniform())};
    w->lobes[LOBES + 1].shininess = 0.5;
    w->materials[0] = (shd_plan_material){.lobes = w->lobes};
    w->materials[1] = (shd_plan_material){.lobes = w->lobes, .lobe_count = 1};
    w->materials[2] = (shd_plan_material){.lobes = w->lobes, .lobe_count = LOBES};
    w->materials[3] = (shd_plan_material){.lobes = w->lobes + LOBES, .lobe_count = 2};
    w->scene = (shd_scene){.light_count = 2 * LIGHTS + 1, .material_count = 4};
    w->plan = (shd_plan){.scene = &w->scene,
                         .lights = w->lights,
                         .light_count = LIGHTS,
                         .materials = w->materials,
                         .grey_lights = grey,
                         .scale = 1};
    w->at.count = POINTS;
    for (size_t i = 0; i < POINTS; i++) {
        shd_vec3 up = {0, 1, 0}, n = up, v = up,
                 p = {2 * uniform() - 1, 0.1 * uniform(), 2 * uniform() - 1};
        shd_normalize(shd_madd(up, random_unit(), 0.1), &n);
        shd_normalize(shd_madd(up, random_unit(), 0.9), &v);
        if (i % 40 == 7) p = shd_madd(w->lights[0].position, up, -1e-8);
        set_point(&w->at, i, p, n, v);
    }
    narrow_points(&w->at, &w->plan);
}

static size_t all_lights(uint32_t which[LIGHTS]) {
    for (uint32_t i = 0; i < LIGHTS; i++) which[i] = i;
    return LIGHTS;
}

/* Lanes [0, count) of what a material's sums are. */
static bool same_sums(const world *w, const shd_plan_material *material, const sums_of *a,
                      size_t from_a, const sums_of *b, size_t from_b, size_t count) {
    const int channels = w->plan.grey_lights ? 1 : 3;
    const size_t size = count * sizeof(double);
    for (int c = 0; c < channels; c++) {
        if (memcmp(a->diffuse[c] + from_a, b->diffuse[c] + from_b, size)) return false;
        for (size_t k = 0; k < material->lobe_count; k++)
            if (memcmp(a->specular[3 * k + (size_t)c] + from_a,
                       b->specular[3 * k + (size_t)c] + from_b, size))
                return false;
    }
    return true;
}

static world w;
static sums_of first, second;

/* Calls check for every tier, grey and colored, with and without low parts, and all materials. */
static void for_all(void (*check)(const shd_plan_material *material, bool split)) {
    for (unsigned seed = 1; seed <= 4; seed++) {
        make_world(&w, seed, seed % 2);
        for (shd_tier tier = SHD_STANDARD; tier <= SHD_EXACT; tier++) {
            w.plan.tier = tier;
            for (int m = 0; m < 4; m++)
                for (int split = 0; split < 2; split++) check(&w.materials[m], split);
        }
    }
}

static XXH64_hash_t bits_of_sums;

static void check_variants(const shd_plan_material *material, bool split) {
    uint32_t which[LIGHTS];
    size_t n = all_lights(which);
    w.plan.isa = SHD_PORTABLE;
    while (w.plan.tier == SHD_STANDARD && !shd_isa_fuses(w.plan.isa)) w.plan.isa++;
    if (!shd_cpu_has(w.plan.isa)) return;
    sum_by(&w.plan, material, which, n, &w.at, split, &first);
    for (int c = 0; c < (w.plan.grey_lights ? 1 : 3); c++) {
        for (int i = 0; i < POINTS; i++) assert_false(isnan(first.diffuse[c][i]));
        for (size_t k = 0; k <= material->lobe_count; k++)
            bits_of_sums =
                XXH3_64bits_withSeed(k ? first.specular[3 * (k - 1) + (size_t)c] : first.diffuse[c],
                                     POINTS * sizeof(double), bits_of_sums);
    }
    for (shd_isa isa = w.plan.isa + 1; isa < SHD_ISA_COUNT; isa++) {
        if (!shd_cpu_has(isa)) continue;
        w.plan.isa = isa;
        sum_by(&w.plan, material, which, n, &w.at, split, &second);
        assert_true(same_sums(&w, material, &first, 0, &second, 0, POINTS));
    }
}

static void variants_give_the_same_bits(void **state) {
    (void)state;
    for_all(check_variants);
    /* tests/neon holds that of another machine against it. */
    print_message("bits of all sums: %016llx\n", (unsigned long long)bits_of_sums);
}

/* One point alone, then with the first ones of the next vector, and so on. */
static void check_neighbors(const shd_plan_material *material, bool split) {
    static points some;
    uint32_t which[LIGHTS];
    size_t n = all_lights(which);
    w.plan.isa = shd_cpu_best();
    sum_by(&w.plan, material, which, n, &w.at, split, &first);
    for (size_t count = 1; count <= 37; count += 3) {
        const size_t from = count * 4;
        some.count = count;
        for (size_t i = 0; i < count; i++)
            set_point(&some, i, lane_of(w.at.position, from + i), lane_of(w.at.normal, from + i),
                      lane_of(w.at.view, from + i));
        narrow_points(&some, &w.plan);
        sum_by(&w.plan, material, which, n, &some, split, &second);
        assert_true(same_sums(&w, material, &first, from, &second, 0, count));
    }
}

static void a_point_does_not_depend_on_its_neighbors(void **state) {
    (void)state;
    for_all(check_neighbors);
}

/* Without those lights that are behind every point; the point that lies at a light's position is
 * no exception. */
static void check_dropped(const shd_plan_material *material, bool split) {
    uint32_t which[LIGHTS], some[LIGHTS];
    size_t n = all_lights(which), kept = 0;
    w.plan.isa = shd_cpu_best();
    sum_by(&w.plan, material, which, n, &w.at, split, &first);
    for (uint32_t i = 0; i < LIGHTS; i++)
        if (i % 3 != 1) some[kept++] = i;
    assert_true(kept < n);
    sum_by(&w.plan, material, some, kept, &w.at, split, &second);
    assert_true(same_sums(&w, material, &first, 0, &second, 0, POINTS));

    /* As a plan that never had them, but of the same scene. */
    static shd_plan_light lights[LIGHTS];
    for (size_t i = 0; i < kept; i++) lights[i] = w.lights[some[i]], which[i] = (uint32_t)i;
    shd_plan fewer = w.plan;
    fewer.lights = lights;
    fewer.light_count = kept;
    sum_by(&fewer, material, which, kept, &w.at, split, &second);
    assert_true(same_sums(&w, material, &first, 0, &second, 0, POINTS));
}

static void lights_that_add_nothing_may_be_left_out(void **state) {
    (void)state;
    for_all(check_dropped);
}

static double difference(const double *a, const double *b) {
    double most = 0;
    for (int i = 0; i < POINTS; i++) {
        if (a[i] == b[i]) continue; /* infinite ones, too */
        most = fmax(most, fabs(a[i] - b[i]));
    }
    return most;
}

/* Denormal numbers as zero change nothing but numbers of their size. */
static void check_flushed(const shd_plan_material *material, bool split) {
    uint32_t which[LIGHTS];
    size_t n = all_lights(which);
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
        if (!shd_cpu_has(isa)) continue;
        w.plan.isa = isa;
        sum_by(&w.plan, material, which, n, &w.at, split, &first);
        const shd_denormals before = shd_denormals_set(SHD_NO_DENORMALS);
        sum_by(&w.plan, material, which, n, &w.at, split, &second);
        shd_denormals_set(before);
        for (int c = 0; c < (w.plan.grey_lights ? 1 : 3); c++) {
            assert_true(difference(first.diffuse[c], second.diffuse[c]) < 1e-36);
            for (size_t k = 0; k < material->lobe_count; k++)
                assert_true(difference(first.specular[3 * k + (size_t)c],
                                       second.specular[3 * k + (size_t)c]) < 1e-36);
        }
    }
}

static void denormal_numbers_do_not_show(void **state) {
    (void)state;
    for_all(check_flushed);
}

/* Ten thousand lights, one of which is a thousand times as bright, in many orders: sums agree
 * within 2e-7. A plain sum in f32 does not. */
static void the_order_of_ten_thousand_lights_does_not_show(void **state) {
    (void)state;
    enum { MANY = 10000 };
    static shd_plan_light lights[MANY], ordered[MANY];
    static uint32_t which[MANY];
    static double least[3 * POINTS], most[3 * POINTS];
    srand(5);
    make_world(&w, 1, true);
    for (uint32_t i = 0; i < MANY; i++) {
        shd_vec3 from = random_unit();
        from.y = 0.3 + fabs(from.y);
        lights[i] = point_light(shd_scale(from, 2 + uniform()));
        lights[i].color[0] = i ? uniform() : 1000;
        which[i] = i;
    }
    w.scene.light_count = w.plan.light_count = MANY;
    w.plan.lights = ordered;
    w.plan.tier = SHD_STANDARD;
    w.plan.isa = shd_cpu_best();
    for (int i = 0; i < 2 * POINTS; i++) least[i] = INFINITY, most[i] = -INFINITY;
    double plain_least = INFINITY, plain_most = -INFINITY;
    for (int round = 0; round < 8; round++) {
        for (size_t i = MANY - 1; round && i > 0; i--) {
            size_t k = (size_t)(uniform() * (double)(i + 1));
            shd_plan_light held = lights[i];
            lights[i] = lights[k];
            lights[k] = held;
        }
        float plain = 0;
        for (size_t i = 0; i < MANY; i++) {
            ordered[i] = lights[i];
            ordered[i].index = i;
            plain += (float)lights[i].color[0] * 0.7f;
        }
        plain_least = fmin(plain_least, (double)plain);
        plain_most = fmax(plain_most, (double)plain);
        sum_by(&w.plan, &w.materials[1], which, MANY, &w.at, false, &first);
        for (int i = 0; i < POINTS; i++) {
            least[i] = fmin(least[i], first.diffuse[0][i]);
            most[i] = fmax(most[i], first.diffuse[0][i]);
            least[POINTS + i] = fmin(least[POINTS + i], first.specular[0][i]);
            most[POINTS + i] = fmax(most[POINTS + i], first.specular[0][i]);
        }
    }
    double worst = 0;
    for (int i = 0; i < 2 * POINTS; i++) {
        assert_true(least[i] > 0 || i >= POINTS);
        if (least[i] > 0) worst = fmax(worst, most[i] / least[i] - 1);
    }
    print_message("order of %d lights: %.1e; of a plain f32 sum: %.1e\n", MANY, worst,
                  plain_most / plain_least - 1);
    assert_true(worst < 2e-7);
    assert_true(plain_most / plain_least - 1 > 1e-6);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(variants_give_the_same_bits),
        cmocka_unit_test(a_point_does_not_depend_on_its_neighbors),
        cmocka_unit_test(lights_that_add_nothing_may_be_left_out),
        cmocka_unit_test(denormal_numbers_do_not_show),
        cmocka_unit_test(the_order_of_ten_thousand_lights_does_not_show),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
