/* Patterns of two normals: maps that no picture holds. */
#include "property/pieces.h"
#include "property/put_normals.h"
#include "scene/read.h"
#include "shade/bump.h"

static const code TILT = {200, 90, 210};
#define TILTED "\"#c85ad2\""
#define OTHER  "[0.25, 0.5, 0.9]"

static double same_pictures(shd_engine *engine, const char *one, const char *other, double most,
                            int line) {
    drawn a = shown_film_of(engine, one), b = shown_film_of(engine, other);
    assert_true(a.request->rendering.plan->bumped);
    assert_true(a.request->rendering.plan->tier == SHD_EXACT);
    assert_true(isfinite(a.request->rendering.plan->bound.linear));
    double light = 0;
    for (size_t i = 0; i < 4 * pixels_of(&b); i++)
        if (i % 4 < 3) light = fmax(light, (double)b.film.rgba[i]);
    assert_true(light > 0.1);
    const double difference = film_difference(&a, &b);
    if (!(difference <= most)) fail_msg("line %d: %g\n%s\n%s", line, difference, one, other);
    drop_drawn(&a);
    drop_drawn(&b);
    return difference;
}

static const char *const models[] = {
    "\"specular\": 0.6, \"shininess\": 20, \"lobes\": [{\"specular\": 0.1, \"shininess\": 300}]",
    "\"model\": \"blinn-phong\", \"specular\": 0.6, \"shininess\": 50",
    "\"model\": \"phong-normalized\", \"specular\": 0.4, \"shininess\": 40",
    "\"model\": \"oren-nayar\", \"sigma\": 25",
    "\"model\": \"cook-torrance\", \"lobes\": [{\"roughness\": 0.3}]",
    "\"model\": \"westin\", \"microgeometry\": {\"type\": \"grooves\"}",
    "\"specular\": 0.6, \"shininess\": 9, \"specularAntialiasing\": true",
    "\"diffuse\": {\"pattern\": \"checker\", \"colors\": [0.2, 0.7]}, \"specular\": 0.2",
};

/* Shapes and a mesh before a mirror, in any light, all with this map. */
static char *things(const char *by, const char *material, const char *normal, const char *top) {
    return text_of(
        "{%s\"image\": {\"width\": 20, \"height\": 15, \"samples\": 1}, \"accuracy\": {\"tier\": "
        "\"exact\"}, \"interpolation\": \"%s\", \"background\": [0.2, 0.1, 0.3], \"trace\": "
        "{\"depth\": 2}, \"camera\": {\"position\": [0.6, 0.4, 4]}, \"lights\": [{\"type\": "
        "\"directional\", \"direction\": [-1, 0.3, -0.4]}, {\"type\": \"point\", \"position\": [3, "
        "2, 2.5]}, {\"type\": \"rect\", \"position\": [-3, 0, 1], \"direction\": [1, 0, -0.2], "
        "\"up\": [0, 1, 0], \"size\": [1, 2], \"intensity\": 3}], \"materials\": {\"m\": "
        "{\"reflection\": 0.1, %s, \"normal\": %s}}, \"objects\": [{\"type\": \"disc\", "
        "\"radius\": 9, \"interpolation\": \"phong\", \"transform\": {\"rotate\": [90, 0, 0], "
        "\"translate\": [3, 0, -2]}, \"material\": {\"diffuse\": 0.1, \"reflection\": 0.8}}, "
        "{\"type\": \"box\", \"material\": \"m\", \"transform\": {\"rotate\": [20, 30, 0], "
        "\"translate\": [-1, 0, 0], \"scale\": [1.5, 1, -1]}}, {\"type\": \"mesh\", \"positions\": "
        "[0, -1, 0, 2, -1, 0, 1, 1, 0.5], \"uvs\": [0, 0, 0.3, 1, 1, 0.2], \"material\": \"m\"}, "
        "{\"type\": \"torus\", \"radius\": 0.5, \"tube\": 0.2, \"segments\": 12, \"transform\": "
        "{\"translate\": [0, 1, 0]}, \"material\": \"m\"}]}",
        top, by, material, normal);
}

/* ---- One normal. ---- */

