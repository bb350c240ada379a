/* Exponents and roughness that are patterns and pictures: each point has the lobe of its number. */
#include "property/pieces.h"
#include "property/put_picture.h"
#include "scene/read.h"

typedef struct model {
    const char *before; /* then comes the number, or what is in place of it */
    const char *after;
    double low, high;
} model;

static const model models[] = {
    {"\"specular\": 0.6, \"shininess\": ", "", 4, 60},
    {"\"specular\": 0.1, \"shininess\": 9, \"lobes\": [{\"specular\": 0.5, \"shininess\": ", "}]",
     200, 3.5},
    {"\"model\": \"blinn-phong\", \"specular\": 0.6, \"shininess\": ", "", 5, 90},
    {"\"model\": \"phong-normalized\", \"specular\": 0.3, \"shininess\": ", "", 2, 40},
    {"\"model\": \"cook-torrance\", \"lobes\": [{\"roughness\": 0.5, \"weight\": 0.2}, "
     "{\"roughness\": ",
     ", \"weight\": 0.5}]", 0.12, 0.6},
    {"\"specularAntialiasing\": true, \"specular\": 0.6, \"shininess\": ", "", 4, 400},
    {"\"normal\": {\"pattern\": \"noise\", \"colors\": [\"#a080f0\", \"#6088f0\"], \"uv\": "
     "{\"scale\": 30}}, \"specular\": 0.6, \"shininess\": ",
     "", 4, 60},
};

/* Shapes and a mesh before a mirror, in light of all kinds. */
static char *things(const char *by, const model *m, const char *number, const char *top) {
    return text_of(
        "{%s\"image\": {\"width\": 20, \"height\": 15, \"samples\": 1}, \"accuracy\": {\"tier\": "
        "\"exact\"}, \"interpolation\": \"%s\", \"background\": [0.2, 0.1, 0.3], \"camera\": "
        "{\"position\": [0.6, 0.4, 4]}, \"lights\": [{\"type\": \"directional\", \"direction\": "
        "[-1, 0.3, -0.4]}, {\"type\": \"point\", \"position\": [3, 2, 2.5]}, {\"type\": \"spot\", "
        "\"position\": [0, 3, 3], \"direction\": [0, -1, -1], \"angle\": 30, \"penumbra\": 0.5}, "
        "{\"type\": \"rect\", \"position\": [-3, 0, 1], \"direction\": [1, 0, -0.2], \"up\": [0, "
        "1, 0], \"size\": [1, 2], \"intensity\": 3}], \"materials\": {\"m\": {\"diffuse\": 0.2, "
        "\"reflection\": 0.1, %s%s%s}}, \"objects\": [{\"type\": \"disc\", \"radius\": 9, "
        "\"interpolation\": \"phong\", \"transform\": {\"rotate\": [90, 0, 0], \"translate\": [3, "
        "0, -2]}, \"material\": {\"diffuse\": 0.1, \"reflection\": 0.8}}, {\"type\": \"box\", "
        "\"material\": \"m\", \"transform\": {\"rotate\": [20, 30, 0], \"translate\": [-1, 0, 0], "
        "\"scale\": [1.5, 1, -1]}}, {\"type\": \"mesh\", \"positions\": [0, -1, 0, 2, -1, 0, 1, "
        "1, 0.5], \"uvs\": [0, 0, 0.3, 1, 1, 0.2], \"material\": \"m\"}, {\"type\": \"torus\", "
        "\"radius\": 0.5, \"tube\": 0.2, \"segments\": 12, \"transform\": {\"translate\": [0, 1, "
        "0]}, \"material\": \"m\"}]}",
        top, by, m->before, number, m->after);
}

static double same_pictures(shd_engine *engine, const char *one, const char *other, double most,
                            int line) {
    drawn a = shown_film_of(engine, one), b = shown_film_of(engine, other);
    assert_true(a.request->rendering.plan->glossed);
    assert_true(a.request->rendering.plan->tier == SHD_EXACT);
    assert_true(isfinite(a.request->rendering.plan->bound.linear));
    const double difference = film_difference(&a, &b);
    if (!(difference <= most)) fail_msg("line %d: %g\n%s\n%s", line, difference, one, other);
    drop_drawn(&a);
    drop_drawn(&b);
    return difference;
}

