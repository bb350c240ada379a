/* Mirrors and glass that are patterns and pictures: closed forms, and pictures that must be alike.
 */
#include "property/pieces.h"
#include "property/put_picture.h"

#define TWO(kind, low, high, scale)                                                                \
    "{\"pattern\": \"" kind "\", \"colors\": [" low ", " high "], \"uv\": {\"scale\": " scale "}}"
#define CHECKS(low, high) TWO("checker", low, high, "0.25")
#define SAME(value)       TWO("noise", value, value, "3")

/* A pane whose checks are 4 x 4 pixels. What it mirrors is a wall behind the eye, and what is seen
 * through it one behind it. */
static const char pane[] =
    "{\"image\": {\"width\": 32, \"height\": 24, \"samples\": %d%s}, \"trace\": {\"depth\": %d, "
    "\"minContribution\": %s}, \"camera\": {\"type\": \"orthographic\", \"height\": 24, "
    "\"position\": [0, 0, 20]}, \"ambient\": 1, \"lights\": [], \"objects\": [{\"type\": "
    "\"plane\", \"material\": {\"diffuse\": 0.1, \"ior\": 1, \"reflection\": %s, "
    "\"transmission\": %s}, \"transform\": {\"rotate\": [90, 0, 0]}}, {\"type\": \"plane\", "
    "\"material\": {\"diffuse\": [0.2, 0.6, 0.9]}, \"transform\": {\"rotate\": [90, 0, 0], "
    "\"translate\": [0, 0, 40]}}, {\"type\": \"plane\", \"material\": {\"diffuse\": [0.9, 0.5, "
    "0.3]}, \"transform\": {\"rotate\": [90, 0, 0], \"translate\": [0, 0, -7]}}]}";

/* Footprints are sheared by 1e-4 of a wave where they would lie along its edges (shade/wave.h). */
static const double NEAR = 1e-3;

static drawn pane_of(shd_engine *engine, const char *least, const char *mirrors,
                     const char *refracts) {
    char *text = text_of(pane, 1, "", 3, least, mirrors, refracts);
    const drawn d = film_of(engine, text);
    free(text);
    return d;
}

static double off_at(const drawn *a, const drawn *b, size_t at) {
    double most = 0;
    for (size_t c = 0; c < 3; c++)
        most =
            fmax(most, fabs((double)a->film.rgba[4 * at + c] - (double)b->film.rgba[4 * at + c]));
    return most;
}

/* That each pixel is one picture's or the other's, check by check. */
static void check_checks(const drawn *d, const drawn *one, const drawn *other) {
    const bool first = off_at(d, one, 0) < NEAR;
    for (size_t y = 0; y < 24; y++)
        for (size_t x = 0; x < 32; x++) {
            const size_t at = 32 * y + x;
            assert_true(off_at(one, other, at) > 0.05);
            const bool odd = (x / 4 + y / 4) % 2;
            assert_below(off_at(d, first != odd ? one : other, at), NEAR);
        }
}

static void checks_are_mirrors_and_glass(void **state) {
    drawn silver = pane_of(*state, "0", "[0.9, 0.8, 0.4]", "0"),
          glass = pane_of(*state, "0", "0", "0.9"),
          both = pane_of(*state, "0", CHECKS("[0.9, 0.8, 0.4]", "0"), CHECKS("0", "0.9")),
          plain = pane_of(*state, "0", "0.9", "0.9");
    check_checks(&both, &silver, &glass);
    /* Both on one field never add up to more than 0.9. */
    assert_true(both.request->rendering.plan->bound.linear <
                plain.request->rendering.plan->bound.linear);
    drop_drawn(&silver);
    drop_drawn(&glass);
    drop_drawn(&both);
    drop_drawn(&plain);
}

static void faint_checks_send_no_rays(void **state) {
    drawn bright = pane_of(*state, "0.1", "0.5", "0"), dull = pane_of(*state, "0.1", "0", "0"),
          cut = pane_of(*state, "0.1", CHECKS("0.5", "0.08"), "0"),
          all = pane_of(*state, "0", CHECKS("0.5", "0.08"), "0");
    check_checks(&cut, &bright, &dull);
    assert_true(off_at(&all, &cut, 0) > 0.01 || off_at(&all, &cut, 4) > 0.01);
    assert_true(cut.request->rendering.rays < all.request->rendering.rays);
    drop_drawn(&bright);
    drop_drawn(&dull);
    drop_drawn(&cut);
    drop_drawn(&all);
}

static void regions_are_crops(void **state) {
    static const char mirrors[] = TWO("noise", "0", "[0.9, 0.5, 0.3]", "0.3"),
                      refracts[] = TWO("grid", "0.6", "0.1", "0.21");
    char *whole = text_of(pane, 4, "", 4, "0.001", mirrors, refracts),
         *part = text_of(pane, 4, ", \"region\": [5, 3, 17, 11]", 4, "0.001", mirrors, refracts);
    drawn a = film_of(*state, whole), b = film_of(*state, part);
    for (size_t y = 0; y < 11; y++)
        assert_memory_equal(a.film.rgba + 4 * ((y + 3) * 32 + 5), b.film.rgba + 4 * y * 17,
                            4 * 17 * sizeof *a.film.rgba);
    drop_drawn(&a);
    drop_drawn(&b);
    free(whole);
    free(part);
}

/* A pattern of one value is that coefficient, to the bit: seen by the eye and by further rays, on
 * shapes and on faces, and in spectral scenes whose rays carry bins. */