static void equal_normals_are_a_map_of_one(void **state) {
    static const char *const bys[] = {"phong", "gouraud", "flat"},
                             *const patterns[] = {
                                 "\"checker\"", "\"grid\", \"width\": 0.4",
                                 "\"gradient\", \"uv\": {\"wrap\": \"mirror\", \"scale\": 9}",
                                 "\"noise\", \"octaves\": 2, \"uv\": {\"scale\": 20}"};
    const put_name map = put_normals(*state, 1, 1, &TILT, 1);
    char *picture = text_of("{\"texture\": \"%s\", \"scale\": 0.5}", map.text);
    double most = 0;
    for (size_t m = 0; m < SHD_LENGTH(models); m++)
        for (size_t k = 0; k < SHD_LENGTH(patterns); k++) {
            if ((m + k) % 2 && m) continue;
            char *pattern =
                text_of("{\"pattern\": %s, \"colors\": [" TILTED ", " TILTED "], \"scale\": 0.5}",
                        patterns[k]);
            char *one = things(bys[(m + k) % 3], models[m], pattern, ""),
                 *other = things(bys[(m + k) % 3], models[m], picture, "");
            most = fmax(most, same_pictures(*state, one, other, 1e-6, __LINE__));
            free(one);
            free(other);
            free(pattern);
        }
    if (getenv("SHADED_MEASURE")) printf("one normal: %g\n", most);
    free(picture);
}

/* Inside of a check, between lines, beyond a gradient's end: one of both, to the bit. Numbers and
 * codes are the same. */
static void inside_there_is_one_of_both(void **state) {
    static const char *const places[][2] = {
        {"\"checker\", \"uv\": {\"scale\": 1e-6, \"offset\": [0.5, 3.5]}",
         OTHER ", [0.7843137254901961, 0.35294117647058826, 0.8235294117647058]"},
        {"\"checker\", \"uv\": {\"scale\": 1e-6, \"offset\": [2.5, 6.5]}", TILTED ", " OTHER},
        {"\"grid\", \"uv\": {\"scale\": 1e-6, \"offset\": [2.5, 6.5]}", TILTED ", \"#0f8\""},
        {"\"gradient\", \"uv\": {\"scale\": 1e-6, \"offset\": [2.5, 6.5]}", OTHER ", " TILTED}};
    char *same = things("phong", models[0],
                        "{\"pattern\": \"checker\", \"colors\": [" TILTED ", " TILTED "]}", "");
    for (size_t k = 0; k < SHD_LENGTH(places); k++) {
        char *pattern = text_of("{\"pattern\": %s, \"colors\": [%s]}", places[k][0], places[k][1]),
             *one = things("phong", models[0], pattern, "");
        same_pictures(*state, one, same, 1e-7, __LINE__);
        free(pattern);
        free(one);
    }
    free(same);
}

/* ---- Means. ---- */

/* From afar a checker is the mean of both, and Toksvig's lobe, in closed form. */
static void from_afar_there_is_the_mean(void **state) {
    static const char *const bys[] = {"phong", "flat", "gouraud"};
    const shd_vec3 one = vector_of((code){188, 128, 240}, 1),
                   other = vector_of((code){67, 140, 240}, 1),
                   mean = shd_scale(shd_add(one, other), 0.5);
    const double length = shd_length(mean), v = (1 - length) / length;
    shd_vec3 n;
    shd_normalize(mean, &n);
    for (int k = 0; k < 6; k++) {
        const bool blinn = k % 2;
        const double shine = 40, wide = shine / (1 + (blinn ? 1 : 4) * v * shine);
        const shd_vec3 toward = {0, sin(0.2), cos(0.2)}, eye = {0, 0, 1};
        shd_vec3 half;
        shd_normalize(shd_add(toward, eye), &half);
        const double facing = shd_dot(n, toward), mirrored = 2 * facing * n.z - toward.z, /* R.V */
            lobe = 0.5 * (wide + 1) / (shine + 1) * pow(blinn ? shd_dot(n, half) : mirrored, wide),
                     light = 0.3 * facing + lobe;
        char *text = text_of(
            "{\"image\": {\"width\": 8, \"height\": 6, \"samples\": 1}, \"camera\": {\"type\": "
            "\"orthographic\", \"height\": 1}, \"lights\": [{\"type\": \"directional\", "
            "\"direction\": [0, %.17g, %.17g]}], \"objects\": [{\"type\": \"box\", \"size\": [4, "
            "4, 1], \"interpolation\": \"%s\", \"material\": {\"model\": \"%s\", \"diffuse\": 0.3, "
            "\"ambient\": 0, \"specular\": 0.5, \"shininess\": 40, \"normal\": {\"pattern\": "
            "\"checker\", \"colors\": [\"#bc80f0\", \"#438cf0\"], \"uv\": {\"scale\": 2000, "
            "\"rotate\": 0}}}}]}",
            -toward.y, -toward.z, bys[k / 2], blinn ? "blinn-phong" : "phong");
        drawn d = film_of(*state, text);
        for (size_t i = 0; i < pixels_of(&d); i++)
            assert_below(fabs((double)d.film.rgba[4 * i] / light - 1), 1e-6);
        drop_drawn(&d);
        free(text);
    }
}

