/* Patterns and pictures in spectral scenes: radiance is linear in the colors that are lifted. */
#include "property/put_picture.h"

/* A ball, a gouraud ring and a flat box of one material over a floor. */
static const char all[] =
    "{\"spectral\": true, \"image\": {\"width\": 48, \"height\": 36, \"samples\": 1}, \"camera\": "
    "{\"position\": [0, 1.8, 7], \"target\": [0, 0.1, 0], \"fov\": 34}, \"ambient\": "
    "{\"spectrum\": \"F2\", \"scale\": 0.3}, \"background\": [0.1, 0.2, 0.3], \"lights\": "
    "[{\"type\": \"point\", \"position\": [3, 4, 6], \"color\": {\"spectrum\": \"A\"}}, {\"type\": "
    "\"directional\", \"direction\": [1, -0.6, -0.5], \"color\": [0.2, 0.5, 0.4]}], %s"
    "\"materials\": {\"m\": {%s\"ambient\": 0.5, %s}}, \"objects\": [{\"type\": \"sphere\", "
    "\"material\": \"m\", \"transform\": {\"translate\": [0.2, 0.8, 0]}}, {\"type\": \"torus\", "
    "\"segments\": 12, \"interpolation\": \"gouraud\", \"material\": \"m\", \"transform\": "
    "{\"rotate\": [50, 0, 0], \"translate\": [-2, 0.2, 0]}}, {\"type\": \"box\", "
    "\"interpolation\": \"flat\", \"material\": \"m\", \"transform\": {\"rotate\": [20, 30, 0], "
    "\"translate\": [1.9, 0, 0], \"scale\": 1.3}}, {\"type\": \"plane\", \"material\": "
    "{\"diffuse\": {\"spectrum\": \"TCS03\"}%s}, \"transform\": {\"translate\": [0, -1, 0]}}%s]}";

/* Behind a colored pane, over a colored mirror, rays carry bins. */
static const struct {
    const char *further, *floor, *pane;
} ways[] = {
    {"", "", ""},
    {"\"trace\": {\"shadows\": true}, ", "", ""},
    {"\"trace\": {\"shadows\": true, \"depth\": 2}, ", ", \"reflection\": [0.9, 0.6, 0.3]",
     ", {\"type\": \"disc\", \"radius\": 0.8, \"material\": {\"opacity\": [0.2, 0.6, 0.8], "
     "\"diffuse\": 0.1}, \"transform\": {\"rotate\": [90, 0, 0], \"translate\": [0.8, 0.5, 2]}}"}};
enum { WAYS = sizeof ways / sizeof ways[0] };

static const char *const models[] = {
    "", "\"model\": \"phong-normalized\", ",
    "\"model\": \"cook-torrance\", \"fresnel\": {\"n\": \"gold\", \"k\": \"gold\"}, "};

static drawn draw(shd_engine *engine, int way, const char *model, const char *coefficient) {
    char *text =
        text_of(all, ways[way].further, model, coefficient, ways[way].floor, ways[way].pane);
    const drawn d = film_of(engine, text);
    free(text);
    return d;
}

#define PATTERN(low, high)                                                                         \
    "{\"pattern\": \"gradient\", \"colors\": [" low ", " high                                      \
    "], \"uv\": {\"scale\": [3, 2], \"wrap\": \"mirror\", \"rotate\": 30}}"
#define LOW  "[0.1, 0.6, 0.3]"
#define HIGH "[0.8, 0.2, 0.05]"
#define GLOW "\"diffuse\": 0, \"emissive\": "

/* The largest difference of `mixed` to low + sum of w[i] (ends[i] - low), and how many pixels tell
 * of it. w: what glows less what does not. Without rays that change it, light that glows is seen as
 * it is. */
static double off_of(const drawn *mixed, const drawn *low, const drawn *ends, size_t count,
                     const drawn *glow, const drawn *dark, size_t *seen) {
    double most = 0;
    *seen = 0;
    for (size_t i = 0; i < pixels_of(low); i++) {
        double expected[3], moved = 0;
        for (size_t c = 0; c < 3; c++) expected[c] = (double)low->film.rgba[4 * i + c];
        for (size_t k = 0; k < count; k++) {
            const double w =
                (double)glow->film.rgba[4 * i + k] - (double)dark->film.rgba[4 * i + k];
            for (size_t c = 0; c < 3; c++) {
                const double end = (double)ends[k].film.rgba[4 * i + c],
                             step = w * (end - (double)low->film.rgba[4 * i + c]);
                expected[c] += step;
                moved = fmax(moved, fabs(step));
            }
        }
        *seen += moved > 2e-4;
        for (size_t c = 0; c < 3; c++)
            most = fmax(most, fabs((double)mixed->film.rgba[4 * i + c] - expected[c]));
    }
    return most;
}

