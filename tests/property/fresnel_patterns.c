/* What facets mirror at a right angle as a pattern or a picture: beside plain colors of it, which
 * have one index for all points. */
#include "property/pieces.h"
#include "property/put_picture.h"
#include "scene/read.h"

/* A ball of facets in some light; `top` is put at the scene's beginning, `more` into the material.
 */
typedef struct look {
    const char *top, *lights, *more;
    bool slow; /* some pixels of it are enough */
} look;

#define LAMPS                                                                                      \
    "{\"type\": \"point\", \"position\": [3, 2, 2.5], \"color\": [1, 0.8, 0.6]}, {\"type\": "      \
    "\"directional\", \"direction\": [1, -0.3, 0.2]}, {\"type\": \"spot\", \"position\": [0, 4, "  \
    "0], \"direction\": [0, -1, 0.1], \"angle\": 40}"
#define SHAPES                                                                                     \
    "{\"type\": \"rect\", \"position\": [-3, 0, 1], \"direction\": [1, 0, -0.2], \"size\": [1, "   \
    "2], \"intensity\": 3}, {\"type\": \"sphere\", \"position\": [2, 3, 1], \"radius\": 0.5}"
#define FACETS                                                                                     \
    "\"diffuse\": 0.1, \"lobes\": [{\"roughness\": 0.3, \"weight\": 0.7}, {\"roughness\": 0.7, "   \
    "\"weight\": 0.3}]"
#define MIRROR "\"trace\": {\"depth\": 2}, "

static const look looks[] = {
    {"", LAMPS, "", false},
    {"\"trace\": {\"shadows\": true}, ", LAMPS, "", false},
    {"\"spectral\": true, ", LAMPS, "", false},
    {"\"spectral\": true, " MIRROR, LAMPS, ", \"reflection\": [0.1, 0, 0.2]", false},
    {"", LAMPS, ", \"specularAntialiasing\": true", false},
    {"", LAMPS, ", \"normal\": {\"pattern\": \"checker\", \"colors\": [\"#c080f0\", \"#4080f0\"]}",
     false},
    {"\"accuracy\": {\"tier\": \"exact\"}, ", SHAPES, "", true},
    {"\"accuracy\": {\"tier\": \"exact\"}, ", "{\"type\": \"environment\", \"map\": \"studio\"}",
     "", true},
    {MIRROR, LAMPS, ", \"reflection\": 0.2", false},
    {"\"spectral\": {\"channels\": 16}, ", "{\"type\": \"environment\", \"map\": \"studio\"}", "",
     true},
};

/* What is drawn of slow ones: a part that has light, shadow and an edge. */
enum { LEFT = 12, TOP = 7, WIDE = 4 };
#define PART "\"region\": [12, 7, 4, 1], "

static char *ball(const look *l, int samples, const char *f0, const char *size) {
    return text_of(
        "{%s\"image\": {\"width\": 24, \"height\": 18, %s\"samples\": %d}, \"background\": [0.1, "
        "0.2, 0.3], \"camera\": {\"position\": [0.6, 0.9, 3.6], \"fov\": 44}, \"lights\": [%s], "
        "\"objects\": [{\"type\": \"sphere\", \"material\": {\"model\": \"cook-torrance\", " FACETS
        ", \"fresnel\": {\"f0\": %s}%s}}, {\"type\": \"plane\", \"transform\": {\"translate\": [0, "
        "-1, 0]}, \"material\": {\"diffuse\": 0.2, \"reflection\": 0.6}}]}",
        l->top, size, samples, l->lights, f0, l->more);
}

#define STEEL "[0.56, 0.57, 0.58]"
#define GOLD  "[1, 0.71, 0.29]"

/* To the bit: what is alike at all points is what plain colors are, by kernels that know one index
 * and by those that know many, in vectors and beside them. */
static void equal_colors_are_one_color(void **state) {
    static const char *const colors[] = {STEEL, GOLD, "[0, 0.04, 1]"};
    for (size_t k = 0; k < SHD_LENGTH(looks); k++) {
        const char *color = colors[k % SHD_LENGTH(colors)];
        const char *part = looks[k].slow ? PART : "";
        char *same = text_of("{\"pattern\": \"noise\", \"colors\": [%s, %s], \"uv\": {\"scale\": "
                             "[9, 4]}}",
                             color, color),
             *one = ball(&looks[k], 2, color, part), *other = ball(&looks[k], 2, same, part);
        drawn a = film_of(*state, one), b = film_of(*state, other);
        assert_true(b.request->rendering.plan->textured);
        for (size_t i = 0; i < 4 * pixels_of(&a); i++)
            if (!(fabs((double)a.film.rgba[i] - (double)b.film.rgba[i]) <=
                  1e-7 * fmax(1, fabs((double)a.film.rgba[i]))))
                fail_msg("look %zu, component %zu: %.9g, %.9g", k, i, (double)a.film.rgba[i],
                         (double)b.film.rgba[i]);
        drop_drawn(&a);
        drop_drawn(&b);
        free(one);
        free(other);
        free(same);
    }
}

