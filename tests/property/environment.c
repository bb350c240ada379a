/* Scenes in environments: tables against quadrature, and what keys, layers and turning must keep.
 */
#include "plan/tier.h"
#include "property/put_picture.h"

static char *scene_in(const char *map, const char *light, const char *accuracy, double turn) {
    return text_of(
        "{\"image\": {\"width\": 16, \"height\": 12, \"samples\": 1}, \"accuracy\": {%s}, "
        "\"output\": {%s}, "
        "\"lights\": [{\"type\": \"environment\", \"map\": \"%s\", \"rotate\": %.17g%s}], "
        "\"objects\": [{\"type\": \"sphere\", \"material\": {\"diffuse\": [0.3, 0.2, 0.5], "
        "\"specular\": [0.9, 0.7, 0.3], \"shininess\": 24}, \"transform\": {\"rotate\": [0, "
        "%.17g, 0]}}]}",
        accuracy,
        strstr(light, "visible") ? "\"format\": \"exr\", \"layers\": [\"beauty\", \"light.0\", "
                                   "\"diffuse\", \"specular\"]"
                                 : "",
        map, turn, light, turn);
}

static drawn draw(shd_engine *engine, const char *map, const char *light, const char *accuracy,
                  double turn) {
    char *json = scene_in(map, light, accuracy, turn);
    drawn d = shown_film_of(engine, json);
    free(json);
    return d;
}

static double largest_difference(const drawn *a, const drawn *b) {
    double most = 0;
    for (size_t i = 0; i < 4 * pixels_of(a); i++)
        most = fmax(most, fabs((double)a->film.rgba[i] - (double)b->film.rgba[i]));
    return most;
}

/* Both tiers tell how far they are off the model, so that they are no farther apart than that; and
 * 8-bit codes differ by 1 at most. */
static void tables_are_within_their_bounds(void **state) {
    static const char *const maps[] = {"studio", "sky"};
    for (int k = 0; k < 2; k++) {
        drawn exact = draw(*state, maps[k], "", "\"tier\": \"exact\"", 40),
              standard = draw(*state, maps[k], "", "\"tier\": \"standard\"", 40);
        const shd_bound a = exact.request->rendering.plan->bound,
                        b = standard.request->rendering.plan->bound;
        assert_null(exact.request->rendering.plan->glows);
        assert_non_null(standard.request->rendering.plan->glows);
        const double off = largest_difference(&exact, &standard);
        print_message("%s: off %.1e, told %.1e and %.1e\n", maps[k], off, a.linear, b.linear);
        assert_true(off > 0 && off <= a.linear + b.linear);
        assert_true(b.linear < 0.02 && a.linear < b.linear);
        assert_true(a.code == 0 && b.code > 0);
        const shd_difference seen = measured(&exact, &standard);
        assert_true(seen.code.max <= 1 && seen.code.max <= b.code);
        assert_true(seen.delta_e.max <= b.delta_e);
        drop_drawn(&standard);
        drop_drawn(&exact);
    }
}

/* A budget takes tables if they meet it, quadrature if only that does, and else is refused. */
static void budgets_choose_between_tables_and_quadrature(void **state) {
    static const double budgets[] = {0.02, 7e-4, 1e-7};
    for (int k = 0; k < 3; k++) {
        char *accuracy = text_of("\"maxError\": %g, \"metric\": \"linear\"", budgets[k]);
        char *json = scene_in("studio", "", accuracy, 0);
        shd_request *request = read_scene(*state, json);
        shd_error error = {.status = SHD_OK};
        const shd_status status = shd_rendering_plan(&request->rendering, request->scene, &error);
        assert_int_equal(status, k < 2 ? SHD_OK : SHD_SCENE);
        if (k < 2) {
            const shd_plan *plan = request->rendering.plan;
            assert_true(plan->bound.linear <= budgets[k]);
            assert_true((plan->glows != NULL) == (k == 0));
        }
        shd_request_drop(request);
        free(json);
        free(accuracy);
    }
}