static void equal_values_are_one_coefficient(void **state) {
    static const char scene[] =
        "{%s\"image\": {\"width\": 40, \"height\": 30, \"samples\": 4}, \"trace\": {\"depth\": 5}, "
        "\"camera\": {\"position\": [0, 1.5, 5]}, \"background\": [0.2, 0.3, 0.6], \"lights\": "
        "[{\"type\": \"point\", \"position\": [2, 4, 3]}], \"objects\": [{\"type\": \"sphere\", "
        "\"material\": {\"transmission\": %s, \"ior\": 1.3}}, {\"type\": \"torus\", \"radius\": "
        "1.6, \"tube\": 0.3, \"interpolation\": \"gouraud\", \"material\": {\"diffuse\": [0.8, "
        "0.2, 0.1], \"reflection\": %s, \"opacity\": [0.9, 0.8, 0.7]}}, {\"type\": \"plane\", "
        "\"material\": {\"reflection\": %s}, \"transform\": {\"translate\": [0, -1.1, 0]}}]}";
    for (int k = 0; k < 2; k++) {
        const char *way = k ? "\"spectral\": true, " : "", *gold = k ? "0.6" : "[0.6, 0.4, 0.1]",
                   *gilt = k ? SAME("0.6") : SAME("[0.6, 0.4, 0.1]");
        char *one = text_of(scene, way, "0.7", gold, "0.3"),
             *other = text_of(scene, way, SAME("0.7"), gilt, SAME("0.3"));
        drawn a = film_of(*state, one), b = film_of(*state, other);
        assert_int_equal(b.request->rendering.plan->tinted, k);
        assert_true(b.request->rendering.plan->rayed[1] && b.request->rendering.plan->rayed[2]);
        assert_true(same_film(&a, &b));
        drop_drawn(&a);
        drop_drawn(&b);
        free(one);
        free(other);
    }
}

/* A picture of one color is that color, times its tint. */
static void pictures_are_mirrors(void **state) {
    const uint8_t one[4] = {128, 64, 255, 51};
    const put_name name = put_picture(*state, 1, 1, one);
    char *pictures[] = {text_of("{\"texture\": \"%s\", \"space\": \"lin_rec709\", \"tint\": [0.5, "
                                "1, 0.2]}",
                                name.text),
                        text_of("{\"texture\": \"%s\", \"channel\": \"A\"}", name.text)},
         *plain[] = {text_of("[%.17g, %.17g, 0.2]", 64.0 / 255, 64.0 / 255),
                     text_of("%.17g", 51.0 / 255)};
    for (int k = 0; k < 2; k++) {
        drawn a = pane_of(*state, "0", pictures[k], pictures[1]),
              b = pane_of(*state, "0", plain[k], plain[1]);
        assert_below(film_difference(&a, &b), 1e-7);
        drop_drawn(&a);
        drop_drawn(&b);
    }
    for (int k = 0; k < 2; k++) {
        free(pictures[k]);
        free(plain[k]);
    }
}

/* What a flat mirror shows is what a camera behind it would see the other way around. */
static void mirrors_show_mirrors_of_patterns(void **state) {
    static const char scene[] =
        "{\"image\": {\"width\": 64, \"height\": 48, \"samples\": 4}, \"trace\": {\"depth\": %d}, "
        "\"camera\": {\"position\": [0.3, 1, %d], \"target\": [0.3, 0.5, 0]}, \"background\": "
        "[0.9, 0.7, 0.4], \"ambient\": 1, \"lights\": [], \"objects\": [{\"type\": \"plane\", "
        "\"material\": {\"diffuse\": 0.05, \"reflection\": %s}}, {\"type\": \"sphere\", "
        "\"radius\": "
        "0.8, \"material\": {\"diffuse\": 0.1, \"ior\": 1.2, \"reflection\": %s, "
        "\"transmission\": %s}, \"transform\": {\"translate\": [0, 0.8, 5]}}%s]}",
                      floor[] = CHECKS("0.1", "0.8"),
                      lines[] = TWO("grid", "0", "[0.9, 0.4, 0.2]", "[16, 8]"),
                      panes[] = TWO("checker", "0.7", "0", "[8, 4]");
    static const char mirror[] =
        ", {\"type\": \"box\", \"size\": [99, 99, 1], \"material\": {\"diffuse\": 0, \"ambient\": "
        "0, \"reflection\": 1}, \"transform\": {\"translate\": [0, 0, -0.5]}}";
    char *direct = text_of(scene, 4, -3, floor, lines, panes, ""),
         *seen = text_of(scene, 5, 3, floor, lines, panes, mirror);
    drawn a = film_of(*state, direct), b = film_of(*state, seen);
    double square = 0, count = 0;
    for (size_t y = 0; y < 33; y++) /* above the foot of the mirror */
        for (size_t x = 0; x < 64; x++) {
            const double off =
                (double)a.film.rgba[4 * (64 * y + 63 - x)] - (double)b.film.rgba[4 * (64 * y + x)];
            square += off * off;
            count++;
        }
    assert_below(sqrt(square / count), 0.03);
    drop_drawn(&a);
    drop_drawn(&b);
    free(direct);
    free(seen);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(checks_are_mirrors_and_glass),
        cmocka_unit_test(faint_checks_send_no_rays),
        cmocka_unit_test(regions_are_crops),
        cmocka_unit_test(equal_values_are_one_coefficient),
        cmocka_unit_test(pictures_are_mirrors),
        cmocka_unit_test(mirrors_show_mirrors_of_patterns),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
