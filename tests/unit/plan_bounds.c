/* What error bounds rest on, and how budgets are met. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "bound/light/pieces.h"
#include "color/delta_e.h"
#include "plan/cost.h"
#include "plan/parts.h"
#include "render/planning.h"
#include "render/request.h"
#include "render/show/shown.h"

static double uniform(uint64_t *random, double low, double high) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(*random >> 11) * 0x1p-53);
}

/* ---- CIEDE2000. ---- */

/* src/bound/shown/lab.h's measure of a difference. */
static double measure_of(const double a[3], const double b[3]) {
    double mean = (a[0] + b[0]) / 2, off = (mean - 50) * (mean - 50);
    double weight = 1 + 0.015 * off / sqrt(20 + off);
    double l = (a[0] - b[0]) / weight, x = 1.5 * (a[1] - b[1]), y = a[2] - b[2];
    return sqrt(l * l + x * x + y * y);
}

static void ciede2000_is_at_most_the_measure(void **state) {
    (void)state;
    uint64_t random = 9;
    double most = 0;
    for (int i = 0; i < 2000000; i++) {
        /* Near and far pairs, from greys to colors that no screen has. */
        double chroma = pow(10, uniform(&random, -3, 2.2)), hue = uniform(&random, 0, 2 * SHD_PI);
        double apart = pow(10, uniform(&random, -4, 2));
        double a[3] = {uniform(&random, 0, 100), chroma * cos(hue), chroma * sin(hue)}, b[3];
        for (int c = 0; c < 3; c++) b[c] = a[c] + uniform(&random, -apart, apart);
        double measure = measure_of(a, b);
        if (measure > 0) most = fmax(most, shd_delta_e_2000(a, b) / measure);
    }
    assert_true(most <= 1 + 1e-9);
    assert_true(most > 0.99); /* and no less would do */
}

/* ---- Curves and matrices, found by trying. ---- */

static shd_engine *new_engine(void) {
    shd_engine_options options = shd_engine_defaults();
    options.threads = 1;
    shd_engine *engine = NULL;
    assert_int_equal(shd_engine_new(&options, &engine, NULL), SHD_OK);
    return engine;
}

static int start(void **state) {
    *state = new_engine();
    return 0;
}

static int stop(void **state) {
    shd_engine_drop(*state);
    return 0;
}

/* A request for such a scene; the caller drops it. */
static shd_request *read_text(shd_engine *engine, const char *json) {
    shd_request *request;
    assert_int_equal(shd_request_new(engine, &request, NULL), SHD_OK);
    if (shd_request_read(request, json, strlen(json), SHD_PNG))
        fail_msg("%s: %s", shd_request_report(request)->errors[0].detail, json);
    return request;
}

/* For a sphere, with these members in front. */
static shd_request *read_with(shd_engine *engine, const char *members) {
    char json[1024];
    snprintf(json, sizeof json, "{%s, \"objects\": [{\"type\": \"sphere\"}]}", members);
    return read_text(engine, json);
}

