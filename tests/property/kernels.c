/* Every variant of the kernels gives the same bits; in the standard tier those that fuse. */
#include "property/pieces.h"

static const char *const shapes[] = {"sphere", "box", "cylinder", "cone", "torus", "disc", "plane"};
enum { SHAPES = sizeof shapes / sizeof shapes[0] };

static void write_color(FILE *out, const char *name, uint64_t *random) {
    fprintf(out, "\"%s\": [%.17g, %.17g, %.17g]", name, uniform(random, 0, 1),
            uniform(random, 0, 1), uniform(random, 0, 1));
}

static void write_light(FILE *out, uint64_t *random) {
    static const char *const types[] = {"point", "spot", "directional"};
    int type = below(random, 3);
    shd_vec3 from = shd_scale(random_direction(random), uniform(random, 0.5, 8));
    fprintf(out, "{\"type\": \"%s\", ", types[type]);
    write_color(out, "color", random);
    if (type != 2) {
        fputs(", ", out);
        write_vector(out, "position", from);
        fprintf(out, ", \"attenuation\": [1, %.17g, %.17g]", uniform(random, 0, 1),
                uniform(random, 0, 1));
    }
    if (type != 0) {
        fputs(", ", out);
        write_vector(out, "direction", shd_scale(from, -1));
    }
    if (type == 1)
        fprintf(out, ", \"angle\": %.17g, \"penumbra\": %.17g, \"exponent\": %.17g",
                uniform(random, 1, 80), uniform(random, 0, 1), uniform(random, 0, 20));
    fputs("}", out);
}

static const char *const tiers[] = {"exact", "standard", "standard", "draft"};

/* Shapes of any kind, half of them cut by others, seen from near, far or inside. */
static char *scene(uint64_t seed) {
    uint64_t random = seed * 31 + 7;
    bool ortho = below(&random, 3) == 0;
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"accuracy\": "
            "{\"tier\": \"%s\"}, \"camera\": {\"type\": \"%s\", ",
            40 + below(&random, 70), 30 + below(&random, 40),
            seed % 10 ? 1 + below(&random, 5) : 16, tiers[below(&random, 4)],
            ortho ? "orthographic" : "perspective");
    write_vector(
        w.out, "position",
        shd_scale(random_direction(&random), uniform(&random, 0.1, below(&random, 2) ? 4 : 40)));
    fputs("}, \"lights\": [", w.out);
    for (int i = 0, count = 1 + below(&random, 6); i < count; i++) {
        fputs(i ? ", " : "", w.out);
        write_light(w.out, &random);
    }
    fputs("], \"objects\": [", w.out);
    for (int i = 0, count = 1 + below(&random, 9); i < count; i++) {
        shd_affine turn = random_rotation(&random);
        shd_affine size = scaling(uniform(&random, 0.2, 1.2), uniform(&random, 0.2, 1.2),
                                  uniform(&random, 0.2, 1.2));
        shd_affine map = shd_compose(&turn, &size);
        map.origin = shd_scale(random_direction(&random), uniform(&random, 0, 1.5));
        fprintf(w.out, "%s{\"type\": \"%s\", ", i ? ", " : "", shapes[below(&random, SHAPES)]);
        write_transform(w.out, &map);
        fputs(", \"material\": {", w.out);
        write_color(w.out, "diffuse", &random);
        fprintf(w.out, ", \"specular\": %.17g, \"shininess\": %.17g, \"side\": \"%s\"}}",
                uniform(&random, 0, 1), pow(10, uniform(&random, -1, 4)),
                below(&random, 4) ? "both" : "front");
    }
    fputs("]}", w.out);
    return finish(&w);
}

/* A request with its plan, whose kernels are of this variant. */
static shd_request *plan_for(shd_engine *engine, const char *json, shd_isa isa, shd_sight **sight) {
    shd_request *request = read_scene(engine, json);
    shd_error error = {.status = SHD_OK};
    shd_status status = shd_plan_make(request->scene, isa, NULL, NULL, request->rendering.arena,
                                      &request->rendering.plan, &error);
    assert_int_equal(status, SHD_OK);
    if (shd_sight_new(request->rendering.plan, NULL, request->rendering.arena, sight, &error))
        fail_msg("%s: %s", error.path, error.text);
    return request;
}

