/* The equation's terms come apart and add up: layers, dropped terms, coverage. */
#include "property/pieces.h"

/* What varies of a scene; NULL takes a default. */
typedef struct setting {
    const char *tier, *interpolation, *background, *layers;
    const char *emissive, *ambient, *diffuse, *specular, *lobes; /* of every material */
} setting;

static const char * or (const char *text, const char *fallback) {
    return text ? text : fallback;
}

static const char ALL_LAYERS[] = "[\"beauty\", \"emissive\", \"ambient\", \"diffuse\", "
                                 "\"specular\", \"light.0\", \"light.1\", \"light.2\", "
                                 "\"light.3\", \"light.4\"]";

static char *scene(const setting *s) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 48, \"height\": 36, \"samples\": 4}, \"ambient\": [0.1, 0.2, "
            "0.3], \"accuracy\": {\"tier\": \"%s\"}, \"interpolation\": \"%s\", \"background\": "
            "%s, \"lights\": [{\"type\": \"point\", \"ambient\": 0.05}, {\"type\": \"ambient\", "
            "\"color\": 0.1}, {\"type\": \"spot\"}, {\"type\": \"directional\", \"color\": [0.3, "
            "0.5, 1], \"intensity\": 2}, {\"type\": \"directional\", \"color\": 0}], "
            "\"materials\": {\"m\": {\"emissive\": %s, \"ambient\": %s, \"diffuse\": %s, "
            "\"specular\": %s, \"shininess\": 20, \"lobes\": %s}}, ",
            or (s->tier, "standard"), or (s->interpolation, "phong"), or (s->background, "0"),
            or (s->emissive, "[0.02, 0.01, 0.05]"), or (s->ambient, "[0.5, 0.6, 0.7]"),
            or (s->diffuse, "[0.7, 0.4, 0.3]"), or (s->specular, "[0.4, 0.3, 0.2]"),
            or (s->lobes, "[{\"specular\": 0.2, \"shininess\": 200}]"));
    if (s->layers)
        fprintf(w.out,
                "\"output\": {\"format\": \"exr\", \"bitDepth\": \"float\", \"layers\": %s}, ",
                s->layers);
    fputs("\"objects\": [{\"type\": \"sphere\", \"material\": \"m\"}, {\"type\": \"torus\", "
          "\"material\": \"m\", \"transform\": {\"scale\": 1.2, \"rotate\": [60, 0, 20]}}, "
          "{\"type\": \"mesh\", \"material\": \"m\", ",
          w.out);
    write_ball(w.out, 12, 6, true);
    fputs(", \"transform\": {\"scale\": 0.5, \"translate\": [0.8, 0.8, 0.8]}}]}", w.out);
    return finish(&w);
}

static drawn draw(void **state, const setting *s) {
    char *json = scene(s);
    drawn d = film_of(*state, json);
    free(json);
    return d;
}

/* The largest difference of the picture (multiplied by its alpha) from a sum of layers, over its
 * largest value. Layers of lights follow their indices. */
static double difference_from(const drawn *d, const drawn *layered, const shd_layer_kind *kinds,
                              size_t count) {
    double most = 0, largest = 0;
    for (size_t i = 0; i < pixels_of(d); i++)
        for (size_t c = 0; c < 3; c++) {
            double sum = 0;
            for (size_t k = 0; k < count; k++)
                sum += (double)plane_of(layered, kinds[k], 0)[3 * i + c];
            double value = (double)d->film.rgba[4 * i + c] * (double)d->film.rgba[4 * i + 3];
            most = fmax(most, fabs(sum - value));
            largest = fmax(largest, fabs(value));
        }
    assert_true(largest > 0);
    return most / largest;
}

static const struct {
    const char *tier, *interpolation, *background;
} looks[] = {{"standard", "phong", NULL},
             {"exact", "phong", NULL},
             {"exact", "gouraud", NULL},
             {"standard", "flat", "null"},
             {"standard", "phong", "null"}};