/* Inside of a check, between lines, beyond a gradient's end, within a texel: one of both, on all
 * that is seen, in mirrors as well, by any interpolation. */
static void inside_there_is_one_of_both(void **state) {
    static const char *const bys[] = {"phong", "gouraud", "flat"};
    static const uint8_t texels[] = {0, 0, 0, 255, 255, 0, 9, 255, 255, 255, 0, 255, 0, 7, 0, 255};
    const put_name picture = put_picture(*state, 2, 2, texels); /* the upper left one is black */
    double most = 0;
    for (size_t m = 0; m < SHD_LENGTH(models); m++) {
        const model *of = &models[m];
        char *places[] = {
            text_of("{\"pattern\": \"checker\", \"uv\": {\"scale\": 1e-7, \"offset\": [0.5, 3.5]}, "
                    "\"values\": [%g, %.17g]}",
                    of->high, of->low),
            text_of("{\"pattern\": \"grid\", \"uv\": {\"scale\": 1e-7, \"offset\": [2.5, 6.5]}, "
                    "\"values\": [%.17g, %g]}",
                    of->low, of->high),
            text_of("{\"pattern\": \"gradient\", \"uv\": {\"scale\": 1e-7, \"offset\": [2.5, 0]}, "
                    "\"values\": [%g, %.17g]}",
                    of->high, of->low),
            text_of("{\"texture\": \"%s\", \"channel\": \"R\", \"uv\": {\"scale\": 1e-10, "
                    "\"offset\": [0.25, 0.75]}, \"values\": [%.17g, %g]}",
                    picture.text, of->low, of->high)};
        char *number = text_of("%.17g", of->low);
        for (size_t k = 0; k < SHD_LENGTH(places); k++) {
            char *one = things(bys[(m + k) % 3], of, places[k], "\"trace\": {\"depth\": 2}, "),
                 *other = things(bys[(m + k) % 3], of, number, "\"trace\": {\"depth\": 2}, ");
            most = fmax(most, same_pictures(*state, one, other, 2e-6, __LINE__));
            free(one);
            free(other);
            free(places[k]);
        }
        free(number);
    }
    if (getenv("SHADED_MEASURE")) printf("one of both: %g\n", most);
}

/* ---- Each pixel is that of a plain material with the number there. ---- */

enum { WIDTH = 24, HEIGHT = 18 };

/* A ball and a plane, whose material is this, in the light of these. */
static char *ball(const char *material, const char *lights, const char *top, const char *region) {
    return text_of("{%s\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1%s}, "
                   "\"camera\": {\"position\": [0.6, 0.9, 4]}, \"lights\": [%s], \"materials\": "
                   "{\"m\": {%s}}, \"objects\": [{\"type\": \"sphere\", \"material\": \"m\"}, "
                   "{\"type\": \"plane\", \"transform\": {\"translate\": [0, -1, 0]}, "
                   "\"material\": \"m\"}]}",
                   top, WIDTH, HEIGHT, region, lights, material);
}

#define POINTS                                                                                     \
    "{\"type\": \"directional\", \"direction\": [-1, -0.3, -1]}, {\"type\": \"point\", "           \
    "\"position\": [1, 2, 2.5]}"
#define AREAS                                                                                      \
    POINTS ", {\"type\": \"sphere\", \"position\": [-2, 2, 1], \"radius\": 0.7}, {\"type\": "      \
           "\"rect\", \"position\": [2, 2, 1], \"direction\": [-1, -1, -0.5], \"up\": [0, 0, 1], " \
           "\"size\": [1, 2]}"

static const char *const fields[] = {
    "\"pattern\": \"checker\", \"uv\": {\"scale\": [12, 6]}",
    "\"pattern\": \"grid\", \"width\": 0.4, \"uv\": {\"scale\": 7}",
    "\"pattern\": \"gradient\", \"uv\": {\"scale\": 3, \"wrap\": \"mirror\", \"rotate\": 30}",
    "\"pattern\": \"noise\", \"octaves\": 3, \"uv\": {\"scale\": 9}",
};

