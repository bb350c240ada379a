/* Error bounds of what goes beyond Phong's model: each kind has one, budgets keep to it, and paths
 * of mirrors and glass tell how far they are off. */
#include "bound/light/extended.h"
#include "property/pieces.h"

static const char *const shapes[] = {"sphere", "box", "cylinder", "cone", "torus"};

static void write_extended_material(FILE *out, uint64_t *random) {
    static const char *const members[] = {
        "\"model\": \"blinn-phong\", \"specular\": 0.5, \"shininess\": 1e6",
        "\"model\": \"blinn-phong\", \"specular\": [0.9, 0.2, 0.1], \"shininess\": 0",
        "\"model\": \"phong-normalized\", \"specular\": 0.5, \"shininess\": 1e6",
        "\"model\": \"phong-normalized\", \"specular\": 0.4, \"shininess\": 0",
        "\"model\": \"oren-nayar\", \"sigma\": 60",
        "\"model\": \"cook-torrance\", \"lobes\": [{\"roughness\": 0.0001}]",
        "\"model\": \"cook-torrance\", \"lobes\": [{\"roughness\": 1}], \"fresnel\": {\"f0\": 1}",
        "\"opacity\": 0.3, \"specular\": 0.5",
        "\"specular\": 0.3, \"shininess\": 40",
        "\"reflection\": 0.5",
        "\"reflection\": 0.2, \"transmission\": [0.7, 0.8, 0.2], \"ior\": 1.3"};
    fprintf(out, "\"material\": {\"diffuse\": [%.17g, 0.5, %.17g], %s}", uniform(random, 0, 0.9),
            uniform(random, 0, 0.9), members[below(random, 11)]);
}

static void write_extended_light(FILE *out, uint64_t *random) {
    static const char *const lights[] = {
        "\"type\": \"point\", ", "\"type\": \"point\", \"attenuation\": [0, 0, 1], ",
        "\"type\": \"sphere\", \"radius\": 0.5, ",
        "\"type\": \"rect\", \"size\": [2, 1], \"direction\": [0.1, -1, 0.2], "};
    fprintf(out, "{%s\"intensity\": 0.7, ", lights[below(random, 4)]);
    write_vector(out, "position", shd_scale(random_direction(random), uniform(random, 1.2, 4)));
    fputs("}", out);
}

static char *extended_scene(const char *accuracy, uint64_t seed) {
    static const char *const outputs[] = {"{}", "{\"format\": \"png\", \"bitDepth\": 16}",
                                          "{\"format\": \"exr\"}"};
    uint64_t random = seed * 4099 + 3;
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 24, \"height\": 18, \"samples\": 1}, \"accuracy\": {%s}, "
            "\"output\": %s, \"trace\": {\"depth\": %d}, \"spectral\": %s, \"lights\": [",
            accuracy, outputs[seed % 3], below(&random, 3), below(&random, 4) ? "false" : "true");
    for (int i = 0; i < 2; i++) {
        fputs(i ? ", " : "", w.out);
        write_extended_light(w.out, &random);
    }
    fputs("], \"objects\": [", w.out);
    for (int i = 0; i < 3; i++) {
        fprintf(w.out, "%s{\"type\": \"%s\", ", i ? ", " : "", shapes[below(&random, 5)]);
        write_extended_material(w.out, &random);
        fprintf(w.out, ", \"transform\": {\"rotate\": [%d, 20, 0], \"translate\": [%.17g, 0, 0]}}",
                below(&random, 360), uniform(&random, -1, 1));
    }
    fputs("]}", w.out);
    return finish(&w);
}

/* All tiers and all budgets that are met have the exact tier's picture, to the bit, and no more is
 * told of codes and CIEDE2000 than that, but for models in f32 (bounds_models32.c). What is met in
 * linear components is bounded. tests/attack holds the exact tier to its linear bound. */
static void check_budget(shd_engine *engine, uint64_t seed, int metric, const drawn *exact,
                         int *met, int *refused) {
    static const char *const metrics[] = {"linear", "code", "deltaE2000"};
    const double budget = metric ? 0.01 : seed % 2 ? 1e-6 : 2e-3;
    const shd_bound bound = exact->request->rendering.plan->bound;
    char *accuracy = text_of("\"maxError\": %.17g, \"metric\": \"%s\"", budget, metrics[metric]);
    shd_error error = {.status = SHD_OK};
    char *asking = extended_scene(accuracy, seed);
    shd_request *request = read_scene(engine, asking);
    const shd_status status = shd_rendering_plan(&request->rendering, request->scene, &error);
    const bool fits = metric || bound.linear <= budget;
    assert_int_equal(status, fits ? SHD_OK : SHD_SCENE);
    *met += fits;
    *refused += !fits;
    shd_request_drop(request);
    free(accuracy);
    free(asking);
}

