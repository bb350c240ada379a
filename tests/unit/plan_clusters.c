/* Bounds by clusters of lights, against those of each pair of a light and an object; and planes of
 * faces that lights are in. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bound/light/clusters.h"
#include "bound/shown/shown.h"
#include "engine_support.h"
#include "render/planning.h"
#include "render/request.h"
#include "render/show/shown.h"

/* More than 2^20 pairs together, and parts with few. */
enum { LIGHTS = 1100, OBJECTS = 1000, PART = 40 };

typedef enum lamps { HUES, OWN_HUES } lamps;

static double uniform(uint64_t *random, double low, double high) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(*random >> 11) * 0x1p-53);
}

static void write_light(FILE *out, int i, lamps kind, uint64_t *random) {
    static const char *const kinds[] = {
        "\"type\": \"point\", \"attenuation\": [0, 0, 1]",
        "\"type\": \"point\"",
        "\"type\": \"point\", \"attenuation\": [3, 0.1, 0.7], \"minDistance\": 0.3",
        "\"type\": \"point\", \"attenuation\": [0, 2, 0]",
        "\"type\": \"directional\", \"direction\": [0, -1, 0.2]",
        "\"type\": \"spot\", \"direction\": [0, 1, 0], \"angle\": 50, \"penumbra\": 0.4"};
    const char *const text = kinds[i % 6];
    fprintf(out, "%s{%s, \"intensity\": %g, ", i ? ", " : "", text, uniform(random, 1e-4, 0.01));
    if (i % 6 != 4) {
        /* Some of them on top of each other, some in a row; none in an object, whose sphere is all
         * that clusters know of it. */
        const double wide = i % 7 == 0 ? 0 : i % 7 == 1 ? 0.01 : 3;
        fprintf(out, "\"position\": [%g, %g, %g], ", 4.7 + uniform(random, -wide, wide),
                uniform(random, -wide, wide), 2 + (i % 5 ? uniform(random, -wide, wide) : 0));
    }
    const double red = kind == HUES ? 0.1 * (i % 3) : uniform(random, 0, 1),
                 blue = kind == HUES ? 0.4 : uniform(random, 0, 1);
    fprintf(out, "\"color\": [%g, %g, %g]}", red, 0.5, blue);
}

/* The document is freed. */
static shd_request *take_document(shd_engine *engine, char *json, size_t size) {
    shd_request *request = read_document(engine, json, size);
    free(json);
    return request;
}

static shd_request *read_scene(shd_engine *engine, lamps kind, int seed) {
    static const char *const shapes[] = {
        "\"sphere\", \"radius\": 0.1", "\"box\", \"size\": [0.1, 0.2, 0.1]",
        "\"torus\", \"radius\": 0.2, \"tube\": 0.05",
        "\"sphere\", \"radius\": 0.1, \"interpolation\": \"gouraud\", \"segments\": 4"};
    uint64_t random = (uint64_t)seed;
    char *json = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&json, &size);
    fprintf(out, "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": 1}, \"camera\": "
                 "{\"position\": [0, 0, 12]}, \"lights\": [");
    for (int i = 0; i < LIGHTS; i++) write_light(out, i, kind, &random);
    fprintf(out, "], \"objects\": [");
    for (int i = 0; i < OBJECTS; i++)
        fprintf(out,
                "%s{\"type\": %s, \"material\": {\"diffuse\": [0.2, 0.3, 0.%d], \"specular\": 0.%d"
                "}, \"transform\": {\"translate\": [%g, %g, %g]}}",
                i ? ", " : "", shapes[i % 11 ? i % 3 : 3], i % 9, i % 2, uniform(&random, -3, 1.5),
                uniform(&random, -3, 3), uniform(&random, -3, 3));
    fprintf(out, "]}");
    fclose(out);
    return take_document(engine, json, size);
}

/* What tells how far off a picture is. */
typedef struct figures {
    double linear, misplaced, most[3], delta_e;
    double influences[LIGHTS];
} figures;

