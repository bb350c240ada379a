/* Opacities that are patterns, and patterns that further rays see: closed forms, and pictures that
 * must be alike. */
#include "property/pieces.h"

/* Pixels are units: the plane's checks are theirs. */
static const char panes[] =
    "{\"image\": {\"width\": 32, \"height\": 24, \"samples\": %d%s}, \"accuracy\": {\"tier\": "
    "\"exact\"}, \"trace\": {\"depth\": %d, \"shadows\": %s}, \"background\": %s, \"camera\": "
    "{\"type\": \"orthographic\", \"height\": 24, \"position\": [0, 0, 20]}, \"ambient\": %g, "
    "\"lights\": [%s], \"objects\": [%s]}";

static char *pane(double z, const char *opacity, const char *color) {
    return text_of("{\"type\": \"plane\", \"material\": {\"diffuse\": %s, \"opacity\": %s}, "
                   "\"transform\": {\"rotate\": [90, 0, 0], \"translate\": [0, 0, %g]}}",
                   color, opacity, z);
}

#define CHECKS(low, high)                                                                          \
    "{\"pattern\": \"checker\", \"colors\": [" low ", " high "], \"uv\": {\"scale\": 0.25}}"

/* Footprints are sheared by 1e-4 of a wave where they would lie along its edges (shade/wave.h). */
static const double NEAR = 1e-3;

static double red(const drawn *d, size_t x, size_t y) {
    return (double)d->film.rgba[4 * (y * (size_t)d->film.width + x)];
}

/* Two checkered panes before a background: one check apart, they hide it together. */
static void checks_are_holes(void **state) {
    char *front = pane(2, CHECKS("0", "1"), "0.5"), *back = pane(1, CHECKS("1", "0.25"), "0.9"),
         *both = text_of("%s, %s", front, back),
         *text = text_of(panes, 1, "", 4, "false", "[0.1, 0.1, 0.1]", 1.0, "", both),
         *only = text_of(panes, 1, "", 4, "false", "[0.1, 0.1, 0.1]", 1.0, "", back);
    drawn d = film_of(*state, text), e = film_of(*state, only);
    for (size_t y = 0; y < 24; y++)
        for (size_t x = 0; x < 32; x++) {
            const double seen = red(&d, x, y), alone = red(&e, x, y),
                         quarter = 0.25 * 0.9 + 0.75 * 0.1;
            const bool first = fabs(seen - 0.5) < NEAR, odd = (x / 4 + y / 4) % 2;
            /* A hole of the first shows the second where that is opaque. */
            assert_true(first || fabs(seen - 0.9) < NEAR);
            assert_true(first == (odd == ((double)d.film.rgba[4 * 4] < 0.7)));
            assert_true(fabs(alone - (first ? quarter : 0.9)) < NEAR);
        }
    drop_drawn(&d);
    drop_drawn(&e);
    free(front);
    free(back);
    free(both);
    free(text);
    free(only);
}

/* Light that falls straight through a checkered pane onto a wall. The pane itself is not seen. */
static void shadows_have_holes(void **state) {
    char *front = pane(40, CHECKS("0", "[1, 0.5, 0]"), "0"), *wall = pane(0, "1", "0.8"),
         *both = text_of("%s, %s", front, wall),
         *text = text_of(panes, 1, "", 0, "true", "[0, 0, 0]", 0.0,
                         "{\"type\": \"directional\", \"direction\": [0, 0, -1]}", both);
    drawn d = film_of(*state, text);
    for (size_t y = 0; y < 24; y++)
        for (size_t x = 4; x < 32; x++) {
            const float *here = d.film.rgba + 4 * (y * 32 + x), *left = here - 16;
            const bool lit = (double)*here > 0.4;
            assert_true(fabs((double)here[0] - (lit ? 0.8 : 0)) < NEAR);
            assert_true(fabs((double)here[1] - (lit ? 0.8 : 0.4)) < NEAR);
            assert_true(fabs((double)here[2] - 0.8) < NEAR);
            assert_true(lit == ((double)*left < 0.4));
        }
    drop_drawn(&d);
    free(front);
    free(wall);
    free(both);
    free(text);
}