/* Where the field is 0 or 1 it is one of two plain pictures, and elsewhere, at some pixels, that of
 * the field's mean, each drawn by itself. The field is seen as what the same pattern emits. */
static double pixels_have_their_numbers(shd_engine *engine, const model *m, const char *field,
                                        const char *lights, const char *top, int stride) {
    enum { BRUTE = 6 };
    char *pattern = text_of("%s{%s, \"values\": [%.17g, %.17g]}%s", m->before, field, m->low,
                            m->high, m->after),
         *emitted = text_of("\"diffuse\": 0, \"emissive\": {%s, \"colors\": [0, 1]}", field);
    char *texts[4] = {ball(pattern, lights, top, ""), ball(emitted, "", "", ""), NULL, NULL};
    for (int e = 0; e < 2; e++) {
        char *plain = text_of("%s%.17g%s", m->before, e ? m->high : m->low, m->after);
        texts[2 + e] = ball(plain, lights, top, "");
        free(plain);
    }
    drawn d[4];
    for (int k = 0; k < 4; k++) d[k] = shown_film_of(engine, texts[k]);
    /* It is known where that of the sharper plain one is. */
    const double bound = d[0].request->rendering.plan->bound.linear;
    for (int e = 2; e < 4; e++)
        if (isfinite(d[e].request->rendering.plan->bound.linear) != isfinite(bound))
            fail_msg("%g and %g\n%s", bound, d[e].request->rendering.plan->bound.linear, texts[0]);
    double most = 0;
    int brute = 0, ends = 0;
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        const double w = (double)d[1].film.rgba[4 * i];
        const bool seen = d[1].film.rgba[4 * i + 3] > 0;
        double off = 0;
        if (seen && (w == 0 || w == 1)) {
            ends++;
            off = fabs((double)d[0].film.rgba[4 * i] - (double)d[2 + (w == 1)].film.rgba[4 * i]);
        } else if (seen && brute < BRUTE && i % stride == 0) {
            brute++;
            char *plain =
                     text_of("%s%.17g%s", m->before, m->low + (m->high - m->low) * w, m->after),
                 *cut = text_of(", \"region\": [%d, %d, 1, 1]", i % WIDTH, i / WIDTH),
                 *text = ball(plain, lights, top, cut);
            drawn one = shown_film_of(engine, text);
            off = fabs((double)d[0].film.rgba[4 * i] - (double)one.film.rgba[0]);
            drop_drawn(&one);
            free(plain);
            free(cut);
            free(text);
        }
        most = fmax(most, off);
    }
    assert_true(brute + ends >= BRUTE);
    for (int k = 0; k < 4; k++) {
        drop_drawn(&d[k]);
        free(texts[k]);
    }
    free(pattern);
    free(emitted);
    return most;
}

static void each_pixel_has_its_number(void **state) {
    double most = 0;
    for (size_t m = 0; m < SHD_LENGTH(models); m++)
        for (size_t f = 0; f < SHD_LENGTH(fields); f++) {
            if ((m + f) % 2) continue;
            const double off = pixels_have_their_numbers(*state, &models[m], fields[f],
                                                         f == 0 ? AREAS : POINTS, "", 17);
            if (off > 3e-6) fail_msg("model %zu, field %zu: %g", m, f, off);
            most = fmax(most, off);
        }
    const double shadowed = pixels_have_their_numbers(*state, &models[0], fields[3], POINTS,
                                                      "\"trace\": {\"shadows\": true}, ", 23),
                 spectral = pixels_have_their_numbers(*state, &models[1], fields[0], POINTS,
                                                      "\"spectral\": {\"channels\": 16}, ", 23);
    assert_below(shadowed, 3e-6);
    assert_below(spectral, 3e-6);
    if (getenv("SHADED_MEASURE")) printf("numbers: %g\n", most);
}