/* What a plane has under a footprint, as a vector of (T, B, N). */
static shd_vec3 mean_at(const shd_texture *map, const shd_chart *chart, const shd_footprint *f) {
    const shd_charted_point point = {.position = {0, 0, 0}, .normal = {0, 1, 0}};
    const shd_bump bump = shd_bump_at(map, chart, &point, f);
    const shd_vec3 n = shd_scale(bump.normal, bump.length);
    return (shd_vec3){n.x, -n.z, n.y};
}

/* How far means are from those of many points of which each has a unit normal. */
static double error_of_means(const shd_texture *map, const shd_chart *chart, double wide,
                             uint64_t *random) {
    enum { POINTS = 60 };
    const double s = uniform(random, -3, 3), t = uniform(random, -3, 3);
    const shd_footprint f = {{s, t}, {wide, 0.1 * wide}, {0.2 * wide, 0.4 * wide}};
    shd_vec3 sum = {0, 0, 0};
    for (int i = 0; i < POINTS * POINTS; i++) {
        const double a = (i % POINTS + 0.5) / POINTS - 0.5, b = (i / POINTS + 0.5) / POINTS - 0.5;
        const shd_footprint point = {
            {s + a * f.x[0] + b * f.y[0], t + a * f.x[1] + b * f.y[1]}, {0, 0}, {0, 0}};
        sum = shd_madd(sum, mean_at(map, chart, &point), 1.0 / POINTS / POINTS);
    }
    return shd_length(shd_sub(mean_at(map, chart, &f), sum));
}

/* Both ends tilted by a third of a right angle, so that the way from one to the other is long. A
 * gradient is never dull where it is seen from near, and its mean is that of all of its normals. */
static void smooth_patterns_have_the_mean_of_their_normals(void **state) {
    (void)state;
    static const shd_object plane = {.shape = SHD_PLANE,
                                     .transform = {.linear = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}};
    const shd_chart chart = shd_chart_of(&plane);
    uint64_t random = 5;
    for (int kind = 0; kind < 4; kind++) {
        const shd_texture map = {.pattern = {.kind = kind == 3 ? SHD_NOISE : SHD_GRADIENT,
                                             .map = {{1, 0, 0}, {0, 1, 0}},
                                             .wrap = kind == 3 ? 0 : (shd_wrap)kind,
                                             .octaves = kind == 3 ? 2 : 0},
                                 .low = {-0.5, 0.1, 0.866},
                                 .high = {0.5, -0.2, 0.866}};
        double most[3] = {0, 0, 0};
        for (int k = 0; k < 60; k++) {
            const double wide = pow(10, uniform(&random, -4, 1));
            const int size = wide < 0.01 ? 0 : wide < 0.2 ? 1 : 2;
            const shd_footprint point = {{uniform(&random, -3, 3), 0.3}, {0, 0}, {0, 0}};
            assert_below(1 - shd_length(mean_at(&map, &chart, &point)), 1e-7);
            most[size] = fmax(most[size], error_of_means(&map, &chart, wide, &random));
        }
        if (getenv("SHADED_MEASURE"))
            printf("kind %d: %.2g, %.2g, %.2g\n", kind, most[0], most[1], most[2]);
        assert_below(most[0], kind == 3 ? 2e-4 : 1e-5);
        assert_below(most[1], kind == 3 ? 0.04 : 0.002);
        assert_below(most[2], kind == 3 ? 0.2 : 0.015);
    }
}

/* ---- What stays, and what is refused. ---- */

static void parts_are_those_of_the_whole(void **state) {
    static const char noise[] = "{\"pattern\": \"noise\", \"colors\": [\"#d080e0\", \"#4070e0\"], "
                                "\"scale\": 1.5, \"uv\": {\"scale\": 14, \"rotate\": 20}}";
    char *whole = things("phong", models[0], noise, "");
    char *part = text_of("%s", whole), *image = strstr(part, "\"samples\": 1}");
    char *cut = text_of("%.*s\"region\": [7, 5, 11, 9], %s", (int)(image - part), part, image);
    drawn a = film_of(*state, whole), b = film_of(*state, cut);
    for (int y = 0; y < 9; y++)
        for (int x = 0; x < 11; x++)
            assert_memory_equal(b.film.rgba + 4 * (y * 11 + x),
                                a.film.rgba + 4 * ((y + 5) * 20 + x + 7), 4 * sizeof(float));
    drop_drawn(&a);
    drop_drawn(&b);
    free(whole);
    free(part);
    free(cut);
}

static void spectra_see_the_same(void **state) {
    const put_name map = put_normals(*state, 1, 1, &TILT, 1);
    char *picture = text_of("{\"texture\": \"%s\"}", map.text);
    char *one = things("phong", models[0],
                       "{\"pattern\": \"noise\", \"colors\": [" TILTED ", " TILTED "]}",
                       "\"spectral\": {\"channels\": 16}, "),
         *other = things("phong", models[0], picture, "\"spectral\": {\"channels\": 16}, ");
    same_pictures(*state, one, other, 2e-6, __LINE__);
    free(picture);
    free(one);
    free(other);
}