static void extended_scenes_keep_their_budgets(void **state) {
    int met = 0, refused = 0, unknown = 0;
    for (uint64_t seed = 1; seed <= 60; seed++) {
        char *json = extended_scene("\"tier\": \"exact\"", seed);
        drawn exact = shown_film_of(*state, json);
        const shd_plan *plan = exact.request->rendering.plan;
        if (plan->extended) assert_true(plan->bound.code == 0 && plan->bound.delta_e == 0);
        for (int metric = 0; metric < 3 && plan->extended; metric++)
            check_budget(*state, seed, metric, &exact, &met, &refused);
        unknown += !isfinite(plan->bound.linear);
        char *other = extended_scene("\"tier\": \"standard\"", seed);
        drawn standard = shown_film_of(*state, other);
        if (plan->extended && !plan->models32)
            assert_memory_equal(exact.film.rgba, standard.film.rgba,
                                4 * 24 * 18 * sizeof *exact.film.rgba);
        drop_drawn(&standard);
        drop_drawn(&exact);
        free(other);
        free(json);
    }
    print_message("%d budgets met, %d refused, %d bounds not known\n", met, refused, unknown);
    assert_true(met > 60 && refused > 10 && unknown < 15);
}

/* ---- Each kind has a bound. ---- */

static shd_bound bound_of(shd_engine *engine, const char *members, const char *background,
                          const char *light, double *estimate) {
    char *json =
        text_of("{\"image\": {\"width\": 16, \"height\": 12}, \"trace\": {\"depth\": 6}, "
                "\"background\": %s, "
                "\"lights\": [{%s\"position\": [2, 5, 4]}], \"objects\": [{\"type\": \"sphere\", "
                "\"material\": {%s}}, {\"type\": \"plane\", \"transform\": {\"translate\": [0, "
                "-1.1, 0]}}]}",
                background, light, members);
    shd_request *request = read_scene(engine, json);
    shd_error error = {.status = SHD_OK};
    assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error), SHD_OK);
    const shd_bound bound = request->rendering.plan->bound;
    *estimate = shd_linear_estimate(request->rendering.plan, NULL);
    shd_request_drop(request);
    free(json);
    return bound;
}

static void every_model_has_a_bound(void **state) {
    static const char *const point = "\"type\": \"point\", ",
                             *const shape = "\"type\": \"sphere\", \"radius\": 0.5, ";
    static const char *const models[] = {
        "\"model\": \"blinn-phong\", \"specular\": 0.5",
        "\"model\": \"phong-normalized\", \"specular\": 0.5",
        "\"model\": \"oren-nayar\", \"sigma\": 20", "\"model\": \"cook-torrance\"",
        "\"model\": \"westin\", \"microgeometry\": {\"type\": \"grooves\"}"};
    double estimate;
    for (size_t m = 0; m < 5; m++) {
        const double by_point = bound_of(*state, models[m], "0", point, &estimate).linear,
                     by_shape = bound_of(*state, models[m], "0", shape, &estimate).linear;
        print_message("%s: %g, and %g of a light with a shape, estimated at %g\n", models[m],
                      by_point, by_shape, estimate);
        /* Westin's directions change quickly around the normal. */
        assert_true(by_point > 0 && by_point < (m < 4 ? 1e-5 : 1e-3));
        assert_true(by_shape > 0 && by_shape < 1);
        if (m < 4) assert_true(estimate < 1e-3 && estimate < by_shape);
    }
    /* Lambert's light is in closed form: what is not known is the lobe's, of which there is none.
     */
    assert_true(
        bound_of(*state, "\"model\": \"blinn-phong\", \"specular\": 0", "0", shape, &estimate)
            .linear < 1e-4);
}

/* ---- What is summed over directions. ---- */

static char *scene_of_one_term(uint64_t seed) {
    static const char *const kinds[] = {
        "\"model\": \"blinn-phong\", \"diffuse\": 0, \"specular\": 1, \"shininess\": ",
        "\"model\": \"phong-normalized\", \"diffuse\": 0, \"specular\": 1, \"shininess\": ",
        "\"model\": \"oren-nayar\", \"diffuse\": 1, \"sigma\": ",
        ("\"model\": \"cook-torrance\", \"diffuse\": 0, \"fresnel\": {\"f0\": 1}, "
         "\"lobes\": [{\"roughness\": ")};
    static const double ends[][4] = {
        {0, 1.5, 30, 1e4}, {0, 1.5, 30, 1e3}, {0, 20, 60, 90}, {0.02, 0.2, 0.6, 2}};
    static const char *const lights[] = {"rect\", \"size\": [",
                                         "disc\", \"radius\": ", "sphere\", \"radius\": "};
    uint64_t random = seed * 7919 + 5;
    const int kind = (int)(seed % 4), light = below(&random, 3);
    const double size = pow(10, uniform(&random, -3, 0.5));
    const shd_vec3 from = random_direction(&random);
    writing w;
    start(&w);
    fputs("{\"image\": {\"width\": 24, \"height\": 18, \"samples\": 1}, \"background\": 0, "
          "\"camera\": {",
          w.out);
    write_vector(w.out, "position", shd_scale(random_direction(&random), uniform(&random, 2, 5)));
    fprintf(w.out, "}, \"lights\": [{\"type\": \"%s%.17g", lights[light], size);
    if (light == 0) fprintf(w.out, ", %.17g]", size * uniform(&random, 0.2, 1));
    fputs(", ", w.out);
    if (light < 2) {
        write_vector(w.out, "direction",
                     shd_madd(shd_scale(from, -1), random_direction(&random), 0.7));
        fputs(", ", w.out);
    }
    write_vector(w.out, "position",
                 shd_scale(from, 1 + pow(10, uniform(&random, -1, 1)) + (light > 1 ? size : 0)));
    fprintf(w.out,
            "}], \"objects\": [{\"type\": \"%s\", \"transform\": {\"rotate\": [%d, 20, 0]}, "
            "\"material\": {\"ambient\": 0, %s%.17g%s}}]}",
            shapes[below(&random, 5)], below(&random, 360), kinds[kind],
            ends[kind][below(&random, 4)], kind == 3 ? "}]" : "");
    return finish(&w);
}