/* In surroundings both are within their bounds of each other. */
static void surroundings_see_numbers_within_their_bounds(void **state) {
    static const int of[] = {0, 3, 4};
    for (size_t k = 0; k < SHD_LENGTH(of); k++) {
        const model *m = &models[of[k]];
        char *pattern = text_of("%s{%s, \"values\": [%g, %g]}%s", m->before, fields[0], m->low,
                                m->high, m->after),
             *emitted =
                 text_of("\"diffuse\": 0, \"emissive\": {%s, \"colors\": [0, 1]}", fields[0]);
        static const char cut[] = ", \"region\": [9, 6, 6, 4]",
                          studio[] = "{\"type\": \"environment\", \"map\": \"studio\"}";
        char *texts[4] = {ball(pattern, studio, "", cut), ball(emitted, "", "", cut), NULL, NULL};
        for (int e = 0; e < 2; e++) {
            char *plain = text_of("%s%.17g%s", m->before, e ? m->high : m->low, m->after);
            texts[2 + e] = ball(plain, studio, "", cut);
            free(plain);
        }
        drawn d[4];
        for (int i = 0; i < 4; i++) d[i] = shown_film_of(*state, texts[i]);
        const double bound = d[0].request->rendering.plan->bound.linear +
                             fmax(d[2].request->rendering.plan->bound.linear,
                                  d[3].request->rendering.plan->bound.linear);
        assert_true(isfinite(bound));
        double most = 0, apart = 0;
        for (size_t i = 0; i < pixels_of(&d[0]); i++) {
            const double w = (double)d[1].film.rgba[4 * i];
            if (w != 0 && w != 1) continue;
            const double is = (double)d[0].film.rgba[4 * i], low = (double)d[2].film.rgba[4 * i],
                         high = (double)d[3].film.rgba[4 * i];
            most = fmax(most, fabs(is - (w == 1 ? high : low)));
            apart = fmax(apart, fabs(high - low));
        }
        assert_true(apart > 0.02);
        assert_below(most, bound);
        for (int i = 0; i < 4; i++) {
            drop_drawn(&d[i]);
            free(texts[i]);
        }
        free(pattern);
        free(emitted);
    }
}

/* ---- Means. ---- */

/* What is finer than a pixel has the lobe of the mean number: that, and no mean of lobes. A face
 * has it all over itself, and a corner around itself. */
static void from_afar_there_is_the_mean_number(void **state) {
    static const char *const bys[] = {"phong", "flat", "gouraud"};
    for (size_t m = 0; m < 5; m++) {
        char *fine = text_of("{\"pattern\": \"checker\", \"values\": [%g, %g], \"uv\": {\"scale\": "
                             "4000}}",
                             models[m].low, models[m].high),
             *mean = text_of("%.17g", (models[m].low + models[m].high) / 2);
        char *one = things(bys[m % 3], &models[m], fine, ""),
             *other = things(bys[m % 3], &models[m], mean, "");
        same_pictures(*state, one, other, 2e-6, __LINE__);
        free(fine);
        free(mean);
        free(one);
        free(other);
    }
}

/* ---- What stays, and what is refused. ---- */

/* One number is no pattern, and black lobes have none. */
static void what_is_one_number_costs_nothing(void **state) {
    static const char *const materials[] = {
        "\"specular\": 0.5, \"shininess\": {\"pattern\": \"noise\", \"values\": [30, 30]}",
        "\"specular\": 0, \"shininess\": {\"pattern\": \"noise\", \"values\": [3, 30]}"};
    for (size_t k = 0; k < SHD_LENGTH(materials); k++) {
        char *text = ball(materials[k], POINTS, "", "");
        shd_request *request = read_scene(*state, text);
        plan_and_see(request);
        assert_false(request->rendering.plan->glossed || request->rendering.plan->extended);
        shd_request_drop(request);
        free(text);
    }
}

static void tags_tell_numbers_apart(void **state) {
    static const char *const numbers[] = {
        "{\"pattern\": \"checker\", \"values\": [8, 90]}",
        "{\"pattern\": \"checker\", \"values\": [9, 90]}",
        "{\"pattern\": \"checker\", \"values\": [90, 8]}",
        "{\"pattern\": \"grid\", \"values\": [8, 90]}",
        "{\"pattern\": \"checker\", \"values\": [8, 90], \"uv\": {\"scale\": 2}}",
        "90",
        "{\"pattern\": \"checker\", \"values\": [8.0, 9e1], \"uv\": {\"rotate\": 0}}"};
    enum { COUNT = SHD_LENGTH(numbers) };
    char digests[COUNT][33];
    for (size_t k = 0; k < COUNT; k++) {
        char *text = things("phong", &models[1], numbers[k], "");
        shd_request *request = read_scene(*state, text);
        memcpy(digests[k], request->scene->digest, sizeof digests[k]);
        shd_request_drop(request);
        free(text);
    }
    for (size_t a = 0; a + 1 < COUNT; a++)
        for (size_t b = 0; b < a; b++) assert_string_not_equal(digests[a], digests[b]);
    assert_string_equal(digests[COUNT - 1], digests[0]);
}

