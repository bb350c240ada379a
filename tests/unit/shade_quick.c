/* Quick sums of lamps against sums in f64. */
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
#include "plan/bunches.h"
#include "plan/parts.h"
#include "render/request.h"
#include "shade/lighting.h"
#include "shade/quick.h"

enum {
    LAMPS = 301,
    POINTS = 61,
    TURNED = 32 /* points on the side of -x */,
    ROOM = POINTS + SHD_LANES,
    ROWS = 6
};

static double uniform(uint64_t *random, double low, double high) {
    *random = *random * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * ((double)(*random >> 11) * 0x1p-53);
}

/* Lamps around a sphere. Every eleventh is a spot, falls off in another way, is of negative light,
 * or is so far away that f32 cannot hold it: these are no quick ones. */
static shd_request *read_lamps(shd_engine *engine, const char *color, double shininess) {
    char *json = NULL;
    size_t size = 0;
    uint64_t random = 20;
    FILE *out = open_memstream(&json, &size);
    fprintf(out,
            "{\"objects\": [{\"type\": \"sphere\", \"material\": {\"diffuse\": 0.5, \"specular\": "
            "0.4, \"shininess\": %g}}], \"lights\": [",
            shininess);
    for (int i = 0; i < LAMPS; i++) {
        double at[3];
        for (int c = 0; c < 3; c++) at[c] = uniform(&random, 0, 1) < 0.5 ? -1 : 1;
        for (int c = 0; c < 3; c++) at[c] *= uniform(&random, 1.01, 5);
        const bool odd = i % 11 == 7;
        fprintf(out, "%s{\"type\": \"%s\", \"color\": %s, \"attenuation\": [0, %g, 1], ",
                i ? ", " : "", odd && i % 4 == 0 ? "spot" : "point",
                odd && i % 4 == 1 ? "[-1, 0, 1]" : color, odd && i % 4 == 2 ? 0.5 : 0.0);
        fprintf(out, "\"position\": [%.17g, %.17g, %.17g]}", at[0], at[1], at[2]);
    }
    fprintf(out, "]}");
    fclose(out);
    shd_request *request = read_document(engine, json, size);
    free(json);
    return request;
}

/* Points of the sphere, of which two are in lamps' planes, to f32's rounding. */
typedef struct points {
    float position[3][ROOM], normal[3][ROOM], mirror[3][ROOM];
    double exact[3][3][ROOM]; /* position, normal, view; of what f32 holds */
} points;

static void make_points(const shd_plan *plan, points *p) {
    uint64_t random = 7;
    for (int i = 0; i < ROOM; i++) {
        shd_vec3 n = {uniform(&random, -1, 1), uniform(&random, -1, 1), uniform(&random, -1, 1)},
                 v = {uniform(&random, -1, 1), uniform(&random, -1, 1), uniform(&random, -1, 1)};
        if (i < TURNED) n.x = -10;
        assert_true(shd_normalize(n, &n) && shd_normalize(v, &v));
        const double m = 2 * shd_dot(n, v);
        const double at[3] = {n.x, n.y, n.z}, to[3] = {v.x, v.y, v.z},
                     origin[3] = {plan->origin.x, plan->origin.y, plan->origin.z};
        for (int c = 0; c < 3; c++) {
            p->position[c][i] = (float)((at[c] - origin[c]) * plan->scale);
            p->normal[c][i] = (float)at[c];
            p->mirror[c][i] = (float)(m * at[c] - to[c]);
            p->exact[0][c][i] = at[c];
            p->exact[1][c][i] = at[c];
            p->exact[2][c][i] = to[c];
        }
    }
}

/* The same sums by the standard tier's kernels, or in f64 (`off` is nothing then), and quick ones:
 * these are off by no more than they tell, beside what f32 is. */
static void compare_sums(const shd_plan *plan, shd_arena *arena) {
    const shd_lighting *lighting = shd_lighting_new(plan, NULL, arena);
    const shd_plan_material *material = &plan->materials[plan->objects[0].material];
    assert_non_null(lighting);
    assert_true(shd_is_quick(lighting, material));
    uint32_t all[LAMPS], quick[LAMPS], others[LAMPS];
    for (uint32_t k = 0; k < LAMPS; k++) all[k] = k;
    const size_t some = shd_part_quick(lighting, all, LAMPS, quick, others);
    assert_true(some > LAMPS * 9 / 10 && some < LAMPS);
    static points p;
    make_points(plan, &p);
    static float plain[ROWS][ROOM], sums[ROWS][ROOM], dull[ROWS][ROOM];
    uint8_t edges[ROOM] = {0}, marked[ROOM] = {0};
    float *rows[3][ROWS];
    memset(dull, 0, sizeof dull);
    for (int k = 0; k < ROWS; k++)
        rows[0][k] = plain[k], rows[1][k] = sums[k], rows[2][k] = dull[k];
    const shd_points32 at = {.count = POINTS,
                             .position = {p.position[0], p.position[1], p.position[2]},
                             .normal = {p.normal[0], p.normal[1], p.normal[2]},
                             .mirror = {p.mirror[0], p.mirror[1], p.mirror[2]}};
    shd_light_sums32(lighting, material, all, LAMPS, &at, rows[0], rows[0] + 3, edges);
    shd_light_lamps32(lighting, material, NULL, LAMPS, &at, rows[1], rows[1] + 3, marked, NULL);
    shd_light_quick32(lighting, material, quick, some, &at, rows[2], NULL, NULL);
    shd_light_sums32(lighting, material, others, LAMPS - some, &at, rows[2], rows[2] + 3, marked);
    assert_memory_equal(edges, marked, POINTS);
    const double off = shd_quick_off(material->lobes->shininess);
    double most = 0;
    for (int i = 0; i < POINTS; i++)
        for (int c = 0; c < (plan->grey_lights ? 1 : 3); c++) {
            const double d = fabs((double)plain[c][i] - (double)sums[c][i]),
                         s = fabs((double)plain[3 + c][i] - (double)sums[3 + c][i]);
            if (edges[i]) continue;
            most = fmax(most, s / (double)plain[3 + c][i]);
            if (!(d <= shd_quick_off(0) * (double)plain[c][i]) ||
                !(s <= off * (double)plain[3 + c][i] + 1e-7))
                fail_msg("point %d, channel %d: %g, %g off", i, c, d, s);
        }
    if (!(most > 0)) fail_msg("nothing is off: sums are the same ones");
}

static void quick_sums_are_as_near_as_they_tell(void **state) {
    static const char *const colors[] = {"1", "[1, 0.5, 0.2]"};
    for (int round = 0; round < 4; round++) {
        shd_request *request = read_lamps(*state, colors[round % 2], round < 2 ? 8 : 50);
        shd_arena *arena = request->rendering.arena;
        for (int isa = 0; isa < SHD_ISA_COUNT; isa++) {
            const shd_plan *draft;
            if (!shd_cpu_has((shd_isa)isa)) continue;
            assert_true(shd_plan_draft(request->scene, (shd_isa)isa, true, NULL, arena, &draft));
            shd_plan plan = *draft;
            plan.tier = SHD_STANDARD;
            plan.drop_tolerance = 1e-4;
            plan.drop_relative = 2e-3;
            assert_true(shd_bunches_new(&plan, arena, &plan.bunches));
            compare_sums(&plan, arena);
        }
        shd_request_drop(request);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(quick_sums_are_as_near_as_they_tell),
    };
    return cmocka_run_group_tests(tests, start_engine, stop_engine);
}