/* Where a whole number of texels is turned, with the objects' own, the picture of a sphere seen
 * from above does not change but turns: here the light alone is turned by 0 and by 360. */
static void a_whole_turn_changes_nothing(void **state) {
    drawn a = draw(*state, "sky", ", \"visible\": true", "\"tier\": \"standard\"", 0),
          b = draw(*state, "sky", ", \"visible\": true", "\"tier\": \"standard\"", 360),
          c = draw(*state, "sky", ", \"visible\": true", "\"tier\": \"standard\"", 90);
    assert_true(film_difference(&a, &b) < 1e-5);
    assert_true(film_difference(&a, &c) > 1e-2);
    drop_drawn(&c);
    drop_drawn(&b);
    drop_drawn(&a);
}

/* The beauty of a scene without another light is what the environment adds, but behind objects. */
static void layers_add_up(void **state) {
    drawn d = draw(*state, "sky", ", \"intensity\": 0.5, \"visible\": true",
                   "\"tier\": \"standard\"", 10);
    const float *light = plane_of(&d, SHD_LAYER_LIGHT, 0), *beauty = d.film.rgba,
                *diffuse = plane_of(&d, SHD_LAYER_DIFFUSE, 0),
                *specular = plane_of(&d, SHD_LAYER_SPECULAR, 0);
    size_t behind = 0;
    for (size_t i = 0; i < pixels_of(&d); i++) {
        assert_true(beauty[4 * i + 3] == 1);
        const bool seen = light[3 * i] != 0;
        behind += !seen;
        for (size_t c = 0; c < 3; c++) {
            const float all = beauty[4 * i + c], part = light[3 * i + c];
            assert_true(fabsf(diffuse[3 * i + c] + specular[3 * i + c] - part) < 1e-5F);
            assert_true(seen ? fabsf(all - part) < 1e-5F : all > 0);
        }
    }
    assert_true(behind > 20 && behind < pixels_of(&d));
    drop_drawn(&d);
}

/* Pictures that share hits or light with earlier ones are as if they did not. */
static void what_is_kept_knows_the_environment(void **state) {
    shd_engine *keeping = new_engine_that_keeps(8 << 20, 1, NULL);
    static const char *const maps[] = {"studio", "sky", "studio", "studio", "studio"};
    static const double turns[] = {0, 0, 30, 0, 0};
    static const char *const tiers[] = {"standard", "standard", "standard", "standard", "exact"};
    for (int k = 0; k < 5; k++) {
        char *accuracy = text_of("\"tier\": \"%s\"", tiers[k]);
        char *json = scene_in(maps[k], "", accuracy, turns[k]);
        file kept = png_of(keeping, json), alone = png_of(*state, json);
        assert_int_equal(kept.size, alone.size);
        assert_memory_equal(kept.data, alone.data, kept.size);
        free(kept.data);
        free(alone.data);
        free(json);
        free(accuracy);
    }
    shd_engine_drop(keeping);
}

/* Four models around the axis, seen from `turn` degrees around it in a map that is turned as much;
 * `tint`: of one channel of a mirror. */
