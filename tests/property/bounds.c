/* Error bounds are upper bounds, in scenes of every kind, and not far above what is measured. */
#include "property/pieces.h"
#include "render/tell/measure.h"
#include "shade/exact.h"

static const char *const shapes[] = {"sphere", "box",  "cylinder", "cone",
                                     "torus",  "disc", "plane",    "mesh"};

/* Plain scenes are what most people draw: an object or two, a few lights of the same kind, broad
 * highlights. In wild ones there is everything, and most of it is not in sight of most. */
typedef struct kind {
    bool plain;
    bool grey, negative;
    double most_shininess;
    const char *output;
} kind;

static void write_color(FILE *out, const char *name, const kind *k, double most, uint64_t *random) {
    double r = uniform(random, 0, most), g = uniform(random, 0, most), b = uniform(random, 0, most);
    if (k->grey) g = b = r;
    if (k->negative && below(random, 4) == 0) g = -g;
    fprintf(out, "\"%s\": [%.17g, %.17g, %.17g]", name, r, g, b);
}

/* Spots have penumbras: no bound counts the samples that an edge runs through. */
static void write_light(FILE *out, const kind *k, double strength, uint64_t *random) {
    static const char *const types[] = {"point", "spot", "directional"};
    int type = k->plain ? 0 : below(random, 3);
    shd_vec3 from = shd_scale(random_direction(random), uniform(random, 2, 7));
    fprintf(out, "{\"type\": \"%s\", ", types[type]);
    write_color(out, "color", k, strength, random);
    if (type != 2) {
        fputs(", ", out);
        write_vector(out, "position", from);
        if (below(random, 2))
            fprintf(out, ", \"attenuation\": [%.17g, %.17g, %.17g], \"minDistance\": %.17g",
                    uniform(random, 0, 1), uniform(random, 0, 1), uniform(random, 0.01, 1),
                    uniform(random, 0, 0.5));
    }
    if (type != 0) {
        shd_vec3 aim = shd_add(shd_scale(from, -1), shd_scale(random_direction(random), 0.5));
        fputs(", ", out);
        write_vector(out, "direction", aim);
    }
    if (type == 1)
        fprintf(out, ", \"angle\": %.17g, \"penumbra\": %.17g, \"exponent\": %.17g",
                uniform(random, 5, 100), uniform(random, 0.1, 1),
                below(random, 2) ? uniform(random, 0, 50) : 0);
    fputs("}", out);
}

static void write_object(FILE *out, const kind *k, uint64_t *random) {
    const char *shape = shapes[below(random, 8)];
    shd_affine turn = random_rotation(random);
    shd_affine size =
        scaling(uniform(random, 0.2, 1.2), uniform(random, 0.2, 1.2), uniform(random, 0.2, 1.2));
    shd_affine map = shd_compose(&turn, &size);
    map.origin = shd_scale(random_direction(random), uniform(random, 0, 1.5));
    fprintf(out, "{\"type\": \"%s\", ", shape);
    if (!strcmp(shape, "mesh")) {
        write_ball(out, 12, 6, below(random, 2));
        fputs(", ", out);
    }
    write_transform(out, &map);
    fputs(", \"material\": {", out);
    write_color(out, "diffuse", k, 0.9, random);
    fputs(", ", out);
    write_color(out, "specular", k, 1, random);
    fprintf(out, ", \"shininess\": %.17g, ", pow(k->most_shininess, uniform(random, 0, 1)));
    if (below(random, 3) == 0) fprintf(out, "\"emissive\": %.17g, ", uniform(random, 0, 0.3));
    fprintf(out, "\"lobes\": [{\"specular\": %.17g, \"shininess\": %.17g}]}",
            uniform(random, 0, 0.5), below(random, 4) ? uniform(random, 1, 100) : 0);
    if (below(random, 6) == 0 && strcmp(shape, "plane") != 0)
        fprintf(out, ", \"interpolation\": \"%s\"", below(random, 2) ? "flat" : "gouraud");
    fputs("}", out);
}