static void outputs_are_known_by_their_curves(void **state) {
    static const struct {
        const char *members;
        bool coded, seen;
        double first; /* matrix[0][0] */
    } cases[] = {
        {"\"output\": {}", true, true, 1},
        {"\"output\": {\"display\": \"Rec.1886\", \"view\": \"Standard\"}", true, true, 1},
        {"\"output\": {\"display\": \"Display P3\", \"view\": \"Standard\"}", true, true, 0.822},
        {"\"output\": {\"format\": \"exr\"}", true, true, 1},
        {"\"output\": {\"colorSpace\": \"ACEScg\"}", true, true, 0.613},
        {"\"workingSpace\": \"ACEScg\"", true, true, 1.705},
        {"\"output\": {\"colorSpace\": \"YIQ\"}", false, true, 0},
        {"\"output\": {\"colorSpace\": \"HSV\"}", false, true, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_request *request = read_with(*state, cases[i].members);
        shd_error error;
        const shd_shown *shown = NULL;
        assert_int_equal(shd_shown_make(&request->rendering, request->scene, &shown, &error),
                         SHD_OK);
        assert_int_equal(shown->coded, cases[i].coded);
        assert_int_equal(shown->seen, cases[i].seen);
        if (shown->coded && !(fabs(shown->matrix[0][0] - cases[i].first) < 2e-3))
            fail_msg("%s: %g", cases[i].members, shown->matrix[0][0]);
        shd_request_drop(request);
    }
}

static void curves_are_their_own_inverses(void **state) {
    (void)state;
    for (int t = SHD_TRANSFER_LINEAR; t <= SHD_TRANSFER_REC1886; t++)
        for (double x = -2; x <= 2; x += 0.01) {
            double back = shd_curve_decode((shd_transfer)t, shd_curve_encode((shd_transfer)t, x));
            assert_true(fabs(back - x) < 1e-6); /* sRGB's two parts meet to 1e-8 */
        }
}

/* A dot product of unit vectors may be more than 1. */
static void angles_of_rounded_cosines_are_angles(void **state) {
    (void)state;
    for (int sign = -1; sign <= 1; sign += 2) {
        const shd_angle angle = shd_angle_of(sign * (1 + 0x1p-50));
        assert_true(angle.cosine == sign && angle.sine == 0);
    }
}

static void bounds_are_printed_rounded_up_within_their_budget(void **state) {
    (void)state;
    static const struct {
        double bound, budget;
        const char *text;
    } cases[] = {{0, INFINITY, "0"},
                 {1, INFINITY, "1"},
                 {255, INFINITY, "255"},
                 {2.04e-6, INFINITY, "2.1e-06"},
                 {0.011, INFINITY, "0.011"},
                 {0.0111, INFINITY, "0.012"},
                 {0.995, INFINITY, "1"},
                 {9.91, INFINITY, "10"},
                 {1e-7, INFINITY, "1e-07"},
                 {2e-6, INFINITY, "2e-06"},
                 {0.5001, INFINITY, "0.51"},
                 {12.5, INFINITY, "13"},
                 {1.129, 1.13, "1.13"},
                 {1.129, 1.129, "1.129"},
                 {0.99991, 0.99995, "0.99991"},
                 {1.0 / 3, 1.0 / 3, "0.3333333333333333"}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[SHD_BOUND_TEXT];
        shd_print_bound(cases[i].bound, cases[i].budget, text);
        assert_string_equal(text, cases[i].text);
    }
    uint64_t random = 1;
    for (int i = 0; i < 100000; i++) {
        char text[SHD_BOUND_TEXT];
        random = random * 6364136223846793005u + 1442695040888963407u;
        const double bound = ldexp((double)(random >> 11), -(int)(random >> 58) - 30),
                     budget = bound * (1 + ldexp(1, -(int)(random >> 8 & 63)));
        shd_print_bound(bound, budget, text);
        const double told = strtod(text, NULL);
        if (!(told >= bound && told <= budget))
            fail_msg("%.17g of %.17g is told as %s", bound, budget, text);
    }
}

/* ---- Budgets. ---- */

#define LIGHTS                                                                                     \
    "\"lights\": [{\"type\": \"point\"}, {\"type\": \"point\", \"intensity\": 1e-5, "              \
    "\"position\": [0, 4, 0]}, {\"type\": \"point\", \"intensity\": 1e-9}]"

static void budgets_choose_what_is_cheapest(void **state) {
    static const struct {
        const char *members;
        shd_tier tier;
        size_t lights;
        bool drops;
    } cases[] = {
        {LIGHTS ", \"accuracy\": {\"maxError\": 0.5}", SHD_STANDARD, 1, true},
        {LIGHTS ", \"accuracy\": {\"maxError\": 0.001, \"metric\": \"linear\"}", SHD_STANDARD, 1,
         true},
        {LIGHTS ", \"accuracy\": {\"maxError\": 0.001, \"metric\": \"linear\"}, \"image\": "
                "{\"samples\": 1}",
         SHD_STANDARD, 1, true},
        {LIGHTS ", \"accuracy\": {\"maxError\": 1e-5, \"metric\": \"linear\"}", SHD_STANDARD, 2,
         true},
        {LIGHTS ", \"accuracy\": {\"maxError\": 5e-7, \"metric\": \"linear\"}", SHD_EXACT, 3,
         false},
        {LIGHTS ", \"accuracy\": {\"maxError\": 2, \"metric\": \"code\"}", SHD_STANDARD, 1, true},
        /* A code of a picture that differs at all may differ by one. */
        {LIGHTS ", \"accuracy\": {\"maxError\": 0.9, \"metric\": \"code\"}", SHD_EXACT, 3, false},
        /* Nothing is known of HSV's codes, but of how colors look. */
        {LIGHTS ", \"output\": {\"colorSpace\": \"HSV\"}, \"accuracy\": {\"maxError\": 2, "
                "\"metric\": \"code\"}",
         SHD_EXACT, 3, false},
        {LIGHTS ", \"output\": {\"colorSpace\": \"HSV\"}, \"accuracy\": {\"maxError\": 0.5}",
         SHD_STANDARD, 1, true},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_request *request = read_with(*state, cases[i].members);
        shd_error error;
        assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error), SHD_OK);
        const shd_plan *plan = request->rendering.plan;
        if (plan->tier != cases[i].tier || plan->light_count != cases[i].lights)
            fail_msg("%s: %s", cases[i].members, plan->summary);
        if (cases[i].drops && plan->light_count < 3)
            assert_int_equal(plan->drops[2], SHD_DROP_BUDGET);
        assert_true(plan->dropped > 0 || !cases[i].drops);
        const shd_accuracy *accuracy = &request->scene->accuracy;
        double bound = accuracy->metric == SHD_LINEAR ? plan->bound.linear
                       : accuracy->metric == SHD_CODE ? plan->bound.code
                                                      : plan->bound.delta_e;
        assert_true(bound <= accuracy->max_error);
        /* Most of the budget is used where something can be left out. */
        if (cases[i].drops && accuracy->metric != SHD_CODE)
            assert_true(bound > accuracy->max_error / 3);
        shd_request_drop(request);
    }
}