static drawn draw_models(shd_engine *engine, const char *map, const char *members, double turn,
                         double tint) {
    char *json = text_of(
        "{\"image\": {\"width\": 12, \"height\": 16, \"samples\": 1}, %s, "
        "\"trace\": {\"depth\": 2}, "
        "\"camera\": {\"position\": [%.17g, 0, %.17g], \"fov\": 34}, \"lights\": [{\"type\": "
        "\"environment\", \"map\": \"%s\", \"rotate\": %.17g, \"visible\": true}], \"objects\": ["
        "{\"type\": \"sphere\", \"radius\": 0.5, \"material\": {\"model\": \"blinn-phong\", "
        "\"diffuse\": 0.2, \"specular\": 0.6, \"shininess\": 50}}, "
        "{\"type\": \"torus\", \"radius\": 0.8, \"tube\": 0.2, \"material\": {\"model\": "
        "\"phong-normalized\", \"diffuse\": 0.2, \"specular\": 0.6, \"shininess\": 30}}, "
        "{\"type\": \"torus\", \"radius\": 0.6, \"tube\": 0.2, \"material\": {\"model\": "
        "\"cook-torrance\", \"diffuse\": 0.1, \"fresnel\": {\"n\": 2, \"k\": 3}, \"lobes\": "
        "[{\"roughness\": 0.25}]}, \"transform\": {\"translate\": [0, 1, 0]}}, "
        "{\"type\": \"sphere\", \"radius\": 0.4, \"material\": {\"diffuse\": 0, \"reflection\": "
        "[0.9, 0.9, %.17g]}, \"transform\": {\"translate\": [0, 1.2, 0]}}, "
        "{\"type\": \"cylinder\", \"radius\": 0.6, \"height\": 0.8, \"material\": {\"model\": "
        "\"oren-nayar\", \"diffuse\": 0.7, \"sigma\": 25}, \"transform\": {\"translate\": "
        "[0, -1, 0]}}]}",
        members, 5 * sin(turn * (3.14159265358979 / 180)), 5 * cos(turn * (3.14159265358979 / 180)),
        map, turn, tint);
    drawn d = shown_film_of(engine, json);
    free(json);
    return d;
}

/* They are lit alike in all tiers but for tables of diffuse light, and turn with the map. */
static void other_models_are_lit_as_told(void **state) {
    drawn exact = draw_models(*state, "studio", "\"accuracy\": {\"tier\": \"exact\"}", 0, 0.9),
          standard =
              draw_models(*state, "studio", "\"accuracy\": {\"tier\": \"standard\"}", 0, 0.9),
          turned = draw_models(*state, "studio", "\"accuracy\": {\"tier\": \"exact\"}", 70, 0.9);
    const shd_bound a = exact.request->rendering.plan->bound,
                    b = standard.request->rendering.plan->bound;
    const double off = largest_difference(&exact, &standard),
                 beside = largest_difference(&exact, &turned);
    print_message("models: off %.1e, turned %.1e, told %.1e and %.1e\n", off, beside, a.linear,
                  b.linear);
    assert_true(off > 0 && off <= a.linear + b.linear && off < 2e-3);
    assert_true(measured(&exact, &standard).code.max <= 1);
    assert_true(beside < 1e-3);
    drop_drawn(&turned);
    drop_drawn(&standard);
    drop_drawn(&exact);
}

/* White light and what is grey make the round trip through a spectrum, and a colored map comes back
 * from grey surfaces; so it does where rays carry bins, as of a mirror that is hardly colored. */
static void spectra_keep_what_is_grey(void **state) {
    static const char *const maps[] = {"studio", "sky"};
    for (int k = 0; k < 2; k++) {
        drawn rgb = draw_models(*state, maps[k], "\"spectral\": false", 0, 0.9),
              grey = draw_models(*state, maps[k], "\"spectral\": true", 0, 0.9),
              tinted = draw_models(*state, maps[k], "\"spectral\": true", 0, 0.9 - 1e-9);
        assert_false(grey.request->rendering.plan->tinted);
        assert_true(tinted.request->rendering.plan->tinted);
        print_message("%s: grey %.1e, tinted %.1e\n", maps[k], largest_difference(&rgb, &grey),
                      largest_difference(&grey, &tinted));
        assert_true(largest_difference(&rgb, &grey) < 2e-5);
        assert_true(largest_difference(&grey, &tinted) < 2e-5);
        assert_true(tinted.request->rendering.plan->bound.linear >=
                    grey.request->rendering.plan->bound.linear);
        drop_drawn(&tinted);
        drop_drawn(&grey);
        drop_drawn(&rgb);
    }
}