/* `accuracy` is a member of the scene. Plain scenes are large enough for pixels of every kind. */
static char *scene(const char *accuracy, bool plain, uint64_t seed) {
    static const char *const outputs[] = {
        "{}",
        "{}",
        "{\"display\": \"Rec.1886\", \"view\": \"Standard\"}",
        "{\"display\": \"Display P3\", \"view\": \"Standard\", \"format\": \"tiff\"}",
        "{\"format\": \"exr\"}",
        "{\"colorSpace\": \"YIQ\"}",
        "{\"colorSpace\": \"HSV\"}",
        "{\"colorSpace\": \"ACEScg\", \"format\": \"exr\"}",
        "{\"format\": \"png\", \"bitDepth\": 16}"};
    uint64_t random = seed * 6151 + 11;
    kind k = {.plain = plain,
              .grey = below(&random, 3) == 0,
              .negative = !plain && below(&random, 10) == 0,
              .most_shininess = pow(10, below(&random, plain ? 3 : 6)),
              .output = outputs[seed % (sizeof outputs / sizeof outputs[0])]};
    double strength = pow(10, uniform(&random, -1.5, 1));
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"accuracy\": {%s}, "
            "\"output\": %s, \"ambient\": %.17g, \"background\": %s, %s\"camera\": "
            "{\"type\": \"%s\"}, \"lights\": [",
            plain ? 128 : 40, plain ? 96 : 32, plain || below(&random, 4) ? 1 : 3, accuracy,
            k.output, below(&random, 2) ? 0.1 : 0,
            below(&random, 4)   ? "0.02"
            : below(&random, 2) ? seed % 2 ? "null" : "[0.4, 0.4, 0.4, 0.3]"
                                : "[0, 0, 0]",
            below(&random, 5) ? "" : "\"workingSpace\": \"ACEScg\", ",
            below(&random, 3) ? "perspective" : "orthographic");
    int lights = plain || below(&random, 5) ? 1 + below(&random, plain ? 4 : 6) : 40;
    for (int i = 0; i < lights; i++) {
        fputs(i ? ", " : "", w.out);
        write_light(w.out, &k, strength, &random);
    }
    fputs("], \"objects\": [", w.out);
    int objects = plain || below(&random, 8) ? 1 + below(&random, plain ? 2 : 5) : 14;
    for (int i = 0; i < objects; i++) {
        fputs(i ? ", " : "", w.out);
        write_object(w.out, &k, &random);
    }
    fputs("]}", w.out);
    return finish(&w);
}

/* Bound over measurement of many scenes, sorted. */
typedef struct ratios {
    double values[512];
    size_t count, unknown;
} ratios;