/* What is brighter than any code is not, where it covers a part of a pixel. */
static void pixels_that_bright_light_covers_a_part_of_count_in_codes(void **state) {
    shd_request *request =
        read_with(*state, "\"background\": [0, 0, 0], \"ambient\": 100, " LIGHTS
                          ", \"accuracy\": {\"maxError\": 0.1, \"metric\": \"linear\"}");
    shd_error error;
    assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error), SHD_OK);
    assert_true(request->rendering.plan->bound.code >= 1);
    shd_request_drop(request);
}

/* Whatever their last digits are. */
static void budgets_that_are_easily_met_take_the_fastest_tier(void **state) {
    for (int i = 10; i < 300; i++) {
        char members[512];
        snprintf(members, sizeof members, LIGHTS ", \"accuracy\": {\"maxError\": %.17g}", i * 0.01);
        shd_request *request = read_with(*state, members);
        shd_error error;
        assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error), SHD_OK);
        if (request->rendering.plan->tier != SHD_STANDARD)
            fail_msg("%s: %s", members, request->rendering.plan->summary);
        shd_request_drop(request);
    }
}

static void budgets_that_nothing_meets_say_what_is_reached(void **state) {
    shd_request *request =
        read_with(*state, "\"accuracy\": {\"maxError\": 1e-9, \"metric\": \"linear\"}");
    shd_error error;
    assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error), SHD_SCENE);
    assert_string_equal(error.path, "/accuracy/maxError");
    assert_non_null(strstr(error.text, "`exact` reaches 2.4e-07"));
    shd_request_drop(request);
    request =
        read_with(*state, "\"accuracy\": {\"maxError\": 1, \"metric\": \"linear\"}, \"image\": "
                          "{\"width\": 33, \"height\": 33, \"samples\": 1}, \"lights\": "
                          "[{\"type\": \"point\", \"position\": [0, 0, 1], \"attenuation\": [0, 0, "
                          "1]}]");
    assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error), SHD_SCENE);
    assert_non_null(strstr(error.text, "may touch a surface"));
    shd_request_drop(request);
}

/* ---- What a budget takes. ---- */

static const char *const budgets[] = {"\"maxError\": 0.5",
                                      "\"maxError\": 0.01",
                                      "\"maxError\": 1e-4",
                                      "\"maxError\": 1e-3, \"metric\": \"linear\"",
                                      "\"maxError\": 1e-6, \"metric\": \"linear\"",
                                      "\"maxError\": 0.9, \"metric\": \"code\"",
                                      "\"maxError\": 1.5, \"metric\": \"code\""};
enum { BUDGETS = sizeof budgets / sizeof budgets[0] };