/* A pattern of one value is that opacity, for the eye, for light and for what is mirrored. */
static void equal_values_are_one_opacity(void **state) {
    static const char scene[] =
        "{\"image\": {\"width\": 48, \"height\": 32, \"samples\": 4}, \"accuracy\": {\"tier\": "
        "\"exact\"}, \"trace\": {\"depth\": 5, \"shadows\": true}, \"camera\": {\"position\": [0, "
        "1.5, 5]}, \"background\": %s, \"lights\": [{\"type\": \"point\", \"position\": [2, 4, "
        "3]}], \"objects\": [{\"type\": \"sphere\", \"material\": {\"opacity\": %s, "
        "\"reflection\": 0.2}}, {\"type\": \"torus\", \"radius\": 1.6, \"tube\": 0.3, "
        "\"material\": {\"diffuse\": [0.8, 0.2, 0.1], \"opacity\": %s}}, {\"type\": \"plane\", "
        "\"material\": {\"reflection\": 0.4}, \"transform\": {\"translate\": [0, -1.1, 0]}}]}";
#define SAME(value) "{\"pattern\": \"noise\", \"colors\": [" value ", " value "]}"
    for (int k = 0; k < 2; k++) {
        const char *behind = k ? "null" : "[0.2, 0.3, 0.6]";
        char *one = text_of(scene, behind, "0.4", "[0.9, 0.5, 0.3]"),
             *other = text_of(scene, behind, SAME("0.4"), SAME("[0.9, 0.5, 0.3]"));
        drawn a = film_of(*state, one), b = film_of(*state, other);
        assert_true(isfinite(b.request->rendering.plan->bound.linear));
        assert_below(film_difference(&a, &b), 1e-6);
        drop_drawn(&a);
        drop_drawn(&b);
        free(one);
        free(other);
    }
}

/* What a flat mirror shows is what a camera behind it would see the other way around. */
static void mirrors_show_patterns(void **state) {
    static const char scene[] =
        "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": 4}, \"accuracy\": {\"tier\": "
        "\"exact\"}, \"trace\": {\"depth\": %d}, \"camera\": {\"position\": [0.3, 1, %d], "
        "\"target\": [0.3, 0.5, 0]}, \"ambient\": 1, \"lights\": [], \"objects\": [{\"type\": "
        "\"plane\", \"material\": {\"diffuse\": " CHECKS(
            "0.1", "0.8") "}}, {\"type\": \"sphere\", \"radius\": 0.8, \"material\": {\"diffuse\": "
                          "{\"pattern\": \"grid\", \"colors\": [[0.9, 0.2, 0.1], 0.2], \"uv\": "
                          "{\"scale\": [16, 8]}}, \"opacity\": {\"pattern\": \"checker\", "
                          "\"colors\": [0.2, 1], \"uv\": {\"scale\": [8, 4]}}}, \"transform\": "
                          "{\"translate\": [0, 0.8, 5]}}%s]}";
    static const char mirror[] =
        ", {\"type\": \"box\", \"size\": [99, 99, 1], \"material\": {\"diffuse\": 0, \"ambient\": "
        "0, \"reflection\": 1}, \"transform\": {\"translate\": [0, 0, -0.5]}}";
    char *direct = text_of(scene, 4, -3, ""), *seen = text_of(scene, 5, 3, mirror);
    drawn a = film_of(*state, direct), b = film_of(*state, seen);
    double square = 0, count = 0, light[2] = {0, 0};
    for (size_t y = 0; y < 33; y++) /* above the foot of the mirror */
        for (size_t x = 0; x < 64; x++) {
            const double one = red(&a, 63 - x, y), other = red(&b, x, y);
            square += (one - other) * (one - other);
            light[0] += one;
            light[1] += other;
            count++;
        }
    assert_below(fabs(light[1] / light[0] - 1), 0.02);
    assert_below(sqrt(square / count), 0.03);
    drop_drawn(&a);
    drop_drawn(&b);
    free(direct);
    free(seen);
}

static void regions_are_crops(void **state) {
    char *front = pane(2, CHECKS("0.1", "[1, 0.4, 0.2]"), CHECKS("0.1", "0.9")),
         *back = pane(-1, CHECKS("1", "0"), "[0.2, 0.7, 0.9]"),
         *both = text_of("%s, %s", front, back),
         *whole = text_of(panes, 4, "", 4, "true", "null", 0.3,
                          "{\"type\": \"point\", \"position\": [3, 3, 9]}", both),
         *part = text_of(panes, 4, ", \"region\": [5, 3, 17, 11]", 4, "true", "null", 0.3,
                         "{\"type\": \"point\", \"position\": [3, 3, 9]}", both);
    drawn a = film_of(*state, whole), b = film_of(*state, part);
    assert_true(!isfinite(a.request->rendering.plan->bound.linear)); /* divided by no alpha */
    for (size_t y = 0; y < 11; y++)
        assert_memory_equal(a.film.rgba + 4 * ((y + 3) * 32 + 5), b.film.rgba + 4 * y * 17,
                            4 * 17 * sizeof *a.film.rgba);
    drop_drawn(&a);
    drop_drawn(&b);
    free(front);
    free(back);
    free(both);
    free(whole);
    free(part);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(checks_are_holes),
        cmocka_unit_test(shadows_have_holes),
        cmocka_unit_test(equal_values_are_one_opacity),
        cmocka_unit_test(mirrors_show_patterns),
        cmocka_unit_test(regions_are_crops),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
