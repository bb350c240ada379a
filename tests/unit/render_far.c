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
            "{\"type\": \"point\", \"position\": [30, 0.01, 0], \"intensity\": 0.01}]}");
    fclose(out);
    shd_request *request;
    assert_int_equal(shd_request_new(engine, &request, NULL), SHD_OK);
    if (shd_request_read(request, json, size, SHD_PNG))
        fail_msg("%s", shd_request_report(request)->errors[0].detail);
    free(json);
    return request;
}

/* The diffuse light of a lamp on the plane. */
static double shown_by(const shd_plan_light *light, shd_vec3 at) {
    const shd_vec3 path = shd_sub(light->position, at);
    const double d = shd_length(path);
    return light->color[0] * shd_attenuation(light, d) * path.y / d;
}

/* What is taken of the dome by the room. Returns how many lights stay. */
static size_t gather(const shd_plan *plan, double room, size_t points, shd_far *far,
                     uint32_t *lights, double *left) {
    const shd_patch patch = {
        .center = {0, 0, 0}, .radius = 0.5, .axis = {0, 1, 0}, .cos_spread = 1 - 0x1p-21};
    double costs[LAMPS + OTHERS];
    for (uint32_t j = 0; j < plan->light_count; j++) lights[j] = j;
    *left = room;
    return shd_far_gather(plan, &plan->materials[plan->objects[0].material], &patch, points, left,
                          lights, plan->light_count, costs, far);
}

static void lamps_from_afar_are_told_within_the_room(void **state) {
    shd_request *request = read_dome(*state, "0.3");
    const shd_plan *plan;
    assert_true(
        shd_plan_draft(request->scene, SHD_PORTABLE, true, NULL, request->rendering.arena, &plan));
    assert_int_equal(plan->light_count, LAMPS + OTHERS);
    shd_far far;
    uint32_t lights[LAMPS + OTHERS];
    for (double room = 3e-6; room < 1; room *= 10) {
        double left;
        const size_t kept = gather(plan, room, 1024, &far, lights, &left);
        assert_int_equal(kept + far.lights, LAMPS + OTHERS);
        assert_true(left >= 0 && left <= room);
        if (!far.lights) continue;
        bool stays[LAMPS + OTHERS] = {false};
        for (size_t i = 0; i < kept; i++) stays[lights[i]] = true;
        float x[] = {0, 0.45f, -0.3f, 0}, z[] = {0, 0.1f, 0.35f, -0.5f}, zero[4] = {0},
              one[] = {1, 1, 1, 1}, sums[3][4] = {{0}}, *rows[] = {sums[0], sums[1], sums[2]};
        shd_plan frame = *plan;
        frame.origin = (shd_vec3){0, 0, 0};
        frame.scale = 1;
        shd_far_light(&frame, &far, 4, (const float *[]){x, zero, z}, (const float *[3]){NULL},
                      (const float *[]){zero, one, zero}, rows);
        for (int i = 0; i < 4; i++) {
            double wanted = 0;
            for (size_t j = 0; j < LAMPS + OTHERS; j++)
                if (!stays[j])
                    wanted += shown_by(&plan->lights[j], (shd_vec3){(double)x[i], 0, (double)z[i]});
            if (!(0.5 * fabs((double)sums[0][i] - wanted) <= room - left))
                fail_msg("room %g, %g taken: %g off", room, room - left,
                         0.5 * fabs((double)sums[0][i] - wanted));
        }
        for (size_t j = LAMPS; j < LAMPS + OTHERS; j++)
            if (!stays[j] && room < 1e-3) fail_msg("room %g: light %zu is taken", room, j);
    }
    assert_int_equal(far.lights, LAMPS + 1); /* with much room: but for four of the others */
    shd_request_drop(request);
}

static void few_points_and_no_room_take_none(void **state) {
    shd_request *request = read_dome(*state, "0");
    const shd_plan *plan;
    assert_true(
        shd_plan_draft(request->scene, SHD_PORTABLE, true, NULL, request->rendering.arena, &plan));
    shd_far far;
    uint32_t lights[LAMPS + OTHERS];
    double left;
    assert_int_equal(gather(plan, 0, 1024, &far, lights, &left), LAMPS + OTHERS);
    assert_int_equal(gather(plan, 1, SHD_FAR_LEAST - 1, &far, lights, &left), LAMPS + OTHERS);
    assert_int_equal(far.lights, 0);
    assert_true(gather(plan, 1e-4, SHD_FAR_LEAST, &far, lights, &left) < OTHERS);
    shd_request_drop(request);
}

static int start(void **state) {
    shd_engine_options options = shd_engine_defaults();
    shd_engine *engine;
    options.threads = 1;
    assert_int_equal(shd_engine_new(&options, &engine, NULL), SHD_OK);
    *state = engine;
    return 0;
}

static int stop(void **state) {
    shd_engine_drop(*state);
    return 0;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(lamps_from_afar_are_told_within_the_room),
        cmocka_unit_test(few_points_and_no_room_take_none),
    };
    return cmocka_run_group_tests(tests, start, stop);
}