static drawn film_by(shd_engine *engine, const char *json, shd_isa isa) {
    shd_sight *sight;
    drawn d = {.request = plan_for(engine, json, isa, &sight)};
    shd_error error = {.status = SHD_OK};
    shd_status status = shd_film_render(&d.request->rendering, sight, NULL, NULL, &d.film, &error);
    if (status != SHD_OK) fail_msg("%s: %s", error.path, error.text);
    return d;
}

static void every_variant_gives_the_same_floats(void **state) {
    for (uint64_t seed = 1; seed <= 120; seed++) {
        char *json = scene(seed);
        shd_isa first = SHD_PORTABLE;
        while (!strstr(json, "\"exact\"") && !shd_isa_fuses(first)) first++;
        if (!shd_cpu_has(first)) skip();
        drawn wanted = film_by(*state, json, first);
        for (shd_isa isa = first + 1; isa < SHD_ISA_COUNT; isa++) {
            if (!shd_cpu_has(isa)) continue;
            drawn other = film_by(*state, json, isa);
            if (!same_film(&wanted, &other))
                fail_msg("%s differs in\n%.2000s", shd_isa_name(isa), json);
            drop_drawn(&other);
        }
        drop_drawn(&wanted);
        free(json);
    }
}

/* Where nothing fuses, the standard tier rounds products, too: other bits, and so another tag. A
 * budget's tier depends on what each kernel's lights cost. */
static void check_tags(const char *json, bool budget) {
    char tags[SHD_ISA_COUNT][64];
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
        if (!shd_cpu_has(isa)) continue;
        shd_engine_options options = shd_engine_defaults();
        options.threads = 1;
        options.kernel = shd_isa_name(isa);
        shd_engine *engine;
        assert_int_equal(shd_engine_new(&options, &engine, NULL), SHD_OK);
        shd_request *request = read_scene(engine, json);
        snprintf(tags[isa], sizeof tags[isa], "%s", shd_request_etag(request));
        shd_request_drop(request);
        shd_engine_drop(engine);
        for (shd_isa other = SHD_PORTABLE; other < isa; other++)
            if (shd_cpu_has(other))
                assert_int_equal(!strcmp(tags[isa], tags[other]),
                                 !budget && shd_isa_fuses(isa) && shd_isa_fuses(other));
    }
}

static void what_lights_otherwise_has_a_tag_of_its_own(void **state) {
    (void)state;
    char *json = scene(2);
    check_tags(json, false);
    free(json);
    check_tags("{\"objects\": [{\"type\": \"sphere\"}], \"accuracy\": {\"maxError\": 1}}", true);
}

static void an_engine_takes_the_variant_it_is_told(void **state) {
    (void)state;
    shd_isa portable = SHD_ISA_COUNT; /* by that name on ARM, too, whose own is "neon" */
    assert_true(shd_isa_find("portable", &portable) && portable == SHD_PORTABLE);
    for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++) {
        shd_engine_options options = shd_engine_defaults();
        options.threads = 1;
        options.kernel = shd_isa_name(isa);
        shd_engine *engine;
        shd_error error;
        shd_status status = shd_engine_new(&options, &engine, &error);
        assert_int_equal(status, shd_cpu_has(isa) ? SHD_OK : SHD_CONFIG);
        if (status != SHD_OK) continue;
        char *json = scene(1);
        drawn d = film_of(engine, json);
        assert_int_equal(d.request->rendering.plan->isa, isa);
        drop_drawn(&d);
        free(json);
        shd_engine_drop(engine);
    }
}

static void the_plan_takes_the_widest_variant_there_is(void **state) {
    char *json = scene(1);
    drawn d = film_of(*state, json);
    assert_int_equal(d.request->rendering.plan->isa, shd_cpu_best());
    for (shd_isa isa = shd_cpu_best() + 1; isa < SHD_ISA_COUNT; isa++)
        assert_false(shd_cpu_has(isa));
    drop_drawn(&d);
    free(json);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_variant_gives_the_same_floats),
        cmocka_unit_test(what_lights_otherwise_has_a_tag_of_its_own),
        cmocka_unit_test(an_engine_takes_the_variant_it_is_told),
        cmocka_unit_test(the_plan_takes_the_widest_variant_there_is),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