enum { LOOKS = sizeof looks / sizeof looks[0] };

/* Film values are f32: each of the terms is rounded by 2^-24 = 6e-8 of itself. */
static const double F32_SUM = 4e-7;

static void the_four_terms_sum_to_the_beauty(void **state) {
    static const shd_layer_kind terms[] = {SHD_LAYER_EMISSIVE, SHD_LAYER_AMBIENT, SHD_LAYER_DIFFUSE,
                                           SHD_LAYER_SPECULAR};
    for (int i = 0; i < LOOKS; i++) {
        drawn d = draw(state, &(setting){.tier = looks[i].tier,
                                         .interpolation = looks[i].interpolation,
                                         .background = looks[i].background,
                                         .layers = ALL_LAYERS});
        assert_below(difference_from(&d, &d, terms, 4), F32_SUM);
        drop_drawn(&d);
    }
}

static void the_lights_sum_to_what_they_add(void **state) {
    for (int i = 0; i < LOOKS; i++) {
        drawn d = draw(state, &(setting){.tier = looks[i].tier,
                                         .interpolation = looks[i].interpolation,
                                         .background = looks[i].background,
                                         .layers = ALL_LAYERS});
        double most = 0, largest = 0;
        for (size_t p = 0; p < 3 * pixels_of(&d); p++) {
            double terms = (double)plane_of(&d, SHD_LAYER_DIFFUSE, 0)[p] +
                           (double)plane_of(&d, SHD_LAYER_SPECULAR, 0)[p];
            double lights = 0;
            for (size_t l = 0; l < 5; l++) lights += (double)plane_of(&d, SHD_LAYER_LIGHT, l)[p];
            most = fmax(most, fabs(terms - lights));
            largest = fmax(largest, terms);
            /* A light's own ambient share is in the ambient term: such layers are dark. */
            assert_true(plane_of(&d, SHD_LAYER_LIGHT, 1)[p] == 0);
            assert_true(plane_of(&d, SHD_LAYER_LIGHT, 4)[p] == 0);
        }
        assert_below(most / largest, F32_SUM);
        drop_drawn(&d);
    }
}

/* A lobe that is black has its number, too. */
static void the_lobes_sum_to_the_highlights(void **state) {
    for (int i = 0; i < LOOKS; i++) {
        const setting all = {.tier = looks[i].tier,
                             .interpolation = looks[i].interpolation,
                             .background = looks[i].background,
                             .lobes = "[{\"specular\": 0}, {\"specular\": [0.1, 0.2, 0.3], "
                                      "\"shininess\": 200}]",
                             .layers = "[\"specular\", \"lobe.0\", \"lobe.1\", \"lobe.2\"]"};
        setting last = all;
        last.specular = "0";
        drawn d = draw(state, &all), one = draw(state, &last);
        double most = 0, alone = 0, largest = 0;
        for (size_t p = 0; p < 3 * pixels_of(&d); p++) {
            const double highlights = (double)plane_of(&d, SHD_LAYER_SPECULAR, 0)[p],
                         first = (double)plane_of(&d, SHD_LAYER_LOBE, 0)[p],
                         third = (double)plane_of(&d, SHD_LAYER_LOBE, 2)[p];
            assert_true(plane_of(&d, SHD_LAYER_LOBE, 1)[p] == 0);
            most = fmax(most, fabs(highlights - first - third));
            alone = fmax(alone, fabs(third - (double)plane_of(&one, SHD_LAYER_SPECULAR, 0)[p]));
            largest = fmax(largest, third);
        }
        assert_true(largest > 0.05);
        assert_below(most / largest, F32_SUM);
        assert_below(alone / largest, F32_SUM);
        drop_drawn(&d);
        drop_drawn(&one);
    }
}

