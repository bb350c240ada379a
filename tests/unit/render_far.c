/* Which lights of a run are lit from afar, and how far off that is. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "engine_support.h"
#include "plan/cost.h"
#include "plan/parts.h"
#include "render/request.h"
#include "render/tiles/far.h"

enum { LAMPS = 120, OTHERS = 5 };

/* A plane under lamps in a dome of radius 30, and others that may not be among them: one near by,
 * one whose highlight is seen in the middle, a spot at whose rim points are, one of negative light,
 * and one that is too low. */
static shd_request *read_dome(shd_engine *engine, const char *specular) {
    char *json = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&json, &size);
    fprintf(out,
            "{\"camera\": {\"position\": [0, 4, 0], \"target\": [0, 0, 0], \"up\": [0, 0, 1]},"
            "\"objects\": [{\"type\": \"plane\", \"material\": {\"diffuse\": 0.5, "
            "\"specular\": %s, \"shininess\": 400}}], \"lights\": [",
            specular);
    for (int i = 0; i < LAMPS; i++) {
        const double turn = i * 2.4, up = 0.3 + 0.5 * i / LAMPS, aside = sqrt(1 - up * up);
        const double x = 30 * aside * cos(turn), y = 30 * up, z = 30 * aside * sin(turn);
        /* A third of them are spots that hold all points within their cones, or shine evenly. */
        fprintf(out, "{\"type\": \"%s\", \"attenuation\": [0, 0, 1], ", i % 3 ? "point" : "spot");
        if (i % 3 == 0) fprintf(out, "\"direction\": [%g, %g, %g], ", -x, -y, -z);
        fprintf(out, "\"intensity\": 10, \"position\": [%.17g, %.17g, %.17g]}, ", x, y, z);
    }
    fprintf(out,
            "{\"type\": \"point\", \"position\": [0, 0.5, 0], \"intensity\": 0.1}, "
            "{\"type\": \"point\", \"position\": [0, 30, 0], \"intensity\": 10, \"attenuation\": "
            "[0, 0, 1]}, "
            "{\"type\": \"spot\", \"position\": [0, 25, 9], \"direction\": [0, -25, -9], "
            "\"angle\": 0.2, \"intensity\": 0.01}, "
            "{\"type\": \"point\", \"position\": [9, 30, 0], \"color\": [-0.01, 0, 0]}, "
            "{\"type\": \"point\", \"position\": [30, 0.01, 0], \"intensity\": 10}]}");
    fclose(out);
    shd_request *request = read_document(engine, json, size);
    free(json);
    return request;
}

/* The diffuse light of a lamp on the plane. */
static double shown_by(const shd_plan_light *light, shd_vec3 at) {
    const shd_vec3 path = shd_sub(light->position, at);
    const double d = shd_length(path);
    return light->color[0] * shd_attenuation(light, d) * path.y / d;
}

/* What is taken of the dome by the room, and of a quarter of the patch after that. Returns how many
 * lights stay. */
static size_t gather(shd_request *request, const shd_plan *draft, double room, size_t points,
                     shd_afar_scratch *s, uint32_t *left) {
    shd_arena *arena = request->rendering.arena;
    shd_plan plan = *draft;
    plan.drop_tolerance = room;
    assert_true(shd_bunches_new(&plan, arena, &plan.bunches));
    shd_scratch memory = {.arena = arena};
    shd_afar_lay_out(&plan, 1024, &memory, s);
    assert_false(memory.full);
    const shd_plan_material *material = &plan.materials[plan.objects[0].material];
    shd_patch patch = {
        .center = {0, 0, 0}, .radius = 0.55, .axis = {0, 1, 0}, .cos_spread = 1 - 0x1p-21};
    shd_afar *whole = &s->levels[0], *part = &s->levels[SHD_AFAR_LEVELS - 1];
    shd_afar_find(&plan, material, &patch, points, 0, false, NULL, s, whole);
    patch.center = (shd_vec3){0.1, 0, -0.05};
    patch.radius = 0.2;
    shd_afar_find(&plan, material, &patch, points, SHD_AFAR_LEVELS - 1, true, whole, s, part);
    uint32_t all[LAMPS + OTHERS];
    for (uint32_t j = 0; j < plan.light_count; j++) all[j] = j;
    assert_true(part->spent >= whole->spent && part->spent <= part->room);
    const size_t open = shd_afar_list(&plan, part, false, all, plan.light_count, s, left);
    return open + shd_afar_list(&plan, part, true, all, plan.light_count, s, left + open);
}