/* Of one field. */
static void patterns_mix_two_reflectances(void **state) {
    for (int way = 0; way < 2; way++)
        for (int m = 0; m < 2; m++)
            for (int k = 0; k < 2; k++) {
                const char *term =
                    k ? "\"diffuse\": 0.3, \"specular\": " : "\"specular\": 0.2, \"diffuse\": ";
                char *texts[3] = {text_of("%s%s", term, LOW), text_of("%s%s", term, HIGH),
                                  text_of("%s%s", term, PATTERN(LOW, HIGH))};
                drawn low = draw(*state, way, models[m], texts[0]),
                      high = draw(*state, way, models[m], texts[1]),
                      mixed = draw(*state, way, models[m], texts[2]),
                      dark = draw(*state, way, models[m], GLOW "0"),
                      glow = draw(*state, way, models[m], GLOW PATTERN("0", "1"));
                size_t seen;
                assert_int_equal(mixed.request->rendering.plan->part_count, 2);
                assert_below(off_of(&mixed, &low, &high, 1, &glow, &dark, &seen), 1e-6);
                assert_true(seen > 40);
                drop_drawn(&low);
                drop_drawn(&high);
                drop_drawn(&mixed);
                drop_drawn(&dark);
                drop_drawn(&glow);
                for (int t = 0; t < 3; t++) free(texts[t]);
            }
}

/* Of a field for each component, each of which is a reflectance. */
static void pictures_mix_three(void **state) {
    const put_name noise = put_noise(*state, 9, 7, 5);
    static const char *const ends[] = {"[1, 0, 0]", "[0, 1, 0]", "[0, 0, 1]"};
    for (int way = 0; way < 2; way++)
        for (int k = 0; k < 2; k++) {
            const char *term = k ? "\"diffuse\": 0.3, \"specular\": " : "\"diffuse\": ";
            char *picture = text_of("{\"texture\": \"%s\"}", noise.text),
                 *given = text_of("%s%s", term, picture), *black = text_of("%s0", term),
                 *shines = text_of(GLOW "%s", picture);
            drawn mixed = draw(*state, way, "", given), low = draw(*state, way, "", black), one[3],
                  glow = draw(*state, way, "", shines), dark = draw(*state, way, "", GLOW "0");
            for (int c = 0; c < 3; c++) {
                char *end = text_of("%s%s", term, ends[c]);
                one[c] = draw(*state, way, "", end);
                free(end);
            }
            size_t seen;
            assert_below(off_of(&mixed, &low, one, 3, &glow, &dark, &seen), 1e-6);
            assert_true(seen > 40);
            drop_drawn(&mixed);
            drop_drawn(&low);
            drop_drawn(&glow);
            drop_drawn(&dark);
            for (int c = 0; c < 3; c++) drop_drawn(&one[c]);
            free(picture);
            free(given);
            free(black);
            free(shines);
        }
}

/* What is ambient mixes as all light does. */
static void ambient_light_is_mixed_by_bins(void **state) {
    const put_name noise = put_noise(*state, 9, 7, 5);
    char *given = text_of("\"diffuse\": 0, \"emissive\": 0, \"ambient\": {\"texture\": \"%s\"}",
                          noise.text),
         *shines = text_of(GLOW "{\"texture\": \"%s\"}", noise.text);
    static const char plain[] =
        "{\"spectral\": true, \"image\": {\"width\": 16, \"height\": 16, \"samples\": 1}, "
        "\"lights\": [], \"ambient\": {\"spectrum\": \"F2\"}, \"objects\": [{\"type\": "
        "\"sphere\", \"material\": {%s}}]}";
    char *texts[6] = {text_of(plain, given),
                      text_of(plain, "\"diffuse\": 0"),
                      text_of(plain, shines),
                      text_of(plain, "\"diffuse\": 0, \"ambient\": [1, 0, 0]"),
                      text_of(plain, "\"diffuse\": 0, \"ambient\": [0, 1, 0]"),
                      text_of(plain, "\"diffuse\": 0, \"ambient\": [0, 0, 1]")};
    drawn d[6];
    for (int k = 0; k < 6; k++) d[k] = film_of(*state, texts[k]);
    size_t seen;
    assert_below(off_of(&d[0], &d[1], &d[3], 3, &d[2], &d[1], &seen), 1e-6);
    assert_true(seen > 50);
    for (int k = 0; k < 6; k++) {
        drop_drawn(&d[k]);
        free(texts[k]);
    }
    free(given);
    free(shines);
}

