/* Patterns on flat and gouraud objects: light is interpolated, and multiplied by coefficients at
 * each sample. */
#include "property/pieces.h"
#include "property/reused.h"

/* Two objects of most shapes, faceted and not, of one material. */
static const char all[] =
    "{\"image\": {\"width\": 48, \"height\": 36, \"samples\": %d}, \"accuracy\": {\"tier\": "
    "\"%s\"}, \"camera\": {\"position\": [0, 1.8, 7], \"target\": [0, 0.1, 0], \"fov\": 40}, "
    "\"ambient\": [0.2, 0.3, 0.1], \"background\": [0.1, 0.2, 0.3], \"interpolation\": \"%s\", "
    "\"lights\": [{\"type\": \"point\", \"position\": [3, 4, 6], \"color\": %s}, {\"type\": "
    "\"directional\", \"direction\": [1, -0.6, -0.5], \"color\": 0.4}], %s\"materials\": {\"m\": "
    "{%s}}, \"objects\": [{\"type\": \"sphere\", \"segments\": 12, \"material\": \"m\", "
    "\"transform\": {\"translate\": [0.4, 1, 0]}}, {\"type\": \"sphere\", \"interpolation\": "
    "\"phong\", \"material\": \"m\", \"transform\": {\"translate\": [2.8, 1, 0], \"scale\": [1, "
    "0.7, 1]}}, {\"type\": \"torus\", \"segments\": %d, \"material\": \"m\", \"transform\": "
    "{\"rotate\": [50, 0, 0], \"translate\": [-2.6, -1, 0]}}, {\"type\": \"cone\", \"segments\": "
    "7, \"material\": \"m\", \"transform\": {\"translate\": [-0.4, -1, 0]}}, {\"type\": "
    "\"cylinder\", \"segments\": 9, \"material\": \"m\", \"transform\": {\"rotate\": [30, 0, 0], "
    "\"translate\": [1.6, -1, 0]}}, {\"type\": \"box\", \"material\": \"m\", \"transform\": "
    "{\"rotate\": [30, 30, 0], \"translate\": [3, -1, 0]}}, {\"type\": \"mesh\", \"positions\": "
    "[-3.4, 0.2, 0, -1.4, 0.2, 0.4, -1.4, 2, 0, -3.4, 2, 0.4], \"indices\": [0, 1, 2, 0, 2, 3], "
    "\"normals\": [-0.4, 0, 1, 0.4, 0, 1, 0.4, 0.4, 1, -0.4, 0.4, 1], \"uvs\": [0, 0, 1, 0, 1, 1, "
    "0, 1], \"material\": \"m\"}, {\"type\": \"plane\", \"interpolation\": \"phong\", "
    "\"transform\": {\"translate\": [0, -2, 0]}%s}]}";

#define FIELD(low, high)                                                                           \
    "{\"pattern\": \"gradient\", \"colors\": [" low ", " high                                      \
    "], \"uv\": {\"scale\": [3, 2], \"wrap\": \"mirror\", \"rotate\": 30}}"
#define LOW    "[0.1, 0.6, 0.3]"
#define HIGH   "[0.8, 0.2, 0.3]"
#define SHINES ", \"specular\": 0.3, \"ambient\": 0.4"
#define TRACED "\"trace\": {\"shadows\": true, \"depth\": 1}, "
#define MIRROR ", \"material\": {\"reflection\": 1}"
#define BLUE   "[0.6, 0.8, 1]"
#define LAYERS                                                                                     \
    "\"output\": {\"format\": \"exr\", \"layers\": [\"emissive\", \"ambient\", \"diffuse\", "      \
    "\"specular\", \"light.0\", \"light.1\"]}, "

static drawn draw(shd_engine *engine, int samples, const char *tier, const char *interpolation,
                  const char *further, const char *material) {
    const bool traced = strstr(further, "trace");
    char *text = text_of(all, samples, tier, interpolation, BLUE, further, material, 16,
                         traced ? MIRROR : "");
    const drawn d = film_of(engine, text);
    free(text);
    return d;
}

static const struct {
    const char *tier, *interpolation, *further;
} ways[] = {{"standard", "flat", ""}, {"standard", "gouraud", ""}, {"exact", "flat", ""},
            {"exact", "gouraud", ""}, {"exact", "flat", TRACED},   {"exact", "gouraud", TRACED}};
enum { WAYS = sizeof ways / sizeof ways[0] };

/* A pattern that glows shows its field w. Where it is kd, radiance is low + w (high - low) of the
 * pictures in both colors, which have no pattern: directly, and in a mirror of all light. */