/* A scene that costs more or less to see and to light. */
static shd_request *read_budget(shd_engine *engine, const char *budget, uint64_t *random) {
    char json[1024];
    int length = snprintf(json, sizeof json,
                          "{\"accuracy\": {%s}, \"image\": {\"width\": 64, \"height\": 48, "
                          "\"samples\": %d}, \"objects\": [{\"type\": \"sphere\", \"material\": "
                          "{\"specular\": %d}}], \"lights\": [",
                          budget, 1 + 3 * (int)uniform(random, 0, 2), (int)uniform(random, 0, 2));
    const int lights = (int)uniform(random, 0, 9);
    for (int i = 0; i < lights; i++)
        length += snprintf(json + length, sizeof json - (size_t)length,
                           "%s{\"type\": \"point\", \"position\": [%.3g, 2, 3]}", i ? ", " : "",
                           uniform(random, -3, 3));
    snprintf(json + length, sizeof json - (size_t)length, "]}");
    return read_text(engine, json);
}

/* With the table of every kernel, of those that this machine cannot run too. */
static void budgets_take_the_cheapest_tier_that_meets_them(void **state) {
    uint64_t random = 4;
    int took[SHD_EXACT + 1] = {0, 0};
    for (int i = 0; i < 12 * BUDGETS; i++) {
        shd_request *request = read_budget(*state, budgets[i % BUDGETS], &random);
        const shd_scene *scene = request->scene;
        const shd_accuracy *accuracy = &scene->accuracy;
        const shd_shown *shown = NULL;
        shd_error error;
        assert_int_equal(shd_shown_make(&request->rendering, scene, &shown, &error), SHD_OK);
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
            const shd_plan *plan;
            if (shd_plan_make(scene, isa, shown, NULL, request->rendering.arena, &plan, &error))
                continue;
            const shd_kernel_cost *costs = shd_plan_kernel_costs(plan);
            took[plan->tier]++;
            /* All of the lights: what a budget leaves out comes after the choice. */
            shd_scene all = *scene;
            all.accuracy = (shd_accuracy){.tier = SHD_EXACT};
            const shd_plan *full;
            assert_int_equal(
                shd_plan_make(&all, isa, shown, NULL, request->rendering.arena, &full, &error),
                SHD_OK);
            double total[SHD_EXACT + 1];
            for (int t = 0; t <= SHD_EXACT; t++) {
                const shd_ray_cost cost = shd_plan_ray_cost(full, (shd_tier)t, costs);
                total[t] = cost.rays + cost.light;
            }
            for (int t = 0; t <= SHD_EXACT; t++) {
                all.accuracy.tier = (shd_tier)t;
                const shd_plan *asked;
                assert_int_equal(
                    shd_plan_make(&all, isa, shown, NULL, request->rendering.arena, &asked, &error),
                    SHD_OK);
                if (shd_bound_in(&asked->bound, accuracy->metric) > accuracy->max_error) continue;
                if (total[t] < total[plan->tier] ||
                    (total[t] == total[plan->tier] && t > (int)plan->tier))
                    fail_msg("%s, %s: %s would cost %g", budgets[i % BUDGETS], shd_isa_name(isa),
                             plan->summary, total[t]);
            }
        }
        shd_request_drop(request);
    }
    assert_true(took[SHD_STANDARD] > 15 && took[SHD_EXACT] > 15);
}

/* With made-up tables, of what drafts draw as the standard tier does: one sample and three lobes.
 */
static void budgets_take_exact_where_its_lights_cost_no_more(void **state) {
    static const struct {
        shd_kernel_cost costs[SHD_EXACT + 1];
        shd_tier cheap;
    } cases[] = {{{{10, 10}, {5, 5}}, SHD_EXACT},
                 {{{1, 50}, {9, 9}}, SHD_EXACT},   /* by its lobes */
                 {{{5, 5}, {5, 5}}, SHD_STANDARD}, /* its rays cost less */
                 {{{1, 1}, {9, 9}}, SHD_STANDARD}};
    shd_request *request = read_text(
        *state, "{\"lights\": [{\"type\": \"point\", \"position\": [1, 2, 3]}, {\"type\": "
                "\"point\", \"position\": [3, 2, 3]}], \"accuracy\": {\"maxError\": 1}, "
                "\"image\": {\"samples\": 1}, \"objects\": [{\"type\": \"sphere\", \"material\": "
                "{\"specular\": 0.5, \"lobes\": [{\"specular\": 0.1}, {\"specular\": 0.1}]}}]}");
    const shd_shown *shown = NULL;
    shd_error error;
    assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error), SHD_OK);
    assert_int_equal(shd_shown_make(&request->rendering, request->scene, &shown, &error), SHD_OK);
    assert_int_equal(request->rendering.plan->light_count, 2);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_choice choice;
        assert_int_equal(shd_choose(request->rendering.plan, shown, cases[i].costs,
                                    request->rendering.arena, &choice, &error),
                         SHD_OK);
        assert_int_equal(choice.tier, cases[i].cheap);
    }
    shd_request_drop(request);
}