static void a_lights_layer_is_the_picture_it_makes_alone(void **state) {
    char *json = scene(&(setting){.layers = ALL_LAYERS});
    drawn d = film_of(*state, json);
    free(json);
    json = scene(&(setting){.emissive = "0", .ambient = "0"});
    /* Blacken the others: the point light's and the spot's are the first and the second. */
    char *at = strstr(json, "{\"type\": \"spot\"");
    char *rest = strstr(at, "], \"materials\"");
    char *head = text_of("%.*s", (int)(at - json), json);
    char *alone = text_of("%s{\"type\": \"ambient\"}%s", head, rest);
    drawn one = film_of(*state, alone);
    double most = 0, largest = 0;
    for (size_t i = 0; i < pixels_of(&d); i++)
        for (size_t c = 0; c < 3; c++) {
            double value = (double)one.film.rgba[4 * i + c];
            largest = fmax(largest, value);
            most = fmax(most, fabs(value - (double)plane_of(&d, SHD_LAYER_LIGHT, 0)[3 * i + c]));
        }
    assert_below(most / largest, F32_SUM);
    drop_drawn(&d);
    drop_drawn(&one);
    free(json);
    free(head);
    free(alone);
}

static void a_dropped_term_is_a_zeroed_term(void **state) {
    static const struct {
        setting without;
        shd_layer_kind kept[3];
    } cases[] = {
        {{.diffuse = "0"}, {SHD_LAYER_EMISSIVE, SHD_LAYER_AMBIENT, SHD_LAYER_SPECULAR}},
        {{.specular = "0", .lobes = "[]"},
         {SHD_LAYER_EMISSIVE, SHD_LAYER_AMBIENT, SHD_LAYER_DIFFUSE}},
        {{.emissive = "0"}, {SHD_LAYER_AMBIENT, SHD_LAYER_DIFFUSE, SHD_LAYER_SPECULAR}},
        {{.ambient = "0"}, {SHD_LAYER_EMISSIVE, SHD_LAYER_DIFFUSE, SHD_LAYER_SPECULAR}},
    };
    for (int i = 0; i < 2; i++)
        for (size_t k = 0; k < sizeof cases / sizeof cases[0]; k++) {
            const char *tier = i ? "exact" : "standard";
            drawn full = draw(state, &(setting){.tier = tier, .layers = ALL_LAYERS});
            setting s = cases[k].without;
            s.tier = tier;
            drawn without = draw(state, &s);
            assert_below(difference_from(&without, &full, cases[k].kept, 3), F32_SUM);
            drop_drawn(&full);
            drop_drawn(&without);
        }
}

static void black_lobes_are_absent_lobes(void **state) {
    static const char *const lobes[] = {
        "[]", "[{\"specular\": 0, \"shininess\": 7}]", "[{\"specular\": [0, 0, 0]}, {}]",
        "[{\"shininess\": 0}, {\"specular\": 0, \"shininess\": 1e6}]"};
    for (size_t i = 1; i < sizeof lobes / sizeof lobes[0]; i++) {
        assert_true(same_png(*state, scene(&(setting){.lobes = lobes[0]}),
                             scene(&(setting){.lobes = lobes[i]})));
        assert_true(same_png(*state, scene(&(setting){.lobes = lobes[0], .specular = "0"}),
                             scene(&(setting){.lobes = lobes[i], .specular = "0"})));
    }
}

static void a_lobe_may_be_the_first_or_a_further_one(void **state) {
    assert_true(same_png(
        *state, scene(&(setting){.specular = "[0.4, 0.3, 0.2]", .lobes = "[]"}),
        scene(&(setting){.specular = "0",
                         .lobes = "[{\"specular\": [0.4, 0.3, 0.2], \"shininess\": 20}]"})));
}