static int compare_doubles(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

/* Of what is measured, that below `resolution` counts as much. */
static void note(ratios *r, double measured, double resolution, double bound, const char *unit,
                 const char *json) {
    if (isinf(bound))
        r->unknown++;
    else if (!(measured <= bound))
        fail_msg("%s is off by %g, not %g as bound, in\n%s", unit, measured, bound, json);
    else if (measured > 0)
        r->values[r->count++] = bound / fmax(measured, resolution);
}

/* Prints how bounds are spread over what is measured; the share of them within `times` it. */
static double share_within(ratios *r, double times, const char *unit) {
    qsort(r->values, r->count, sizeof *r->values, compare_doubles);
    const double *v = r->values;
    const size_t n = r->count;
    if (n == 0) return 1; /* nothing was off */
    size_t within = 0;
    while (within < n && v[within] <= times) within++;
    print_message("bound over measured, %s: least %.3g, 10 %% %.3g, 25 %% %.3g, median %.3g, 75 %% "
                  "%.3g, 90 %% %.3g, most %.3g of %zu; %zu unknown; %.0f %% within %g\n",
                  unit, v[0], v[n / 10], v[n / 4], v[n / 2], v[3 * n / 4], v[9 * n / 10], v[n - 1],
                  n, r->unknown, 100 * (double)within / (double)n, times);
    return (double)within / (double)n;
}

typedef struct spreads {
    ratios linear, code, delta_e, seen;
} spreads;

/* Measures a picture against the exact tier's, `reference`; both texts are freed. Returns its
 * bound. */
static shd_bound check_texts(shd_engine *engine, char *json, char *reference, spreads *s) {
    drawn exact = shown_film_of(engine, reference), other = shown_film_of(engine, json);
    const shd_bound bound = other.request->rendering.plan->bound;
    const shd_difference got = measured(&exact, &other);
    /* Films are f32: the last digit of the brightest value, or half of it. */
    note(&s->linear, got.linear.max, got.largest * 0x1p-24, bound.linear, "linear", json);
    note(&s->code, got.code.max, 0, bound.code, "code", json);
    note(&s->delta_e, got.delta_e.max, 0, bound.delta_e, "deltaE2000", json);
    /* By the film's own colors. */
    assert_true(got.most <= bound.delta_e);
    note(&s->seen, got.delta_e.max, 0, got.most, "deltaE2000 as seen", json);
    drop_drawn(&exact);
    drop_drawn(&other);
    free(json);
    free(reference);
    return bound;
}

/* The same with such an accuracy. */
static shd_bound check_scene(shd_engine *engine, const char *accuracy, bool plain, uint64_t seed,
                             spreads *s) {
    return check_texts(engine, scene(accuracy, plain, seed),
                       scene("\"tier\": \"exact\"", plain, seed), s);
}

static void check_scenes(shd_engine *engine, bool plain, uint64_t count, spreads *s) {
    for (uint64_t seed = 1; seed <= count; seed++)
        check_scene(engine, "\"tier\": \"standard\"", plain, seed, s);
    assert_int_equal(s->linear.unknown, 0);
}

static void measured_errors_are_below_their_bounds(void **state) {
    spreads s = {.linear = {.count = 0}};
    check_scenes(*state, false, 300, &s);
    share_within(&s.linear, 10, "linear");
    share_within(&s.code, 10, "code");
    share_within(&s.delta_e, 10, "deltaE2000");
    share_within(&s.seen, 10, "deltaE2000 as seen");
}

/* In scenes without much that is out of sight. CIEDE2000's slope is so much steeper in the dark
 * that its bound is that of a dark pixel, wherever there may be one. */
static void bounds_of_plain_scenes_are_near_what_is_measured(void **state) {
    spreads s = {.linear = {.count = 0}};
    check_scenes(*state, true, 160, &s);
    assert_true(share_within(&s.linear, 10, "linear") > 0.5);
    assert_true(share_within(&s.code, 10, "code") > 0.5);
    assert_true(share_within(&s.delta_e, 25, "deltaE2000") > 0.5);
    assert_true(share_within(&s.seen, 15, "deltaE2000 as seen") > 0.5);
}

static void budgets_hold_what_is_measured(void **state) {
    static const char *const metrics[] = {"linear", "code", "deltaE2000"};
    static const double most[] = {0.03, 3.5, 3};
    spreads s = {.linear = {.count = 0}};
    uint64_t random = 77;
    for (uint64_t seed = 1; seed <= 240; seed++) {
        const size_t metric = seed % 3;
        const double budget =
            most[metric] * pow(10, metric == SHD_CODE ? 0 : uniform(&random, -2, 0));
        char *accuracy =
            text_of("\"maxError\": %.17g, \"metric\": \"%s\"", budget, metrics[metric]);
        const shd_bound bound = check_scene(*state, accuracy, seed % 4 == 0, seed + 500, &s);
        const double reached[] = {bound.linear, bound.code, bound.delta_e};
        assert_true(reached[metric] <= budget);
        free(accuracy);
    }
    share_within(&s.linear, 10, "linear");
    share_within(&s.delta_e, 10, "deltaE2000");
}

/* A vertex's radiance in f64, of diffuse light. */
static void vertex_radiance(const shd_plan *plan, size_t object, const shd_facets *facets,
                            size_t index, double out[3]) {
    const shd_plan_material *material = &plan->materials[plan->objects[object].material];
    memcpy(out, material->constant, 3 * sizeof *out);
    for (size_t j = 0; j < plan->light_count; j++) {
        double factor, off;
        const double weight =
            shd_weigh_light(&plan->lights[j], facets->positions[index], facets->normals[index],
                            facets->views[index], &factor, &off);
        for (int c = 0; c < 3; c++)
            out[c] += material->diffuse[c] * weight * plan->lights[j].color[c];
    }
}

/* Radiance is rounded at vertices and again between them. */
static void exact_gouraud_is_within_its_bound(void **state) {
    drawn d = {.request = read_scene(
                   *state,
                   "{\"image\": {\"width\": 160, \"height\": 160, \"samples\": 1}, "
                   "\"accuracy\": {\"tier\": \"exact\"}, \"ambient\": 0.07, \"lights\": "
                   "[{\"type\": \"directional\", \"direction\": [0, 0, -1], \"color\": "
                   "[1.03, 1.01, 1.02]}], \"objects\": [{\"type\": \"sphere\", \"segments\": "
                   "24, \"interpolation\": \"gouraud\", \"material\": {\"diffuse\": "
                   "[0.95, 0.95, 0.95]}}]}")};
    shd_sight *sight = plan_and_see(d.request);
    const shd_plan *plan = d.request->rendering.plan;
    shd_error error;
    assert_int_equal(shd_film_render(&d.request->rendering, sight, NULL, NULL, &d.film, &error),
                     SHD_OK);
    const size_t count = pixels_of(&d);
    int32_t *x = shd_arena_alloc(d.request->rendering.arena, count, sizeof *x),
            *y = shd_arena_alloc(d.request->rendering.arena, count, sizeof *y);
    uint8_t *sample = shd_arena_zalloc(d.request->rendering.arena, count, sizeof *sample);
    shd_hits hits = new_hits(plan, count + SHD_LANES, d.request->rendering.arena);
    assert_true(x && y && sample);
    for (size_t i = 0; i < count; i++) x[i] = (int)(i % 160), y[i] = (int)(i / 160);
    const uint32_t every[] = {0};
    shd_sight_shoot(sight, every, 1, &(shd_shots){count, x, y, sample}, &hits);
    assert_true(hits.count > 1000);
    const shd_facets *facets = shd_sight_facets(sight, 0);
    double worst = 0;
    for (size_t i = 0; i < hits.count; i++) {
        const double share[3] = {1 - hits.u[i] - hits.v[i], hits.u[i], hits.v[i]};
        double sum[3] = {0, 0, 0};
        for (int k = 0; k < 3; k++) {
            double radiance[3];
            vertex_radiance(plan, 0, facets, facets->corners[3 * (size_t)hits.triangle[i] + k],
                            radiance);
            for (int c = 0; c < 3; c++) sum[c] += share[k] * radiance[c];
        }
        for (int c = 0; c < 3; c++)
            worst = fmax(worst, fabs((double)d.film.rgba[4 * hits.shot[i] + c] - sum[c]));
    }
    if (!(worst <= plan->bound.linear))
        fail_msg("off by %g, not %g as bound", worst, plan->bound.linear);
    drop_drawn(&d);
}

/* Up to the ends of f64, and where 1/d^2 is beyond 1e200. */
static void bounds_hold_at_any_size(void **state) {
    static const double sizes[] = {1e-305, 1e-290, 1e-150, 1, 1e150, 1e290, 1e304};
    spreads s = {.linear = {.count = 0}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        const double k = sizes[i];
        char *text[2];
        for (int t = 0; t < 2; t++)
            text[t] = text_of(
                "{\"camera\": {\"position\": [0, 0, %.17g]}, \"image\": {\"width\": 48, "
                "\"height\": 48, \"samples\": 1}, \"accuracy\": {\"tier\": \"%s\"}, \"lights\": "
                "[{\"type\": \"point\", \"position\": [%.17g, %.17g, %.17g], \"intensity\": %.17g, "
                "\"attenuation\": [0, 0, 1]}, {\"type\": \"point\", \"position\": [%.17g, 0, "
                "%.17g], \"intensity\": 0.1}], \"objects\": [{\"type\": \"sphere\", \"radius\": "
                "%.17g, \"material\": {\"specular\": 0.5}}]}",
                4 * k, t ? "exact" : "standard", 3 * k, 3 * k, 3 * k,
                fmin(fmax(20 * k * k, 1e-300), 1e300), -2 * k, k, k);
        drawn exact = shown_film_of(*state, text[1]);
        float most = 0;
        for (size_t p = 0; p < 4 * pixels_of(&exact); p += 4)
            most = fmaxf(most, exact.film.rgba[p]);
        drop_drawn(&exact);
        assert_true(most > 0.09f);
        check_texts(*state, text[0], text[1], &s);
    }
}

/* Lamps that all but touch a sphere, where pixels' corners are: rays, through centres, see none of
 * the light that is a million times as bright there. */
static void light_between_rays_does_not_count(void **state) {
    spreads s = {.linear = {.count = 0}};
    char *text[2];
    for (int t = 0; t < 2; t++) {
        writing w;
        start(&w);
        fprintf(
            w.out,
            "{\"camera\": {\"type\": \"orthographic\", \"height\": 4}, \"image\": {\"width\": 64, "
            "\"height\": 64, \"samples\": 1}, \"accuracy\": {%s}, \"lights\": [",
            t ? "\"tier\": \"exact\"" : "\"maxError\": 1e-3, \"metric\": \"linear\"");
        for (int i = 0; i < 25; i++) {
            const double x = 0.125 * (i % 5 - 2), y = 0.125 * (i / 5 - 2);
            fprintf(w.out,
                    "%s{\"type\": \"point\", \"position\": [%.17g, %.17g, %.17g], \"intensity\": "
                    "1e-3, \"attenuation\": [0, 0, 1]}",
                    i ? ", " : "", x, y, sqrt(1 - x * x - y * y) + 1e-5);
        }
        fputs("], \"objects\": [{\"type\": \"sphere\", \"material\": {\"specular\": 0.5}}]}",
              w.out);
        text[t] = finish(&w);
    }
    check_texts(*state, text[0], text[1], &s);
}

/* On a ball of 6e8, where f32 has steps of 64, under a light at a height of 3: tiles that know of
 * their points what f32 left of them would take it for one below the ground. */
static void bounds_hold_under_lights_that_are_nearer_than_steps_of_f32(void **state) {
    spreads s = {.linear = {.count = 0}};
    for (int i = 0; i < 8; i++) {
        const double radius = 662711015.4084505 + 37 * i;
        char *text[2];
        for (int t = 0; t < 2; t++)
            text[t] = text_of(
                "{\"image\": {\"width\": 37, \"height\": 27, \"samples\": 1}, \"accuracy\": "
                "{\"tier\": \"%s\"}, \"camera\": {\"position\": [0, 0.8, 2.7], \"fov\": 30}, "
                "\"lights\": [{\"type\": \"directional\", \"direction\": [2, -0.01, 1], "
                "\"intensity\": 0.2}, {\"type\": \"point\", \"intensity\": 0.2, \"position\": "
                "[1.2, 3, -15]}, {\"type\": \"directional\", \"direction\": [0.8, -2.9, 1], "
                "\"intensity\": 0.3}], \"objects\": [{\"type\": \"sphere\", \"radius\": %.17g, "
                "\"material\": {\"specular\": 0.5}, \"transform\": {\"translate\": "
                "[0, %.17g, 0]}}]}",
                t ? "exact" : "standard", radius, -radius);
        check_texts(*state, text[0], text[1], &s);
    }
}

/* A ball from 1e10 radii away, in closed form: N.L is sqrt(1 - b^2) at b radii beside its middle,
 * to 1e-10. What f64 cannot tell of a ray's direction is in the bound. */
static void exact_bounds_hold_what_f64_misplaces(void **state) {
    enum { SIDE = 64 };
    const double distance = 1e10, half = 1.2;
    char *text = text_of(
        "{\"image\": {\"width\": 64, \"height\": 64, \"samples\": 1}, \"accuracy\": {\"tier\": "
        "\"exact\"}, \"camera\": {\"position\": [%.17g, %.17g, %.17g], \"fov\": %.17g}, "
        "\"lights\": [{\"type\": \"directional\", \"direction\": [-0.6, -0.48, -0.64]}], "
        "\"objects\": [{\"type\": \"sphere\", \"material\": {\"diffuse\": 1}}]}",
        0.6 * distance, 0.48 * distance, 0.64 * distance, 360 / SHD_PI * atan(half / distance));
    drawn d = shown_film_of(*state, text);
    const double bound = d.request->rendering.plan->bound.linear;
    double worst = 0;
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            const double p = half * ((2 * x + 1.0) / SIDE - 1),
                         q = half * ((2 * y + 1.0) / SIDE - 1);
            const double wanted = sqrt(fmax(0, 1 - p * p - q * q));
            if (wanted < 0.03) continue; /* its outline */
            worst = fmax(worst, fabs((double)d.film.rgba[4 * (SIDE * y + x)] - wanted));
        }
    drop_drawn(&d);
    free(text);
    if (!(worst <= bound)) fail_msg("off by %g, not %g as bound", worst, bound);
    assert_true(worst > 1e-6 && bound < 0.1);
}