/* The field that a pattern or a picture is at each pixel's middle, which glows here. */
static drawn glow_of(shd_engine *engine, const char *pattern) {
    static const char dark[] =
        "{\"image\": {\"width\": 24, \"height\": 18, \"samples\": 1}, \"camera\": {\"position\": "
        "[0.6, 0.9, 3.6], \"fov\": 44}, \"background\": [0, 0, 0], \"lights\": [], \"objects\": "
        "[{\"type\": \"sphere\", \"material\": {\"diffuse\": 0, \"emissive\": %s}}, {\"type\": "
        "\"plane\", \"transform\": {\"translate\": [0, -1, 0]}, \"material\": {\"diffuse\": 0, "
        "\"emissive\": 0}}]}";
    char *text = text_of(dark, pattern);
    const drawn out = shown_film_of(engine, text);
    free(text);
    return out;
}

/* Where a pixel sees one check there is the light of that color alone, to the bit. */
static void checks_are_two_plain_pictures(void **state) {
    static const char format[] = "{\"pattern\": \"checker\", \"colors\": [%s, %s], \"uv\": "
                                 "{\"scale\": [5, 3], \"rotate\": 20}}";
    char *two = text_of(format, STEEL, GOLD), *field = text_of(format, "0", "1");
    drawn mask = glow_of(*state, field);
    for (size_t k = 0; k < SHD_LENGTH(looks); k++) {
        if (strstr(looks[k].top, "depth")) continue; /* what mirrors see is beside */
        const char *part = looks[k].slow ? PART : "";
        char *texts[] = {ball(&looks[k], 1, STEEL, part), ball(&looks[k], 1, GOLD, part),
                         ball(&looks[k], 1, two, part)};
        drawn d[3];
        size_t seen[2] = {0, 0};
        for (int i = 0; i < 3; i++) d[i] = film_of(*state, texts[i]);
        for (size_t i = 0; i < pixels_of(&d[2]); i++) {
            const size_t at = looks[k].slow ? 24 * (TOP + i / WIDE) + LEFT + i % WIDE : i;
            const float w = mask.film.rgba[4 * at];
            if (w != 0 && w != 1) continue;
            const drawn *of = &d[w == 1];
            for (size_t c = 0; c < 3; c++) {
                const double is = (double)d[2].film.rgba[4 * i + c],
                             was = (double)of->film.rgba[4 * i + c];
                if (!(fabs(is - was) <= 1e-7 * fmax(1, was)))
                    fail_msg("look %zu, pixel %zu: %.9g, %.9g", k, i, is, was);
            }
            seen[w == 1]++;
        }
        const size_t least = looks[k].slow ? 0 : 20;
        if (!(seen[0] > least && seen[1] > least))
            fail_msg("look %zu: %zu and %zu", k, seen[0], seen[1]);
        assert_true(film_difference(&d[0], &d[1]) > 0.02);
        for (int i = 0; i < 3; i++) drop_drawn(&d[i]), free(texts[i]);
    }
    drop_drawn(&mask);
    free(two);
    free(field);
}

/* One pixel of the ball, of a plain color. */
static void light_pixel(shd_engine *engine, const look *l, const float f0[3], int x, int y,
                        float out[3]) {
    char *color = text_of("[%.9g, %.9g, %.9g]", (double)f0[0], (double)f0[1], (double)f0[2]),
         *cut = text_of("\"region\": [%d, %d, 1, 1], ", x, y), *text = ball(l, 1, color, cut);
    drawn d = film_of(engine, text);
    for (int c = 0; c < 3; c++) out[c] = d.film.rgba[c];
    drop_drawn(&d);
    free(color);
    free(cut);
    free(text);
}

/* Between two colors, and between texels, there is the index of the mean color. */
static void check_means(shd_engine *engine, const look *l, const char *pattern) {
    drawn glow = glow_of(engine, pattern);
    char *text = ball(l, 1, pattern, "");
    drawn d = film_of(engine, text);
    for (int y = 3; y < 15; y += 4)
        for (int x = 8; x < 17; x += 2) {
            const float *f0 = glow.film.rgba + 4 * (24 * y + x),
                        *is = d.film.rgba + 4 * (24 * y + x);
            float plain[3];
            light_pixel(engine, l, f0, x, y, plain);
            for (int c = 0; c < 3; c++) assert_true(fabs((double)is[c] - (double)plain[c]) < 4e-6);
        }
    drop_drawn(&glow);
    drop_drawn(&d);
    free(text);
}