static void find_figures(const shd_plan *plan, shd_tier tier, const shd_shown *shown,
                         shd_arena *arena, figures *to) {
    shd_excess_list list;
    shd_influences in;
    assert_true(shd_excess_find(plan, tier, arena, &list, &in));
    to->linear = fmax(to->linear, list.worst);
    to->misplaced = fmax(to->misplaced, list.misplaced);
    for (int c = 0; c < 3; c++) to->most[c] = fmax(to->most[c], list.most[c]);
    to->delta_e = fmax(to->delta_e, shd_bound_delta_e(&list, shown, 0));
    for (size_t r = 0; r < in.count; r++)
        for (size_t j = 0; j < plan->light_count; j++)
            to->influences[j] = fmax(to->influences[j], in.rows[r][j]);
}

static void expect_between(const char *what, double whole, double least, double times) {
    if (!(whole >= least * (1 - 1e-9) && whole <= times * least + 1e-12))
        fail_msg("%s: %g, and %g by pairs", what, whole, least);
}

/* The same plan of some of its objects. */
static void find_part(const shd_plan *plan, size_t first, shd_tier tier, const shd_shown *shown,
                      shd_arena *arena, figures *to) {
    shd_scene scene = *plan->scene;
    shd_plan part = *plan;
    scene.objects += first;
    scene.object_count = PART;
    part.objects += first;
    part.scene = &scene;
    find_figures(&part, tier, shown, arena, to);
}

static void bounds_by_clusters_are_no_less_than_those_by_pairs(void **state) {
    /* Clusters know spheres around objects, pairs the objects themselves. */
    static const double looser[] = {[HUES] = 1.5, [OWN_HUES] = 3};
    for (lamps kind = HUES; kind <= OWN_HUES; kind++) {
        shd_request *request = read_scene(*state, kind, 15 + (int)kind);
        shd_arena *arena = request->rendering.arena;
        const shd_plan *plan;
        const shd_shown *shown = NULL;
        shd_error error;
        assert_int_equal(shd_shown_make(&request->rendering, request->scene, &shown, &error),
                         SHD_OK);
        assert_true(shd_plan_draft(request->scene, SHD_PORTABLE, true, NULL, arena, &plan));
        assert_true((double)plan->light_count * OBJECTS > 1 << 20);
        const shd_tier last = kind == HUES ? SHD_EXACT : SHD_STANDARD; /* for the test's time */
        for (shd_tier tier = SHD_STANDARD; tier <= last; tier++) {
            static figures whole, parts;
            whole = parts = (figures){0};
            find_figures(plan, tier, shown, arena, &whole);
            for (size_t i = 0; i < OBJECTS; i += PART)
                find_part(plan, i, tier, shown, arena, &parts);
            const double times = looser[kind];
            expect_between("linear", whole.linear, parts.linear, times);
            expect_between("misplaced", whole.misplaced, parts.misplaced, times);
            /* The whole's pieces share a list of errors in another order, and with it their main
             * direction: another bound, which may be less. */
            expect_between("deltaE2000", whole.delta_e, 0.8 * parts.delta_e, 2 * times);
            for (int c = 0; c < 3; c++) expect_between("most", whole.most[c], parts.most[c], times);
            for (size_t j = 0; j < plan->light_count; j++)
                expect_between("influence", whole.influences[j], parts.influences[j], 30);
        }
        shd_request_drop(request);
    }
}