/* Facets whose index changes with the wavelength mirror each bin of the map by itself: of an even
 * part of a grey map as much of each as of a light. */
static void metals_mirror_a_map_by_bins(void **state) {
    static const char *const lights[] = {
        "{\"type\": \"environment\", \"map\": \"studio\"}",
        "{\"type\": \"directional\", \"direction\": [0, 0, -1], \"color\": 3}"};
    double ratio[2][3];
    for (int k = 0; k < 2; k++) {
        double color[2][3];
        for (int spectral = 0; spectral < 2; spectral++) {
            char *json = text_of(
                "{\"image\": {\"width\": 1, \"height\": 1, \"samples\": 1}, \"lights\": [%s], "
                "\"spectral\": %s, \"objects\": [{\"type\": \"sphere\", \"material\": {\"model\": "
                "\"cook-torrance\", \"diffuse\": 0, \"fresnel\": {\"n\": \"gold\", \"k\": "
                "\"gold\"}, "
                "\"lobes\": [{\"roughness\": 0.2}]}}]}",
                lights[k], spectral ? "true" : "false");
            drawn d = shown_film_of(*state, json);
            for (int c = 0; c < 3; c++) color[spectral][c] = (double)d.film.rgba[c];
            drop_drawn(&d);
            free(json);
        }
        for (int c = 0; c < 3; c++) ratio[k][c] = color[1][c] / color[0][c];
    }
    for (int c = 0; c < 3; c++) {
        print_message("channel %d: %.4f of RGB, and of a light %.4f\n", c, ratio[0][c],
                      ratio[1][c]);
        assert_true(fabs(ratio[0][c] / ratio[1][c] - 1) < 5e-3);
    }
    assert_true(fabs(ratio[0][2] - 1) > 1e-2);
}

/* The color in the middle of a picture that looks from the origin along `toward`, in which a thing
 * stands or not. */
static void look_at_map(shd_engine *engine, const char *toward, const char *visible,
                        const char *thing, double color[3]) {
    char *json = text_of(
        "{\"image\": {\"width\": 1, \"height\": 1, \"samples\": 1}, \"accuracy\": {\"tier\": "
        "\"exact\"}, \"background\": [0.25, 0.5, 0.75], \"trace\": {\"depth\": 6}, "
        "\"camera\": {\"position\": [0, 0, 0], \"target\": %s, \"up\": [1, 0.1, 0.2], \"fov\": "
        "0.2}, "
        "\"lights\": [{\"type\": \"environment\", \"map\": \"studio\", \"rotate\": 3, "
        "\"visible\": "
        "%s}], \"objects\": [%s]}",
        toward, visible, thing);
    drawn d = shown_film_of(engine, json);
    for (int c = 0; c < 3; c++) color[c] = (double)d.film.rgba[c];
    drop_drawn(&d);
    free(json);
}

/* A mirror at 45 degrees shows what is above; a ball of an index of 1 and air show what is behind;
 * of a map that is not visible they show the background, and black coefficients nothing of either.
 */
static void mirrors_and_glass_show_the_map(void **state) {
    static const char
        far[] = "{\"type\": \"sphere\", \"transform\": {\"translate\": [0, -900, 0]}}",
        mirror[] = "{\"type\": \"disc\", \"material\": {\"diffuse\": 0, \"reflection\": 1}, "
                   "\"transform\": {\"rotate\": [45, 0, 0], \"translate\": [0, 0, -3]}}",
        glass[] = "{\"type\": \"sphere\", \"material\": {\"diffuse\": 0, \"transmission\": 1, "
                  "\"ior\": 1}, \"transform\": {\"translate\": [0, 0, -3]}}";
    static const double background[3] = {0.25, 0.5, 0.75};
    double above[3], ahead[3], seen[3];
    look_at_map(*state, "[0, 1, 0]", "true", far, above);
    look_at_map(*state, "[0, 0, -1]", "true", far, ahead);
    assert_true(fabs(above[0] - ahead[0]) > 0.5);
    for (int visible = 0; visible < 2; visible++)
        for (int thing = 0; thing < 3; thing++) {
            look_at_map(*state, "[0, 0, -1]", visible ? "true" : "false",
                        thing == 0   ? far
                        : thing == 1 ? mirror
                                     : glass,
                        seen);
            const double *wanted = !visible ? background : thing == 1 ? above : ahead;
            for (int c = 0; c < 3; c++) assert_true(fabs(seen[c] - wanted[c]) < 1e-3);
        }
}

