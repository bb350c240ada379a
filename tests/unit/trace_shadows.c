/* How much of a light with a shape arrives: what stands before half of it takes half. */
#include "see.h"
#include "trace/shadows.h"

/* The surface point and a light of the plan, which a test gives a shape. */
typedef struct place {
    seen s;
    shd_plan plan;
    shd_plan_light light;
    shd_light shape;
    shd_shadows shadows;
    shd_surface at;
} place;

static void make_place(shd_engine *engine, const char *objects, shd_light shape, place *p) {
    char *json =
        text_of("{\"image\": {\"width\": 64, \"height\": 64}, \"trace\": {\"shadows\": "
                "true, \"shadowSamples\": 1024}, \"lights\": [{\"type\": \"point\", "
                "\"position\": [%.17g, %.17g, %.17g]}], \"objects\": [{\"type\": \"plane\"}%s]}",
                shape.position.x, shape.position.y, shape.position.z, objects);
    p->s = see(engine, json, SHD_PORTABLE);
    free(json);
    p->plan = *p->s.request->rendering.plan;
    assert_int_equal(p->plan.light_count, 1);
    p->shape = shape;
    p->light = p->plan.lights[0];
    p->light.shape = &p->shape;
    p->plan.lights = &p->light;
    shd_arena *arena = p->s.request->rendering.arena;
    const shd_caster *caster = shd_caster_new(p->s.sight, arena);
    assert_non_null(caster);
    assert_true(shd_shadows_make(&p->plan, caster, arena, &p->shadows));
    p->at = (shd_surface){.position = {0, 0, 0},
                          .normal = {0, 1, 0},
                          .view = {0, 1, 0},
                          .mirror = {0, 1, 0},
                          .material = &p->plan.materials[p->plan.objects[0].material]};
}

static double share_of(shd_engine *engine, const char *objects, shd_light shape) {
    place p;
    double share[3];
    make_place(engine, objects, shape, &p);
    p.shadows.share(p.shadows.context, &p.light, &p.at, share);
    assert_true(share[0] == share[1] && share[1] == share[2]);
    drop_seen(&p.s);
    return share[0];
}

/* A wall over x < 0 between the floor and the light; its rim is above the origin. */
#define HALF                                                                                       \
    ", {\"type\": \"box\", \"size\": [20, 0.1, 20], \"transform\": {\"translate\": [-10, 2, 0]}}"
#define ROOF   ", {\"type\": \"disc\", \"radius\": 9, \"transform\": {\"translate\": [0, 2, 0]}}"
#define BESIDE ", {\"type\": \"sphere\", \"transform\": {\"translate\": [40, 2, 0]}}"

static void half_of_a_light_is_hidden_by_what_is_before_half_of_it(void **state) {
    const shd_light rect = {.type = SHD_LIGHT_RECT,
                            .position = {0, 4, 0},
                            .direction = {0, -1, 0},
                            .across = {1, 0, 0},
                            .up = {0, 0, 1},
                            .size = {2, 1}},
                    disc = {.type = SHD_LIGHT_DISC,
                            .position = {0, 4, 0},
                            .direction = {0, -1, 0},
                            .radius = 1},
                    ball = {.type = SHD_LIGHT_SPHERE, .position = {0, 4, 0}, .radius = 1};
    const shd_light lights[] = {rect, disc, ball};
    for (size_t k = 0; k < 3; k++) {
        assert_true(share_of(*state, "", lights[k]) == 1);
        assert_true(share_of(*state, BESIDE, lights[k]) == 1);
        assert_true(share_of(*state, ROOF, lights[k]) == 0);
        /* 1024 points in a square that a line halves: it errs by the length of the rim over their
         * distance at most, some 1/32. */
        assert_true(fabs(share_of(*state, HALF, lights[k]) - 0.5) < 0.02);
    }
}

/* In the shadow of a disc of half a round light's radius, half way to it, the light is a ring
 * around the part of it that is hidden. The weights are cosine^2 / distance^2, so that the share is
 * 1 - F(hidden) / F(all) with F = sin^2 of the half-angle. */
static void a_disc_before_the_middle_leaves_a_ring(void **state) {
    const shd_light disc = {
        .type = SHD_LIGHT_DISC, .position = {0, 4, 0}, .direction = {0, -1, 0}, .radius = 2};
    const double hidden = 1.0 / (1 + 16.0), all = 4.0 / (4 + 16.0); /* tan is 1/4, and 1/2 */
    const double share = share_of(*state,
                                  ", {\"type\": \"disc\", \"radius\": 0.5, \"transform\": "
                                  "{\"translate\": [0, 2, 0]}}",
                                  disc);
    assert_true(fabs(share - (1 - hidden / all)) < 0.002); /* one point is 0.001 */
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(half_of_a_light_is_hidden_by_what_is_before_half_of_it),
        cmocka_unit_test(a_disc_before_the_middle_leaves_a_ring),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