static void every_light_is_in_a_cut_once_and_no_nearer_than_it_says(void **state) {
    shd_request *request = read_scene(*state, HUES, 5);
    shd_arena *arena = request->rendering.arena;
    const shd_plan *plan;
    assert_true(shd_plan_draft(request->scene, SHD_PORTABLE, true, NULL, arena, &plan));
    shd_hues hues;
    shd_terms terms;
    shd_clusters clusters;
    double *beside = shd_arena_zalloc(arena, plan->light_count, sizeof *beside);
    assert_true(shd_terms_new(plan, true, arena, &hues, &terms));
    assert_true(shd_clusters_new(plan, &hues, beside, arena, &clusters));
    uint64_t random = 3;
    size_t looks = 0;
    for (int i = 0; i < 60; i++) {
        const double wide = i % 2 ? 3 : 30;
        const shd_cluster_target target = {{uniform(&random, -wide, wide),
                                            uniform(&random, -wide, wide),
                                            uniform(&random, -wide, wide)},
                                           uniform(&random, 0, 0.3),
                                           i % 3 == 0};
        uint8_t found[LIGHTS] = {0};
        shd_clusters_cut(&clusters, &target);
        for (size_t k = 0; k < clusters.single_count; k++) found[clusters.single[k]]++;
        for (size_t k = 0; k < clusters.cut_count; k++) {
            const shd_cluster *c = &clusters.list[clusters.cut[k]];
            const double nearest = shd_cluster_distance(c, &target),
                         fall = shd_cluster_fall(c, nearest) * (1 + SHD_PIECE_MARGIN);
            double strength = 0;
            for (uint32_t l = c->first; l < c->end; l++) {
                const uint32_t j = clusters.lights[l];
                const shd_plan_light *light = &plan->lights[j];
                const double away = shd_length(shd_sub(light->position, target.center));
                found[j]++;
                assert_int_equal(hues.of_light[j], c->hue);
                assert_true(light->directional == c->directional);
                assert_true(c->directional || nearest <= fmax(away - target.radius, 0));
                assert_true(light->directional ||
                            shd_attenuation(light, fmax(away - target.radius, 0)) <=
                                fall * light->gain);
                strength += hues.strength[j] * light->gain;
            }
            assert_true(strength <= c->strength);
        }
        for (size_t j = 0; j < plan->light_count; j++) assert_int_equal(found[j], 1);
        looks += clusters.cut_count + clusters.single_count - clusters.alone_count;
    }
    assert_true(looks < 60 * LIGHTS / 3); /* it saves something */
    shd_request_drop(request);
}

/* Boxes whose faces are between whole numbers, and lights there, or as good as there, or not. */
static shd_request *read_boxes(shd_engine *engine, int boxes, int lights) {
    uint64_t random = 23;
    char *json = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&json, &size);
    fprintf(out, "{\"lights\": [");
    for (int j = 0; j < lights; j++) {
        double at[3];
        for (int c = 0; c < 3; c++)
            at[c] = 0.5 + floor(uniform(&random, -8, 8)) +
                    (c == j % 4   ? 0
                     : j % 3 == 0 ? 1e-6
                                  : uniform(&random, 0.1, 0.4));
        fprintf(out, "%s{\"type\": \"%s\": [%.17g, %.17g, %.17g]}", j ? ", " : "",
                j % 5 ? "point\", \"position" : "directional\", \"direction", at[0], at[1],
                j % 5 ? at[2] : 0);
    }
    fprintf(out, "], \"objects\": [");
    for (int i = 0; i < boxes; i++)
        fprintf(out, "%s{\"type\": \"box\", \"transform\": {\"translate\": [%g, %g, %g]}}",
                i ? ", " : "", floor(uniform(&random, -8, 8)), floor(uniform(&random, -8, 8)),
                floor(uniform(&random, -8, 8)));
    fprintf(out, "]}");
    fclose(out);
    return take_document(engine, json, size);
}

