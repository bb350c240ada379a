/* What plans are told to cost, and at most. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include <cmocka.h>

#include "engine_support.h"
#include "plan/cost.h"
#include "render/planning.h"
#include "render/request.h"
#include "render/show/shown.h"

static double uniform(uint64_t *random, double low, double high) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(*random >> 11) * 0x1p-53);
}

/* Any shapes: before the eye, around it and behind it. */
static void write_objects(char *json, size_t size, uint64_t *random) {
    static const char *const shapes[] = {"sphere", "box", "cylinder", "cone", "torus", "disc"};
    size_t length = 0;
    for (int k = 0, count = 1 + (int)uniform(random, 0, 4); k < count; k++) {
        double scale[3], turn[3], at[3];
        for (int c = 0; c < 3; c++) {
            scale[c] = pow(10, uniform(random, -2, 1));
            turn[c] = uniform(random, 0, 180);
            at[c] = c == 2 ? uniform(random, -20, 7) : uniform(random, -4, 4);
        }
        length += (size_t)snprintf(
            json + length, size - length,
            "%s{\"type\": \"%s\", \"transform\": {\"scale\": [%g, %g, %g], \"rotate\": [%g, %g, "
            "%g], \"translate\": [%g, %g, %g]}}",
            k ? ", " : "", shapes[(int)uniform(random, 0, 6)], scale[0], scale[1], scale[2],
            turn[0], turn[1], turn[2], at[0], at[1], at[2]);
    }
}

static shd_request *read_scene(shd_engine *engine, int turn, uint64_t *random) {
    char objects[2048], json[4096];
    write_objects(objects, sizeof objects, random);
    snprintf(json, sizeof json,
             "{\"camera\": {\"position\": [0, 0, 5], \"target\": [0, 0, 0]%s}, \"image\": "
             "{\"samples\": %d}, \"lights\": [{\"type\": \"point\", \"position\": [1, 2, 3]}], "
             "\"objects\": [%s%s]}",
             turn % 5 ? "" : ", \"type\": \"orthographic\", \"height\": 4", turn % 2 ? 1 : 4,
             turn % 7 ? "" : "{\"type\": \"plane\"}, ", objects);
    return read_document(engine, json, strlen(json));
}

static void no_plan_costs_more_than_the_most(void **state) {
    uint64_t random = 9;
    double closest = INFINITY;
    for (int i = 0; i < 400; i++) {
        shd_request *request = read_scene(*state, i, &random);
        const shd_shown *shown = NULL;
        const shd_plan *plan;
        shd_error error;
        assert_int_equal(shd_shown_make(&request->rendering, request->scene, &shown, &error),
                         SHD_OK);
        assert_int_equal(shd_plan_make(request->scene, (shd_isa)(i % SHD_ISA_COUNT), shown, NULL,
                                       request->rendering.arena, &plan, &error),
                         SHD_OK);
        const shd_kernel_cost *costs = shd_plan_kernel_costs(plan);
        for (int t = 0; t <= SHD_EXACT; t++) {
            const shd_ray_cost cost = shd_plan_ray_cost(plan, (shd_tier)t, costs);
            const double most = shd_plan_most_cost(plan, (shd_tier)t, costs),
                         whole = cost.rays + cost.light + cost.shadow + cost.trace;
            if (!(isfinite(most) && cost.meshes == 0 && whole <= most * (1 + 1e-12)))
                fail_msg("scene %d costs %g, and at most %g", i, whole, most);
            closest = fmin(closest, most / whole);
        }
        shd_request_drop(request);
    }
    assert_true(closest < 2);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(no_plan_costs_more_than_the_most),
    };
    return cmocka_run_group_tests(tests, start_engine, stop_engine);
}