static void refuse(void **state, const char *material, const char *pointer, const char *says) {
    char *text =
        text_of("{\"objects\": [{\"type\": \"mesh\", \"positions\": [0, 0, 0, 1, 0, 0, 0, 1, 0], "
                "%s\"material\": {%s}}]}",
                *pointer ? "\"uvs\": [0, 0, 1, 0, 0, 1], " : "", material);
    shd_request *request;
    shd_error error;
    assert_int_equal(shd_request_new(*state, &request, &error), SHD_OK);
    assert_int_equal(shd_request_read(request, text, strlen(text), SHD_PNG), SHD_SCENE);
    const shd_problem *problem = &shd_request_report(request)->errors[0];
    char *expected = text_of("/objects/0%s%s", *pointer ? "/material" : "", pointer);
    assert_string_equal(problem->pointer, expected);
    assert_non_null(strstr(problem->detail, says));
    shd_request_drop(request);
    free(expected);
    free(text);
}

static void what_is_no_number_is_refused(void **state) {
    static const uint8_t texels[] = {0, 0, 0, 255, 200, 0, 255, 255};
    const put_name picture = put_picture(*state, 2, 1, texels);
#define SHINE "\"specular\": 0.5, \"shininess\": "
    refuse(state, SHINE "{\"pattern\": \"grid\", \"values\": [0.5, 9]}", "/shininess", "1 to 1e9");
    refuse(state, SHINE "{\"pattern\": \"grid\", \"values\": [9, -1]}", "/shininess/values/1", "0");
    refuse(state, SHINE "{\"pattern\": \"grid\", \"values\": [9]}", "/shininess/values", "2");
    refuse(state, SHINE "{\"pattern\": \"grid\", \"colors\": [9, 8]}", "/shininess", "values");
    refuse(state, SHINE "{\"pattern\": \"grid\"}", "/shininess", "values");
    refuse(state, SHINE "{\"pattern\": \"bricks\", \"values\": [9, 8]}", "/shininess/pattern", "");
    refuse(state, SHINE "{\"pattern\": \"grid\", \"values\": [9, 8], \"width\": 2}",
           "/shininess/width", "");
    refuse(state, SHINE "{\"values\": [9, 8]}", "/shininess", "");
    refuse(state, SHINE "{\"pattern\": \"noise\", \"values\": [9, 8]}", "", "uvs");
    refuse(state,
           "\"specular\": 0.5, \"lobes\": [{\"specular\": 0.1, \"shininess\": {\"pattern\": "
           "\"grid\", \"values\": [0, 9]}}]",
           "/lobes/0/shininess", "1 to 1e9");
    refuse(state,
           "\"model\": \"cook-torrance\", \"lobes\": [{\"roughness\": {\"pattern\": \"grid\", "
           "\"values\": [0, 1]}}]",
           "/lobes/0/roughness", "0.0001 to 10");
    char *colors = text_of(SHINE "{\"texture\": \"%s\", \"values\": [1, 9]}", picture.text),
         *least = text_of(SHINE "{\"texture\": \"%s\", \"channel\": \"R\", \"values\": [0, 9]}",
                          picture.text);
    refuse(state, colors, "/shininess", "channel");
    refuse(state, least, "/shininess", "1 to 1e9");
    free(colors);
    free(least);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(inside_there_is_one_of_both),
        cmocka_unit_test(each_pixel_has_its_number),
        cmocka_unit_test(surroundings_see_numbers_within_their_bounds),
        cmocka_unit_test(from_afar_there_is_the_mean_number),
        cmocka_unit_test(what_is_one_number_costs_nothing),
        cmocka_unit_test(tags_tell_numbers_apart),
        cmocka_unit_test(what_is_no_number_is_refused),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