static void unlit_materials_need_no_light(void **state) {
    drawn d = draw(state, &(setting){.diffuse = "0", .specular = "0", .lobes = "[]"});
    /* ke + ka Ia; Ia is the sum of 0.1 0.2 0.3, 0.05 and 0.1. */
    const double wanted[3] = {0.02 + 0.5 * 0.25, 0.01 + 0.6 * 0.35, 0.05 + 0.7 * 0.45};
    size_t full = 0;
    for (size_t i = 0; i < pixels_of(&d); i++) {
        const float *rgba = d.film.rgba + 4 * i;
        if ((double)rgba[0] < 0.99 * wanted[0]) continue; /* partly or not covered */
        full++;
        for (int c = 0; c < 3; c++) /* one rounding to f32 */
            assert_true(fabs((double)rgba[c] - wanted[c]) <= 0x1p-24 * wanted[c]);
    }
    assert_true(full > pixels_of(&d) / 10);
    drop_drawn(&d);
}

static void alpha_is_coverage_and_colors_are_straight(void **state) {
    static const int patterns[] = {1, 4, 7, 16};
    for (int k = 0; k < 4; k++) {
        char *json = text_of(
            "{\"image\": {\"width\": 40, \"height\": 30, \"samples\": %d}, \"background\": null, "
            "\"lights\": [], \"objects\": [{\"type\": \"sphere\", \"material\": {\"emissive\": "
            "[0.25, 0.5, 3], \"ambient\": 0}}]}",
            patterns[k]);
        drawn d = film_of(*state, json);
        sampled s = samples_of(*state, json);
        size_t edge = 0;
        for (size_t i = 0; i < pixels_of(&d); i++) {
            size_t samples = (size_t)patterns[k], hits = 0;
            for (size_t n = 0; n < samples; n++)
                hits += s.seen.object[i * samples + n] != SHD_NOTHING;
            const float *rgba = d.film.rgba + 4 * i;
            assert_true(rgba[3] == (float)((double)hits / (double)samples));
            edge += hits > 0 && hits < samples;
            /* Times coverage and divided by it, once rounded each. */
            static const float color[3] = {0.25f, 0.5f, 3};
            for (int c = 0; c < 3; c++)
                assert_true(hits ? fabsf(rgba[c] - color[c]) <= 0x1p-23f * color[c] : rgba[c] == 0);
        }
        assert_true(patterns[k] == 1 ? edge == 0 : edge > 20);
        drop_drawn(&d);
        drop_sampled(&s);
        free(json);
    }
}

static void an_opaque_background_is_seen_through_the_gaps(void **state) {
    drawn over = draw(state, &(setting){.background = "[0.3, 0.6, 1.5]"});
    drawn clear = draw(state, &(setting){.background = "null"});
    static const double background[3] = {0.3, 0.6, 1.5};
    for (size_t i = 0; i < pixels_of(&over); i++) {
        const float *a = over.film.rgba + 4 * i, *b = clear.film.rgba + 4 * i;
        assert_true(a[3] == 1);
        for (int c = 0; c < 3; c++) {
            double alpha = (double)b[3];
            double wanted = (double)b[c] * alpha + background[c] * (1 - alpha);
            /* f32 roundings of the colors */
            assert_true(fabs((double)a[c] - wanted) <= 2 * 0x1p-24 * wanted);
        }
    }
    drop_drawn(&over);
    drop_drawn(&clear);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(the_four_terms_sum_to_the_beauty),
        cmocka_unit_test(the_lights_sum_to_what_they_add),
        cmocka_unit_test(the_lobes_sum_to_the_highlights),
        cmocka_unit_test(a_lights_layer_is_the_picture_it_makes_alone),
        cmocka_unit_test(a_dropped_term_is_a_zeroed_term),
        cmocka_unit_test(black_lobes_are_absent_lobes),
        cmocka_unit_test(a_lobe_may_be_the_first_or_a_further_one),
        cmocka_unit_test(unlit_materials_need_no_light),
        cmocka_unit_test(alpha_is_coverage_and_colors_are_straight),
        cmocka_unit_test(an_opaque_background_is_seen_through_the_gaps),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