static void planes_of_faces_are_found_among_many_lights_as_for_one(void **state) {
    enum { BOXES = 20, MANY = 150 };
    shd_request *request = read_boxes(*state, BOXES, MANY);
    shd_arena *arena = request->rendering.arena;
    const shd_plan *plan, *one;
    size_t planes = 0;
    assert_true(shd_plan_draft(request->scene, SHD_PORTABLE, true, NULL, arena, &plan));
    assert_int_equal(plan->light_count, MANY);
    for (size_t j = 0; j < MANY; j++) {
        shd_scene scene = *request->scene;
        scene.lights += j;
        scene.light_count = 1;
        assert_true(shd_plan_draft(&scene, SHD_PORTABLE, true, NULL, arena, &one));
        const shd_sheets *found = &plan->sheets[j], *wanted = &one->sheets[0];
        assert_int_equal(found->count, wanted->count);
        for (size_t k = 0; k < found->count; k++)
            assert_memory_equal(&found->list[k], &wanted->list[k], sizeof *found->list);
        planes += found->count;
    }
    assert_true(planes > 2 * MANY);
    bool drops[MANY];
    const shd_plan *fewer;
    for (size_t j = 0; j < MANY; j++) drops[j] = j % 3 == 1;
    assert_true(shd_plan_without(plan, drops, arena, &fewer));
    assert_int_equal(fewer->light_count, MANY - MANY / 3);
    for (size_t j = 0; j < fewer->light_count; j++) {
        const shd_sheets *wanted = &plan->sheets[fewer->lights[j].index];
        assert_int_equal(fewer->sheets[j].count, wanted->count);
        for (size_t k = 0; k < wanted->count; k++)
            assert_memory_equal(&fewer->sheets[j].list[k], &wanted->list[k], sizeof *wanted->list);
    }
    shd_request_drop(request);
}

/* Lamps and as many spheres, of four colors, all over each other's place. */
static shd_request *read_crowd(shd_engine *engine, int count, double budget) {
    uint64_t random = 15;
    char *json = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&json, &size);
    fprintf(out,
            "{\"image\": {\"width\": 64, \"height\": 64, \"samples\": 1}, \"accuracy\": "
            "{\"maxError\": %g}, \"ambient\": 0.1, \"lights\": [",
            budget);
    for (int i = 0; i < count; i++)
        fprintf(out,
                "%s{\"type\": \"point\", \"attenuation\": [0, 0, 1], \"intensity\": %g, "
                "\"position\": [%g, %g, %g]}",
                i ? ", " : "", 10.0 / count, uniform(&random, -12, 12), uniform(&random, -5, 5),
                uniform(&random, -12, 12));
    fprintf(out, "], \"objects\": [");
    for (int i = 0; i < count; i++)
        fprintf(
            out,
            "%s{\"type\": \"sphere\", \"radius\": 0.02, \"material\": {\"diffuse\": [0.%d, 0.3, "
            "0.2], \"specular\": 0.2, \"shininess\": 20}, \"transform\": {\"translate\": [%g, "
            "%g, %g]}}",
            i ? ", " : "", 2 * (i % 4) + 1, uniform(&random, -3, 3), uniform(&random, -3, 3),
            uniform(&random, -3, 3));
    fprintf(out, "]}");
    fclose(out);
    return take_document(engine, json, size);
}

static void budgets_hold_for_many_lights_and_objects(void **state) {
    size_t fewer = 0;
    for (int count = 520; count < 700; count += 45)
        for (double budget = 1; budget < 10; budget += 1.5) {
            shd_request *request = read_crowd(*state, count, budget);
            shd_error error;
            assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error),
                             SHD_OK);
            const shd_plan *plan = request->rendering.plan;
            if (!(plan->bound.delta_e <= budget))
                fail_msg("%d lights: %g, and %g asked for", count, plan->bound.delta_e, budget);
            fewer += plan->light_count < request->scene->light_count;
            shd_request_drop(request);
        }
    assert_true(fewer > 0);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(bounds_by_clusters_are_no_less_than_those_by_pairs),
        cmocka_unit_test(every_light_is_in_a_cut_once_and_no_nearer_than_it_says),
        cmocka_unit_test(planes_of_faces_are_found_among_many_lights_as_for_one),
        cmocka_unit_test(budgets_hold_for_many_lights_and_objects),
    };
    return cmocka_run_group_tests(tests, start_engine, stop_engine);
}