/* All of the light that is summed over directions may be missing, as far as its bound knows, so
 * that no pixel shows more. */
static void no_shape_adds_more_than_its_bound(void **state) {
    double tightest[4] = {0, 0, 0, 0};
    for (uint64_t seed = 1; seed <= 400; seed++) {
        char *json = scene_of_one_term(seed);
        drawn d = shown_film_of(*state, json);
        const double bound = d.request->rendering.plan->bound.linear;
        double most = 0;
        for (int i = 0; i < 24 * 18; i++) most = fmax(most, (double)d.film.rgba[4 * i]);
        if (!(most <= bound)) fail_msg("%d: %g, told %g: %s", (int)seed, most, bound, json);
        tightest[seed % 4] = fmax(tightest[seed % 4], most / bound);
        drop_drawn(&d);
        free(json);
    }
    for (int k = 0; k < 4; k++) {
        print_message("model %d: at most %.2g of its bound\n", k, tightest[k]);
        assert_true(tightest[k] > 0.3);
    }
}

/* Colors over a transparent background are divided by what hides it. */
static void opacity_over_nothing_has_a_bound(void **state) {
    double estimate;
    const double some =
        bound_of(*state, "\"opacity\": 0.3", "null", "\"type\": \"point\", ", &estimate).linear;
    const double little =
        bound_of(*state, "\"opacity\": 1e-12", "null", "\"type\": \"point\", ", &estimate).linear;
    assert_true(some > 0 && some < 1e-4);
    assert_true(little > 1e-3 && little < 1);
}

/* ---- What paths tell. ---- */

/* The error that a picture's rays tell, and the plan's bound. */
static double ray_error_of(shd_engine *engine, const char *objects, int depth, double *planned,
                           uint64_t *edges) {
    char *json =
        text_of("{\"image\": {\"width\": 64, \"height\": 48}, \"trace\": {\"depth\": %d, "
                "\"minContribution\": 0}, \"lights\": [{\"type\": \"point\", \"position\": "
                "[1, 4, 5]}], \"objects\": [%s]}",
                depth, objects);
    drawn d = shown_film_of(engine, json);
    *planned = d.request->rendering.plan->bound.linear;
    const double error = shd_request_ray_error(d.request, edges);
    assert_true(d.request->rendering.rays > 0);
    drop_drawn(&d);
    free(json);
    return error;
}

static void paths_tell_how_far_they_are_off(void **state) {
    static const char round
        [] = "{\"type\": \"sphere\", \"material\": {\"reflection\": 0.8, \"specular\": 0.5, "
             "\"shininess\": "
             "100}, \"transform\": {\"translate\": [-1.05, 0, 0]}}, {\"type\": \"sphere\", "
             "\"material\": "
             "{\"reflection\": 0.8, \"specular\": 0.5, \"shininess\": 100}, \"transform\": "
             "{\"translate\": "
             "[1.05, 0, 0]}}",
   flat[] =
        "{\"type\": \"disc\", \"radius\": 3, \"material\": {\"reflection\": 0.5}, \"transform\": "
        "{\"rotate\": [70, 0, 0]}}, {\"type\": \"box\", \"material\": {\"diffuse\": 0.5}, "
        "\"transform\": "
        "{\"translate\": [0, 1.5, -1]}}";
    double planned, before = 0;
    uint64_t edges;
    /* Flat mirrors spread nothing: both bounds are little more than the rounding of f32. */
    const double even = ray_error_of(*state, flat, 6, &planned, &edges);
    assert_true(even > 1e-8 && even < 1e-5 && planned < 1e-3 && edges == 0);
    /* Round ones do, and more so with each step. By planning nothing is left of that in the end. */
    for (int depth = 1; depth <= 8; depth++) {
        const double off = ray_error_of(*state, round, depth, &planned, &edges);
        print_message("%d steps: %g by planning, %g by paths, %d edges\n", depth, planned, off,
                      (int)edges);
        assert_true(off >= before && isfinite(planned));
        before = off;
    }
    assert_true(planned > 0.1);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(extended_scenes_keep_their_budgets),
        cmocka_unit_test(every_model_has_a_bound),
        cmocka_unit_test(no_shape_adds_more_than_its_bound),
        cmocka_unit_test(opacity_over_nothing_has_a_bound),
        cmocka_unit_test(paths_tell_how_far_they_are_off),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