static void points_have_the_index_of_their_mean(void **state) {
    const put_name picture = put_noise(*state, 5, 4, 7);
    char *texels = text_of("{\"texture\": \"%s\", \"tint\": [0.9, 1, 0.7], \"uv\": {\"scale\": "
                           "[3, 2]}}",
                           picture.text);
    check_means(*state, &looks[0], texels);
    check_means(*state, &looks[0],
                "{\"pattern\": \"gradient\", \"colors\": [[0, 0.3, 0.02], [0.9, 0.1, 1]], \"uv\": "
                "{\"scale\": 3, \"wrap\": \"mirror\"}}");
    free(texels);
}

/* Two things of one material in other colors are drawn as each is alone: which is what a group of
 * points that see several is for. */
static void groups_keep_their_colors(void **state) {
    static const char scene[] =
        "{\"image\": {\"width\": 32, \"height\": 16, \"samples\": 1}, \"camera\": {\"position\": "
        "[0, 0, 5], \"fov\": 30}, \"background\": [0, 0, 0], \"objects\": [{\"type\": \"sphere\", "
        "\"transform\": {\"translate\": [-1.2, 0, 0]}, \"material\": {\"model\": "
        "\"cook-torrance\", \"fresnel\": {\"f0\": {\"pattern\": \"checker\", \"colors\": [%s, %s], "
        "\"uv\": {\"scale\": [8, 4]}}}}}, {\"type\": \"sphere\", \"transform\": {\"translate\": "
        "[1.2, 0, 0]}, \"material\": {\"model\": \"cook-torrance\", \"fresnel\": {\"f0\": "
        "{\"pattern\": \"checker\", \"colors\": [%s, %s], \"uv\": {\"scale\": [8, 4]}}}}}]}";
    char *texts[] = {text_of(scene, STEEL, GOLD, GOLD, "0.04"),
                     text_of(scene, STEEL, GOLD, STEEL, GOLD),
                     text_of(scene, GOLD, "0.04", GOLD, "0.04")};
    drawn d[3];
    for (int i = 0; i < 3; i++) d[i] = film_of(*state, texts[i]);
    for (size_t i = 0; i < pixels_of(&d[0]); i++)
        assert_memory_equal(d[0].film.rgba + 4 * i, d[i % 32 < 16 ? 1 : 2].film.rgba + 4 * i,
                            4 * sizeof(float));
    assert_int_equal(d[0].request->rendering.plan->group_count, 2);
    assert_int_equal(d[1].request->rendering.plan->group_count, 1);
    for (int i = 0; i < 3; i++) drop_drawn(&d[i]), free(texts[i]);
}

/* In the light of an environment the standard tier walks in f32, within what is told. */
static void walks_are_as_near_as_is_told(void **state) {
    static const char checks[] = "{\"pattern\": \"gradient\", \"colors\": [0, [1, 0.71, 0.29]], "
                                 "\"uv\": {\"scale\": 2, \"wrap\": \"mirror\"}}";
    const look around = {"\"accuracy\": {\"tier\": \"standard\"}, ",
                         "{\"type\": \"environment\", \"map\": \"studio\"}", "", true},
               exactly = {"\"accuracy\": {\"tier\": \"exact\"}, ", around.lights, "", true};
    char *fast = ball(&around, 1, checks, PART), *full = ball(&exactly, 1, checks, PART);
    drawn a = shown_film_of(*state, fast), b = shown_film_of(*state, full);
    check_bound(&a, &b, 0.1);
    drop_drawn(&a);
    drop_drawn(&b);
    free(fast);
    free(full);
}

static void parts_are_those_of_the_whole(void **state) {
    shd_engine *portable = new_engine_of(1, "portable");
    char *text = text_of(
        "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": 4}, \"camera\": {\"position\": "
        "[0.6, 0.9, 3.6], \"fov\": 44}, \"lights\": [" LAMPS "], \"objects\": [{\"type\": "
        "\"sphere\", \"material\": {\"model\": \"cook-torrance\", \"fresnel\": {\"f0\": "
        "{\"pattern\": \"noise\", \"colors\": [[0, 0.2, 1], 0.9], \"uv\": {\"scale\": [30, "
        "12]}}}}}]}");
    check_region(*state, portable, text);
    free(text);
    shd_engine_drop(portable);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(equal_colors_are_one_color),
        cmocka_unit_test(checks_are_two_plain_pictures),
        cmocka_unit_test(points_have_the_index_of_their_mean),
        cmocka_unit_test(groups_keep_their_colors),
        cmocka_unit_test(walks_are_as_near_as_is_told),
        cmocka_unit_test(parts_are_those_of_the_whole),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