static void lamps_from_afar_are_told_within_the_room(void **state) {
    shd_request *request = read_dome(*state, "0.3");
    const shd_plan *plan;
    assert_true(
        shd_plan_draft(request->scene, SHD_PORTABLE, true, NULL, request->rendering.arena, &plan));
    assert_int_equal(plan->light_count, LAMPS + OTHERS);
    uint32_t lights[LAMPS + OTHERS];
    size_t taken = 0;
    for (double room = 3e-6; room < 1; room *= 10) {
        shd_afar_scratch s = {.taken = NULL};
        const size_t kept = gather(request, plan, room, 1024, &s, lights);
        const shd_afar *part = &s.levels[SHD_AFAR_LEVELS - 1];
        assert_true(kept + part->far.lights <= LAMPS + OTHERS); /* the others are left out */
        taken = LAMPS + OTHERS - kept;
        bool stays[LAMPS + OTHERS] = {false};
        for (size_t i = 0; i < kept; i++) stays[lights[i]] = true;
        float x[] = {0, 0.08f, -0.03f, 0}, z[] = {0, 0.01f, 0.05f, -0.09f}, zero[4] = {0},
              one[] = {1, 1, 1, 1}, sums[3][4] = {{0}}, *rows[] = {sums[0], sums[1], sums[2]};
        shd_plan frame = *plan;
        frame.origin = (shd_vec3){0, 0, 0};
        frame.scale = 1;
        const shd_far_kernel *kernel = shd_far_kernel_of(SHD_PORTABLE);
        kernel->light(&frame, &part->far, 4, (const float *[]){x, zero, z},
                      (const float *[3]){NULL}, (const float *[]){zero, one, zero}, rows);
        for (int i = 0; i < 4; i++) {
            double wanted = 0;
            for (size_t j = 0; j < LAMPS + OTHERS; j++)
                if (!stays[j])
                    wanted += shown_by(&plan->lights[j], (shd_vec3){(double)x[i], 0, (double)z[i]});
            const double off = 0.5 * fabs((double)sums[0][i] - wanted);
            const double told = part->spent / part->weight[0];
            if (!(off <= told + 0x1p-23 * wanted))
                fail_msg("room %g, %g taken: %g off", room, told, off);
        }
        for (size_t j = LAMPS; j < LAMPS + OTHERS; j++)
            if (!stays[j] && room < 1e-3) fail_msg("room %g: light %zu is taken", room, j);
    }
    assert_true(taken >= LAMPS); /* with much room */
    shd_request_drop(request);
}

/* Estimates know that lamps are told together, in the tiers that do so. */
static void bunches_cost_less(void **state) {
    shd_request *request = read_dome(*state, "0.3");
    const shd_plan *draft;
    assert_true(
        shd_plan_draft(request->scene, SHD_PORTABLE, true, NULL, request->rendering.arena, &draft));
    shd_plan plan = *draft;
    plan.drop_tolerance = 1e-3;
    assert_true(shd_bunches_new(&plan, request->rendering.arena, &plan.bunches));
    const shd_kernel_cost *costs = shd_plan_kernel_costs(&plan);
    assert_true(shd_plan_ray_cost(&plan, SHD_STANDARD, costs).light <
                0.5 * shd_plan_ray_cost(draft, SHD_STANDARD, costs).light);
    assert_true(shd_plan_ray_cost(&plan, SHD_EXACT, costs).light ==
                shd_plan_ray_cost(draft, SHD_EXACT, costs).light);
    shd_request_drop(request);
}

static void no_room_takes_none(void **state) {
    shd_request *request = read_dome(*state, "0");
    const shd_plan *plan;
    assert_true(
        shd_plan_draft(request->scene, SHD_PORTABLE, true, NULL, request->rendering.arena, &plan));
    uint32_t lights[LAMPS + OTHERS];
    shd_afar_scratch s = {.taken = NULL};
    assert_int_equal(gather(request, plan, 1e-300, 1024, &s, lights), LAMPS + OTHERS);
    assert_int_equal(s.levels[SHD_AFAR_LEVELS - 1].far.lights, 0);
    shd_request_drop(request);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lamps_from_afar_are_told_within_the_room),
        cmocka_unit_test(bunches_cost_less),
        cmocka_unit_test(no_room_takes_none),
    };
    return cmocka_run_group_tests(tests, start_engine, stop_engine);
}
