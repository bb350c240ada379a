/* Bounds of models that the standard tier lights in f32, in every metric, against the exact tier;
 * with views and lights along surfaces, behind objects, and around highlights. */
#include "property/pieces.h"

static const char *const shapes[] = {"sphere", "box", "cylinder", "cone", "torus", "plane"};

static void write_model(FILE *out, uint64_t *random) {
    const double steep = pow(10, uniform(random, 0, 4)), some = pow(10, uniform(random, 0, 1.5));
    fprintf(out, "\"material\": {\"diffuse\": [%.17g, 0.5, %.17g], ", uniform(random, 0, 0.9),
            uniform(random, 0, 0.9));
    switch (below(random, 5)) {
    case 0:
        fprintf(out,
                "\"model\": \"blinn-phong\", \"specular\": [0.9, 0.2, 0.1], \"lobes\": "
                "[{\"specular\": 0.3, \"shininess\": %.17g}], \"shininess\": 1}",
                steep);
        break;
    case 1:
        fprintf(out, "\"model\": \"blinn-phong\", \"specular\": 0.6, \"shininess\": %.17g}", steep);
        break;
    case 2:
        fprintf(out, "\"model\": \"phong-normalized\", \"specular\": 0.5, \"shininess\": %.17g}",
                some);
        break;
    case 3:
        fprintf(out, "\"model\": \"oren-nayar\", \"sigma\": %.17g}", uniform(random, 0, 90));
        break;
    default:
        fprintf(out, "\"specular\": 0.4, \"shininess\": %.17g}", steep);
    }
}

static void write_lamp(FILE *out, uint64_t *random) {
    static const char *const kinds[] = {
        "\"type\": \"point\", ", "\"type\": \"point\", \"attenuation\": [0, 0, 1], ",
        "\"type\": \"spot\", \"angle\": 40, \"penumbra\": 0.4, \"exponent\": 3, ",
        "\"type\": \"spot\", \"angle\": 30, \"penumbra\": 0, "};
    const shd_vec3 at = shd_scale(random_direction(random), uniform(random, 1.5, 6));
    fprintf(out, "{\"color\": [%.17g, 0.4, 0.7], ", uniform(random, 0.1, 1));
    const int kind = below(random, 6);
    if (kind < 4) {
        fputs(kinds[kind], out);
        write_vector(out, "position", at);
        if (kind > 1) fputs(", ", out);
        if (kind > 1) write_vector(out, "direction", shd_scale(at, -1));
    } else if (kind == 4) {
        fputs("\"type\": \"directional\", ", out);
        write_vector(out, "direction", at);
    } else { /* from behind, and along faces */
        fputs("\"type\": \"directional\", \"direction\": [0, 0, 1]", out);
    }
    fputs("}", out);
}

static char *model_scene(const char *accuracy, uint64_t seed) {
    static const char *const outputs[] = {"{}", "{\"format\": \"png\", \"bitDepth\": 16}",
                                          "{\"display\": \"Display P3\"}"};
    static const char *const interpolations[] = {"phong", "phong", "phong", "gouraud", "flat"};
    uint64_t random = seed * 6151 + 3;
    const int kind = below(&random, 5), solids = kind < 3 ? 6 : 5; /* planes have no faces */
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 48, \"height\": 36, \"samples\": %d}, \"accuracy\": {%s}, "
            "\"output\": %s, \"interpolation\": \"%s\", \"camera\": {",
            seed % 3 ? 1 : 4, accuracy, outputs[below(&random, 3)], interpolations[kind]);
    write_vector(w.out, "position", shd_scale(random_direction(&random), uniform(&random, 3, 6)));
    fputs("}, \"lights\": [", w.out);
    const int lights = 1 + below(&random, 6);
    for (int i = 0; i < lights; i++) {
        fputs(i ? ", " : "", w.out);
        write_lamp(w.out, &random);
    }
    fputs("], \"objects\": [", w.out);
    for (int i = 0; i < 3; i++) {
        fprintf(w.out, "%s{\"type\": \"%s\", ", i ? ", " : "", shapes[below(&random, solids)]);
        write_model(w.out, &random);
        fprintf(w.out, ", \"transform\": {\"rotate\": [%d, %d, 0], \"translate\": [%.17g, 0, 0]}}",
                90 * below(&random, 4), below(&random, 2) ? 0 : below(&random, 360),
                uniform(&random, -1, 1));
    }
    fputs("]}", w.out);
    return finish(&w);
}