static void coefficients_multiply_interpolated_light(void **state) {
    for (int k = 0; k < WAYS; k++) {
        const char *tier = ways[k].tier, *by = ways[k].interpolation, *further = ways[k].further;
        drawn low = draw(*state, 1, tier, by, further, "\"diffuse\": " LOW SHINES),
              high = draw(*state, 1, tier, by, further, "\"diffuse\": " HIGH SHINES),
              mixed = draw(*state, 1, tier, by, further, "\"diffuse\": " FIELD(LOW, HIGH) SHINES),
              dark = draw(*state, 1, tier, by, further, "\"diffuse\": 0"),
              glow = draw(*state, 1, tier, by, further,
                          "\"diffuse\": 0, \"emissive\": " FIELD("0", "1"));
        double most = 0;
        size_t seen = 0;
        for (size_t i = 0; i < 4 * pixels_of(&low); i++) {
            if (i % 4 == 3) continue;
            const double w = (double)glow.film.rgba[i] - (double)dark.film.rgba[i],
                         a = (double)low.film.rgba[i], b = (double)high.film.rgba[i];
            most = fmax(most, fabs((double)mixed.film.rgba[i] - (a + w * (b - a))));
            seen += fabs(b - a) > 0.05 && w > 0.2 && w < 0.8;
        }
        assert_true(seen > 300);
        assert_below(most, 1e-6);
        drop_drawn(&low);
        drop_drawn(&high);
        drop_drawn(&mixed);
        drop_drawn(&dark);
        drop_drawn(&glow);
    }
}

/* To the bit in the exact tier, whose colors are added to by what a pattern rises; a pixel's
 * samples of several objects are added up in another order. */
static void equal_colors_are_one_color(void **state) {
    for (int k = 0; k < WAYS + 4; k++) {
        const int way = k % WAYS, samples = k < WAYS ? 1 : 4;
        const char *tier = ways[way].tier, *by = ways[way].interpolation,
                   *further = ways[way].further;
        drawn one = draw(*state, samples, tier, by, further,
                         "\"diffuse\": " LOW ", \"specular\": 0.4, \"emissive\": " HIGH),
              same = draw(*state, samples, tier, by, further,
                          "\"diffuse\": " FIELD(LOW, LOW) ", \"specular\": " FIELD(
                              "0.4", "0.4") ", \"emissive\": " FIELD(HIGH, HIGH));
        assert_true(same.request->rendering.plan->textured);
        if (samples == 1 && !strcmp(tier, "exact"))
            assert_true(same_film(&one, &same));
        else
            assert_below(film_difference(&one, &same), samples == 1 ? 5e-7 : 1e-6);
        drop_drawn(&one);
        drop_drawn(&same);
    }
}

#define SEVERAL                                                                                    \
    "\"diffuse\": " FIELD(LOW, HIGH) ", \"specular\": {\"pattern\": \"checker\", \"colors\": "     \
                                     "[0.1, 0.5], \"uv\": {\"scale\": 6}}, \"shininess\": 40, "    \
                                     "\"emissive\": {\"pattern\": "                                \
                                     "\"noise\", \"colors\": [0, 0.2], \"uv\": {\"scale\": 9}}"

static void tiers_differ_by_no_more_than_is_said(void **state) {
    for (int k = 0; k < 4; k++) {
        const char *by = k % 2 ? "flat" : "gouraud";
        drawn a = draw(*state, k < 2 ? 1 : 4, "standard", by, "", SEVERAL),
              b = draw(*state, k < 2 ? 1 : 4, "exact", by, "", SEVERAL);
        check_bound(&a, &b, 1e-4);
        drop_drawn(&a);
        drop_drawn(&b);
    }
}

static void layers_add_up(void **state) {
    for (int k = 0; k < 4; k++) {
        drawn d = draw(*state, 4, k % 2 ? "exact" : "standard", k < 2 ? "flat" : "gouraud", LAYERS,
                       SEVERAL);
        const float *part[4], *light[2], *all_of = d.film.rgba;
        for (size_t p = 0; p < 4; p++)
            part[p] = plane_of(&d, (shd_layer_kind)(SHD_LAYER_EMISSIVE + (int)p), 0);
        for (size_t p = 0; p < 2; p++) light[p] = plane_of(&d, SHD_LAYER_LIGHT, p);
        for (size_t i = 0; i < 3 * pixels_of(&d); i++) {
            const double lit = (double)part[2][i] + (double)part[3][i];
            assert_true(fabs((double)light[0][i] + (double)light[1][i] - lit) < 1e-5);
            const double sum = lit + (double)part[0][i] + (double)part[1][i];
            /* But for the background. */
            if (i / 3 % 48 < 40 && i / 3 / 48 > 30)
                assert_true(fabs((double)all_of[i / 3 * 4 + i % 3] - sum) < 1e-5);
        }
        drop_drawn(&d);
    }
}