/* Black instead of up to 22 codes. */
static void a_budget_that_takes_all_light_is_bounded(void **state) {
    static const char text[] =
        "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": 1}, \"accuracy\": {%s}, "
        "\"ambient\": 0,"
        " \"output\": {\"format\": \"png\"}, \"lights\": [{\"type\": \"point\", \"position\": "
        "[1, 2, 3], \"intensity\": 0.01}], \"objects\": [{\"type\": \"sphere\"}]}";
    spreads s = {.linear = {.count = 0}};
    const shd_bound bound =
        check_texts(*state, text_of(text, "\"maxError\": 0.03, \"metric\": \"linear\""),
                    text_of(text, "\"tier\": \"exact\""), &s);
    assert_true(s.code.count == 1 && bound.code < 30);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(measured_errors_are_below_their_bounds),
        cmocka_unit_test(bounds_of_plain_scenes_are_near_what_is_measured),
        cmocka_unit_test(budgets_hold_what_is_measured),
        cmocka_unit_test(exact_gouraud_is_within_its_bound),
        cmocka_unit_test(bounds_hold_at_any_size),
        cmocka_unit_test(light_between_rays_does_not_count),
        cmocka_unit_test(bounds_hold_under_lights_that_are_nearer_than_steps_of_f32),
        cmocka_unit_test(exact_bounds_hold_what_f64_misplaces),
        cmocka_unit_test(a_budget_that_takes_all_light_is_bounded),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