/* What an environment cannot be in is told of the light. */
static void what_it_cannot_light_is_refused(void **state) {
    static const char *const members[] = {
        "\"objects\": [{\"type\": \"sphere\", \"material\": {\"model\": \"westin\", "
        "\"microgeometry\": {\"type\": \"grooves\"}}}]"};
    for (int k = 0; k < 1; k++) {
        refuse_text(*state,
                    text_of("{\"lights\": [{\"type\": \"environment\", \"map\": \"sky\"}], %s}",
                            members[k]),
                    "/lights/0");
    }
}

static uint64_t work_of(shd_engine *engine, const char *accuracy, const char *shininess,
                        uint64_t *planning) {
    char *json =
        text_of("{\"image\": {\"width\": 8, \"height\": 8, \"samples\": 1}, \"accuracy\": {%s}, "
                "\"lights\": [{\"type\": \"environment\", \"map\": \"sky\"}], \"objects\": "
                "[{\"type\": \"sphere\", \"material\": {\"specular\": 1, \"shininess\": %s}}]}",
                accuracy, shininess);
    shd_request *request = read_scene(engine, json);
    const uint64_t work = shd_request_work(request);
    *planning = shd_request_planning_work(request);
    shd_request_drop(request);
    free(json);
    return work;
}

/* Small pictures are not small work: who waits for a turn is told so before it begins. */
static void work_counts_tables_and_quadrature(void **state) {
    uint64_t planning[5];
    const uint64_t tables = work_of(*state, "\"tier\": \"standard\"", "24", &planning[0]),
                   diffuse = work_of(*state, "\"tier\": \"standard\"", "1", &planning[1]),
                   sharp = work_of(*state, "\"tier\": \"standard\"", "5000", &planning[2]),
                   exact = work_of(*state, "\"tier\": \"exact\"", "24", &planning[3]),
                   shown =
                       work_of(*state, "\"maxError\": 1, \"metric\": \"code\"", "24", &planning[4]);
    assert_int_equal(planning[0], 2 * planning[1]);
    assert_int_equal(planning[1], planning[2]);
    assert_int_equal(planning[3], 0);
    assert_int_equal(planning[4], planning[0]);
    const uint64_t summed = 64 * 200000; /* units of 64 samples of a term */
    assert_true(tables < planning[0] + summed / 10);
    assert_true(diffuse > planning[1] + summed && sharp > planning[2] + summed);
    assert_true(exact > 2 * summed && shown > planning[4] + 2 * summed);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_are_within_their_bounds),
        cmocka_unit_test(budgets_choose_between_tables_and_quadrature),
        cmocka_unit_test(a_whole_turn_changes_nothing),
        cmocka_unit_test(layers_add_up),
        cmocka_unit_test(what_is_kept_knows_the_environment),
        cmocka_unit_test(other_models_are_lit_as_told),
        cmocka_unit_test(spectra_keep_what_is_grey),
        cmocka_unit_test(metals_mirror_a_map_by_bins),
        cmocka_unit_test(mirrors_and_glass_show_the_map),
        cmocka_unit_test(what_it_cannot_light_is_refused),
        cmocka_unit_test(work_counts_tables_and_quadrature),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