typedef struct tally {
    int narrow, known;            /* pictures lit in f32, and those whose bounds are all known */
    double linear, code, delta_e; /* the largest error over its bound */
    double told[3];               /* the sums of what is told */
} tally;

static void check(double measured, double bound, const char *unit, const char *json, double *most) {
    if (!(measured <= bound)) fail_msg("%s: off by %g, told %g: %s", unit, measured, bound, json);
    if (bound > 0 && isfinite(bound)) *most = fmax(*most, measured / bound);
}

static void check_picture(shd_engine *engine, const char *accuracy, uint64_t seed, tally *t) {
    char *exactly = model_scene("\"tier\": \"exact\"", seed), *json = model_scene(accuracy, seed);
    drawn exact = shown_film_of(engine, exactly), other = shown_film_of(engine, json);
    const shd_plan *plan = other.request->rendering.plan;
    const shd_accuracy *asked = &plan->scene->accuracy;
    const shd_bound bound = plan->bound;
    const shd_difference got = measured(&exact, &other);
    check(got.linear.max, bound.linear, "linear", json, &t->linear);
    check(got.code.max, bound.code, "code", json, &t->code);
    check(got.delta_e.max, bound.delta_e, "deltaE2000", json, &t->delta_e);
    if (asked->budget) {
        const double reached[] = {bound.linear, bound.code, bound.delta_e};
        assert_true(reached[asked->metric] <= asked->max_error);
    }
    t->narrow += shd_has_models32(plan);
    if (shd_has_models32(plan) && isfinite(bound.linear + bound.code + bound.delta_e)) {
        t->known++;
        t->told[0] += bound.linear;
        t->told[1] += bound.code;
        t->told[2] += bound.delta_e;
    }
    drop_drawn(&other);
    drop_drawn(&exact);
    free(json);
    free(exactly);
}

static void models_in_f32_keep_their_bounds(void **state) {
    tally t = {.narrow = 0};
    for (uint64_t seed = 1; seed <= 120; seed++)
        check_picture(*state, "\"tier\": \"standard\"", seed, &t);
    print_message("%d in f32: linear %.2g of its bound, code %.2g, deltaE2000 %.2g; in the mean "
                  "%.2g linear, %.2g code, %.2g deltaE2000\n",
                  t.narrow, t.linear, t.code, t.delta_e, t.told[0] / t.known, t.told[1] / t.known,
                  t.told[2] / t.known);
    if (!shd_isa_fuses(shd_cpu_best())) return;
    assert_true(t.narrow > 80 && t.known > 60 && t.linear > 1e-3);
}

static void budgets_take_f32_where_it_meets_them(void **state) {
    static const char *const metrics[] = {"code", "deltaE2000"};
    tally t = {.narrow = 0};
    for (uint64_t seed = 1; seed <= 60; seed++) {
        char *accuracy = text_of("\"maxError\": %.17g, \"metric\": \"%s\"",
                                 seed % 4 < 2 ? 1 : 0.005, metrics[seed % 2]);
        check_picture(*state, accuracy, seed + 1000, &t);
        free(accuracy);
    }
    print_message("%d of 60 budgets met in f32\n", t.narrow);
    if (shd_isa_fuses(shd_cpu_best())) assert_true(t.narrow > 10 && t.narrow < 60);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(models_in_f32_keep_their_bounds),
        cmocka_unit_test(budgets_take_f32_where_it_meets_them),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