/* Another tint casts and lights nothing, another light casts nothing, other faces are others, and
 * bytes are the same. */
static void tints_keep_light(void **state) {
    static const struct {
        const char *by, *light, *material;
        int segments;
        shd_reused reused;
    } steps[] = {
        {"flat", BLUE, "\"diffuse\": " FIELD(LOW, HIGH), 16, SHD_REUSED_NOTHING},
        {"flat", BLUE, "\"diffuse\": " FIELD(HIGH, "0.3"), 16, SHD_REUSED_LIGHT},
        {"flat", "[0.3, 0.8, 1]", "\"diffuse\": " FIELD(HIGH, "0.3"), 16, SHD_REUSED_GEOMETRY},
        {"gouraud", BLUE, "\"diffuse\": " FIELD(LOW, HIGH), 16, SHD_REUSED_NOTHING},
        {"gouraud", BLUE, "\"diffuse\": " FIELD(LOW, HIGH), 15, SHD_REUSED_NOTHING},
        {"gouraud", BLUE, "\"diffuse\": " FIELD(HIGH, LOW), 15, SHD_REUSED_LIGHT},
        {"phong", BLUE, "\"diffuse\": " FIELD(HIGH, LOW), 15, SHD_REUSED_NOTHING},
        /* Without a pattern colors are in the light. */
        {"flat", BLUE, "\"diffuse\": 0.5", 16, SHD_REUSED_NOTHING},
        {"flat", BLUE, "\"diffuse\": 0.4", 16, SHD_REUSED_NOTHING}};
    shd_engine *keeps = new_engine_that_keeps((size_t)64 << 20, 1, NULL);
    for (int samples = 1; samples <= 4; samples += 3) {
        for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
            char *json = text_of(all, samples, "standard", steps[i].by, steps[i].light, "",
                                 steps[i].material, steps[i].segments, "");
            const shd_reused reused = reused_for(keeps, *state, json);
            if (reused != steps[i].reused) fail_msg("step %zu reused %d", i, (int)reused);
        }
    }
    shd_engine_drop(keeps);
}

/* Holes alone, which leave coefficients as they are. */
static void faces_have_holes(void **state) {
#define NET(color)                                                                                 \
    "\"diffuse\": 0.5, \"opacity\": {\"pattern\": \"grid\", \"colors\": [" color                   \
    ", 1], \"width\": 0.4, \"uv\": {\"scale\": 6}}"
    for (int k = 0; k < 2; k++) {
        const char *by = k ? "gouraud" : "flat";
        drawn solid = draw(*state, 1, "exact", by, TRACED, "\"diffuse\": 0.5"),
              net = draw(*state, 1, "exact", by, TRACED, NET("0")),
              same = draw(*state, 1, "exact", by, TRACED, NET("1"));
        assert_true(same_film(&solid, &same));
        assert_true(film_difference(&solid, &net) > 0.1);
        drop_drawn(&solid);
        drop_drawn(&net);
        drop_drawn(&same);
    }
}

static void regions_and_kernels_see_the_same(void **state) {
    shd_engine *other = new_engine_of(1, "portable");
    for (int k = 0; k < 2; k++) {
        char *whole =
            text_of(all, 4, k ? "exact" : "standard", "gouraud", BLUE, "", SEVERAL, 16, "");
        drawn a = film_of(*state, whole);
        char *part = strdup(whole), *size = strstr(part, "\"samples\"");
        char *cut = text_of("%.*s\"region\": [13, 7, 20, 20], %s", (int)(size - part), part, size);
        drawn c = film_of(*state, cut);
        for (int y = 0; y < 20; y++)
            assert_memory_equal(c.film.rgba + 4 * 20 * y, a.film.rgba + 4 * (48 * (y + 7) + 13),
                                20 * 4 * sizeof(float));
        drawn b = film_of(other, whole);
        if (k) assert_true(same_film(&a, &b));
        drop_drawn(&a);
        drop_drawn(&b);
        drop_drawn(&c);
        free(whole);
        free(part);
        free(cut);
    }
    shd_engine_drop(other);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(coefficients_multiply_interpolated_light),
        cmocka_unit_test(equal_colors_are_one_color),
        cmocka_unit_test(tiers_differ_by_no_more_than_is_said),
        cmocka_unit_test(layers_add_up),
        cmocka_unit_test(tints_keep_light),
        cmocka_unit_test(faces_have_holes),
        cmocka_unit_test(regions_and_kernels_see_the_same),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