/* ---- Many lamps. ---- */

/* Balls with so many lamps of 1/d^2 among them. */
static char *write_lamps(int lamps, int balls, const char *accuracy) {
    char *json = NULL;
    size_t size;
    FILE *out = open_memstream(&json, &size);
    assert_non_null(out);
    uint64_t random = 1;
    fprintf(
        out,
        "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": 1}, \"camera\": {\"position\": "
        "[0, 0, 9]}, \"accuracy\": {%s}, \"lights\": [",
        accuracy);
    for (int i = 0; i < lamps; i++)
        fprintf(out,
                "%s{\"type\": \"point\", \"attenuation\": [0, 0, 1], \"intensity\": 0.02, "
                "\"position\": [%.17g, %.17g, %.17g]}",
                i ? ", " : "", uniform(&random, -5, 5), uniform(&random, -4, 4),
                uniform(&random, -4, 5));
    fputs("], \"objects\": [", out);
    for (int i = 0; i < balls; i++)
        fprintf(out,
                "%s{\"type\": \"sphere\", \"radius\": 0.25, \"transform\": {\"translate\": [%.17g, "
                "%.17g, %.17g]}, \"material\": {\"specular\": 0.3, \"shininess\": 40}}",
                i ? ", " : "", uniform(&random, -3, 3), uniform(&random, -2, 2),
                uniform(&random, -3, 1));
    fputs("]}", out);
    fclose(out);
    return json;
}

static void budgets_are_met_among_many_lamps(void **state) {
    static const struct { int lamps, balls; } scenes[] = {{1024, 60}, {10000, 1}};
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        shd_bound bounds[2]; /* of exact and standard */
        static const char *const accuracies[] = {"\"tier\": \"exact\"", "\"tier\": \"standard\"",
                                                 "\"maxError\": 0.01, \"metric\": \"linear\"",
                                                 "\"maxError\": 0.5",
                                                 "\"maxError\": 1, \"metric\": \"code\""};
        for (int k = 0; k < 5; k++) {
            char *json = write_lamps(scenes[i].lamps, scenes[i].balls, accuracies[k]);
            shd_request *request = read_text(*state, json);
            shd_error error;
            if (shd_rendering_plan(&request->rendering, request->scene, &error))
                fail_msg("%s", error.text);
            if (k < 2) bounds[k] = request->rendering.plan->bound;
            if (k >= 2) assert_int_equal(request->rendering.plan->tier, SHD_STANDARD);
            shd_request_drop(request);
            free(json);
        }
        if (!(bounds[0].linear < 1e-5 && bounds[1].linear < 1e-3))
            fail_msg("%d lamps, %d balls: bounds of %g and %g", scenes[i].lamps, scenes[i].balls,
                     bounds[0].linear, bounds[1].linear);
    }
}

/* Where a tier saves nothing, there is no reason for less than the exact one. */
static void of_tiers_that_cost_the_same_the_exact_one_is_taken(void **state) {
    shd_request *request = read_text(*state, "{\"accuracy\": {\"maxError\": 1}, \"objects\": []}");
    shd_error error;
    assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error), SHD_OK);
    assert_int_equal(request->rendering.plan->tier, SHD_EXACT);
    shd_request_drop(request);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ciede2000_is_at_most_the_measure),
        cmocka_unit_test(curves_are_their_own_inverses),
        cmocka_unit_test(angles_of_rounded_cosines_are_angles),
        cmocka_unit_test(bounds_are_printed_rounded_up_within_their_budget),
        cmocka_unit_test(outputs_are_known_by_their_curves),
        cmocka_unit_test(budgets_choose_what_is_cheapest),
        cmocka_unit_test(pixels_that_bright_light_covers_a_part_of_count_in_codes),
        cmocka_unit_test(budgets_that_are_easily_met_take_the_fastest_tier),
        cmocka_unit_test(budgets_that_nothing_meets_say_what_is_reached),
        cmocka_unit_test(budgets_take_the_cheapest_tier_that_meets_them),
        cmocka_unit_test(budgets_take_exact_where_its_lights_cost_no_more),
        cmocka_unit_test(budgets_are_met_among_many_lamps),
        cmocka_unit_test(of_tiers_that_cost_the_same_the_exact_one_is_taken),
    };
    return cmocka_run_group_tests(tests, start, stop);
}