/* In all ways and models, the reflectance is that of the color, to the bit but in sums of bins. */
static void equal_colors_are_one_color(void **state) {
    static const char *const shine[][2] = {
        {"\"specular\": 0.4", "\"specular\": " PATTERN("0.4", "0.4")},
        {"\"specular\": 0.4", "\"specular\": " PATTERN("0.4", "0.4")},
        {"\"lobes\": [{\"roughness\": 0.3}]", "\"lobes\": [{\"roughness\": 0.3}]"}};
    for (int way = 0; way < WAYS; way++)
        for (int m = 0; m < 3; m++) {
            char *texts[2] = {
                text_of("\"diffuse\": " LOW ", \"emissive\": [0.1, 0, 0.2], %s", shine[m][0]),
                text_of("\"diffuse\": " PATTERN(LOW, LOW) ", \"emissive\": " PATTERN(
                            "[0.1, 0, 0.2]", "[0.1, 0, 0.2]") ", %s",
                        shine[m][1])};
            drawn one = draw(*state, way, models[m], texts[0]),
                  same = draw(*state, way, models[m], texts[1]);
            assert_true(one.request->rendering.plan->tinted == (way == 2));
            assert_true(same_film(&one, &same));
            drop_drawn(&one);
            drop_drawn(&same);
            for (int t = 0; t < 2; t++) free(texts[t]);
        }
}

/* What rays that carry bins see of a pattern is between what they see of its colors, as light is,
 * and what they see of one is linear in it: half a checker, seen fine, is half of both. */
static void tinted_rays_mix_what_they_meet(void **state) {
#define FINE(low, high)                                                                            \
    "{\"pattern\": \"checker\", \"colors\": [" low ", " high "], \"uv\": {\"scale\": 1e6}}"
    static const char *const terms[] = {
        "\"diffuse\": ", "\"diffuse\": 0.1, \"specular\": ", "\"diffuse\": 0.1, \"emissive\": "};
    for (int k = 0; k < 3; k++) {
        char *texts[3] = {text_of("%s%s", terms[k], LOW), text_of("%s%s", terms[k], HIGH),
                          text_of("%s%s", terms[k], FINE(LOW, HIGH))};
        drawn low = draw(*state, 2, "", texts[0]), high = draw(*state, 2, "", texts[1]),
              mixed = draw(*state, 2, "", texts[2]);
        double most = 0, moved = 0;
        for (size_t i = 0; i < 4 * pixels_of(&low); i++) {
            const double a = (double)low.film.rgba[i], b = (double)high.film.rgba[i];
            most = fmax(most, fabs((double)mixed.film.rgba[i] - (a + b) / 2));
            moved = fmax(moved, fabs(a - b));
        }
        assert_true(moved > 0.1);
        assert_below(most, 1e-6);
        drop_drawn(&low);
        drop_drawn(&high);
        drop_drawn(&mixed);
        for (int t = 0; t < 3; t++) free(texts[t]);
    }
}

/* An opacity is one number for all bins: half of fine holes let half through. */
static void holes_let_all_bins_through(void **state) {
    for (int way = 1; way < WAYS; way++) {
        drawn half = draw(*state, way, "", "\"diffuse\": 0.4, \"opacity\": 0.5"),
              net = draw(*state, way, "", "\"diffuse\": 0.4, \"opacity\": " FINE("0", "1"));
        assert_true(half.request->rendering.plan->bound.linear < 1e-3);
        assert_below(film_difference(&half, &net), 1e-6);
        drop_drawn(&half);
        drop_drawn(&net);
    }
}

/* What is mixed is read from the tables of environments, too, which the standard tier has. */
static void environments_light_what_is_mixed(void **state) {
    static const char *const materials[] = {
        "\"specular\": 0.3, \"shininess\": 20, \"diffuse\": " LOW,
        "\"specular\": 0.3, \"shininess\": 20, \"diffuse\": " PATTERN(LOW, LOW)};
    for (int m = 0; m < 2; m++) {
        drawn plain[2];
        for (int k = 0; k < 2; k++) {
            char *text = text_of(
                "{\"spectral\": true, \"image\": {\"width\": 16, \"height\": 12, \"samples\": 1}, "
                "\"lights\": [{\"type\": \"environment\", \"map\": \"sky\", \"visible\": false}, "
                "{\"type\": \"environment\", \"map\": \"studio\", \"visible\": false}], "
                "\"objects\": [{\"type\": \"sphere\", \"material\": {%s%s}}]}",
                m ? models[1] : "", materials[k]);
            plain[k] = shown_film_of(*state, text);
            free(text);
        }
        assert_non_null(plain[1].request->rendering.plan->glows);
        assert_below(film_difference(&plain[0], &plain[1]), 1e-6);
        drop_drawn(&plain[0]);
        drop_drawn(&plain[1]);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(patterns_mix_two_reflectances),
        cmocka_unit_test(pictures_mix_three),
        cmocka_unit_test(ambient_light_is_mixed_by_bins),
        cmocka_unit_test(equal_colors_are_one_color),
        cmocka_unit_test(tinted_rays_mix_what_they_meet),
        cmocka_unit_test(holes_let_all_bins_through),
        cmocka_unit_test(environments_light_what_is_mixed),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