static void tags_tell_patterns_apart(void **state) {
    static const char *const normals[] = {
        "{\"pattern\": \"checker\", \"colors\": [\"#8080ff\", \"#a080f0\"]}",
        "{\"pattern\": \"checker\", \"colors\": [\"#8080ff\", \"#a081f0\"]}",
        "{\"pattern\": \"checker\", \"colors\": [\"#a080f0\", \"#8080ff\"]}",
        "{\"pattern\": \"checker\", \"colors\": [\"#8080ff\", \"#a080f0\"], \"scale\": 0.9}",
        "{\"pattern\": \"grid\", \"colors\": [\"#8080ff\", \"#a080f0\"]}",
        "{\"pattern\": \"checker\", \"colors\": [\"#8080ff\", \"#a080f0\"], \"uv\": {\"scale\": "
        "2}}",
        "{\"pattern\": \"checker\", \"colors\": [\"#8080FF\", \"#a080f0\"], \"scale\": 1, \"uv\": "
        "{\"rotate\": 0}}"};
    enum { COUNT = SHD_LENGTH(normals) };
    char digests[COUNT][33];
    for (size_t k = 0; k < COUNT; k++) {
        char *text = things("phong", models[0], normals[k], "");
        shd_request *request = read_scene(*state, text);
        memcpy(digests[k], request->scene->digest, sizeof digests[k]);
        shd_request_drop(request);
        free(text);
    }
    for (size_t a = 0; a + 1 < COUNT; a++)
        for (size_t b = 0; b < a; b++) assert_string_not_equal(digests[a], digests[b]);
    assert_string_equal(digests[COUNT - 1], digests[0]);
}

static void refuse(void **state, const char *normal, const char *pointer) {
    refuse_text(
        *state,
        text_of("{\"objects\": [{\"type\": \"sphere\", \"material\": {\"normal\": %s}}]}", normal),
        pointer);
}

static void what_is_no_normal_is_refused(void **state) {
#define AT "/objects/0/material/normal"
    static const char *const codes[] = {"0.5",
                                        "\"red\"",
                                        "\"#8080ff80\"",
                                        "\"#80ff\"",
                                        "\"#abc \"",
                                        "\"#abc   \"",
                                        "\" #abc\"",
                                        "\"#80gg00\"",
                                        "null",
                                        "\"rgb(1 2 3)\"",
                                        "{\"space\": \"sRGB\", \"value\": [0.5, 0.5, 1]}"};
    for (size_t k = 0; k < SHD_LENGTH(codes); k++) {
        char *text = text_of("{\"pattern\": \"grid\", \"colors\": [\"#abc\", %s]}", codes[k]);
        refuse(state, text, AT "/colors/1");
        free(text);
    }
    refuse(state, "{\"pattern\": \"grid\", \"colors\": [\"#abc\", [0.5, 1.5, 1]]}",
           AT "/colors/1/1");
    refuse(state, "{\"pattern\": \"grid\", \"colors\": [\"#abc\", [0.5, 0.5]]}", AT "/colors/1");
    refuse(state, "{\"pattern\": \"grid\", \"colors\": [\"#abc\"]}", AT "/colors");
    refuse(state, "{\"pattern\": \"grid\"}", AT);
    refuse(state, "{\"pattern\": \"bricks\", \"colors\": [\"#abc\", \"#abc\"]}", AT "/pattern");
    refuse(state, "{\"pattern\": \"noise\", \"colors\": [\"#abc\", \"#abc\"], \"width\": 0.5}",
           AT "/width");
    refuse(state, "{\"pattern\": \"grid\", \"colors\": [\"#abc\", \"#abc\"], \"scale\": 1001}",
           AT "/scale");
    refuse(state,
           "{\"pattern\": \"grid\", \"colors\": [\"#abc\", \"#abc\"], \"uv\": {\"wrap\": "
           "\"repeat\"}}",
           AT "/uv/wrap");
    refuse(state, "{\"pattern\": \"grid\", \"colors\": [\"#abc\", \"#abc\"], \"texture\": \"a\"}",
           AT "/texture");
    refuse(state, "{\"colors\": [\"#abc\", \"#abc\"]}", AT);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_normals_are_a_map_of_one),
        cmocka_unit_test(inside_there_is_one_of_both),
        cmocka_unit_test(from_afar_there_is_the_mean),
        cmocka_unit_test(smooth_patterns_have_the_mean_of_their_normals),
        cmocka_unit_test(parts_are_those_of_the_whole),
        cmocka_unit_test(spectra_see_the_same),
        cmocka_unit_test(tags_tell_patterns_apart),
        cmocka_unit_test(what_is_no_normal_is_refused),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
