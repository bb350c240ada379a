/* Patterns in documents: what they are, and where they may not be. */
#include "unit/scene_support.h"

#define ON(pattern) OBJECT("'type': 'sphere', 'material': {'diffuse': {" pattern "}}")
#define CHECKER     "'diffuse': {'pattern': 'checker', 'colors': [0, 1]}"
#define CORNERS     "'positions': [0,0,0, 1,0,0, 0,1,0]"

static void patterns_are_two_colors_and_a_map(void **state) {
    (void)state;
    reading r = read_scene(
        "{'objects': [{'type': 'sphere', 'material': {'diffuse': {'pattern': 'grid', 'colors': "
        "[[0.1, 0.9, 0.3], [0.4, 0.5, 0.6]], 'uv': {'scale': [2, 3], 'rotate': 90, 'offset': [5, "
        "6]}, "
        "'width': 0.25}, 'specular': {'pattern': 'noise', 'colors': [0, 0.5]}, 'lobes': "
        "[{'specular': "
        "0.1}, {'specular': {'pattern': 'gradient', 'colors': [1, 0], 'uv': {'wrap': 'mirror'}}}], "
        "'emissive': {'pattern': 'checker', 'colors': ['#fff', 0], 'uv': {'scale': 4}}}}]}");
    const shd_material *m = &r.scene->materials[0];
    const shd_pattern *p = &m->diffuse_texture->pattern;
    assert_int_equal(p->kind, SHD_GRID);
    assert_true(p->width == 0.25);
    /* (u, v) is scaled, then turned: u to t, v to -s. */
    assert_vec((shd_vec3){p->map[0][0], p->map[0][1], p->map[0][2]}, 0, -3, 5);
    assert_vec((shd_vec3){p->map[1][0], p->map[1][1], p->map[1][2]}, 2, 0, 6);
    assert_rgb(m->diffuse_texture->low, .1, .9, .3);
    assert_rgb(m->diffuse_texture->high, .4, .5, .6);
    assert_rgb(m->diffuse, .4, .9, .6); /* the larger ones */
    assert_ptr_equal(m->ambient_texture, m->diffuse_texture);
    assert_rgb(m->ambient, .4, .9, .6);
    assert_int_equal(m->lobe_textures[0]->pattern.kind, SHD_NOISE);
    assert_int_equal(m->lobe_textures[0]->pattern.octaves, 4);
    assert_null(m->lobe_textures[1]);
    assert_int_equal(m->lobe_textures[2]->pattern.wrap, SHD_WRAP_MIRROR);
    assert_true(m->emissive_texture->pattern.map[1][1] == 4);
    drop(&r);
    r = read_scene("{'objects': [{'type': 'sphere', 'material': {" CHECKER ", 'ambient': 0.2}}]}");
    assert_null(r.scene->materials[0].ambient_texture);
    assert_null(r.scene->materials[0].lobe_textures);
    drop(&r);
}

static void mistakes_in_patterns_are_pointed_to(void **state) {
    (void)state;
#define AT "/objects/0/material/diffuse"
    static const refusal cases[] = {
        {OBJECT("'type': 'sphere', 'material': {'shininess': [8, 20]}"),
         "/objects/0/material/shininess", "expected a number, or {pattern, values, uv}"},
        {ON("'pattern': 'chequer', 'colors': [0, 1]"), AT "/pattern", "did you mean \"checker\"?"},
        {ON("'pattern': 3, 'colors': [0, 1]"), AT "/pattern", "expected a string"},
        {ON("'pattern': 'checker'"), AT, "\"colors\" is missing"},
        {ON("'pattern': 'checker', 'colors': [0]"), AT "/colors", "2 colors, got 1"},
        {ON("'pattern': 'checker', 'colors': [0, 1, 2]"), AT "/colors", "2 colors, got 3"},
        {ON("'pattern': 'checker', 'colors': [0, 'mauv']"), AT "/colors/1", "mauv"},
        {ON("'pattern': 'checker', 'colors': [0, [0, 1, 1, 0.5]]"), AT "/colors/1", "alpha"},
        {ON("'pattern': 'checker', 'colors': [0, 1], 'width': 0.1"), AT "/width",
         "unknown member \"width\" of a checker"},
        {ON("'pattern': 'checker', 'colors': [0, 1], 'uv': {'wrap': 'repeat'}"), AT "/uv/wrap",
         "unknown member \"wrap\" of a checker's `uv`"},
        {ON("'pattern': 'checker', 'colors': [0, 1], 'uv': {'scale': [1]}"), AT "/uv/scale",
         "2 numbers, got 1"},
        {ON("'pattern': 'checker', 'colors': [0, 1], 'uv': {'scale': 1e10}"), AT "/uv/scale",
         "-1e9 to 1e9"},
        {ON("'pattern': 'checker', 'colors': [0, 1], 'uv': {'offset': 1}"), AT "/uv/offset",
         "an array of 2 numbers"},
        {ON("'pattern': 'gradient', 'colors': [0, 1], 'uv': {'wrap': 'tile'}"), AT "/uv/wrap",
         "clamp, repeat, mirror"},
        {ON("'pattern': 'grid', 'colors': [0, 1], 'width': 1"), AT "/width", "between 0 and 1"},
        {ON("'pattern': 'noise', 'colors': [0, 1], 'octaves': 9"), AT "/octaves", "1 to 8"},
    };
    ASSERT_REFUSED(cases);
}

static void mistakes_in_pictures_are_pointed_to(void **state) {
    (void)state;
    static const refusal cases[] = {
        {ON("'texture': 'x'"), AT "/texture", "no assets are kept here"},
        {OBJECT(
             "'type': 'sphere', 'material': {'lobes': [{'specular': {'texture': 'x', 'uv': {}}}]}"),
         "/objects/0/material/lobes/0/specular/texture", "no assets are kept here"},
        {ON("'texture': 3"), AT "/texture", "expected the name of a picture"},
        {ON("'texture': 'x', 'pattern': 'checker'"), AT "/pattern",
         "unknown member \"pattern\" of a picture"},
        {ON("'texture': 'x', 'colors': [0, 1]"), AT "/colors", "unknown member"},
        {ON("'texture': 'x', 'channel': 'Y'"), AT "/channel", "R, G, B, A"},
        {ON("'texture': 'x', 'space': 'lin_rec70'"), AT "/space", "did you mean \"lin_rec709\"?"},
        {ON("'texture': 'x', 'tint': 'mauv'"), AT "/tint", "mauv"},
        {ON("'texture': 'x', 'tint': [1, 1, 1, 0.5]"), AT "/tint", "alpha"},
        {ON("'texture': 'x', 'uv': {'wrap': 'tile'}"), AT "/uv/wrap", "clamp, repeat, mirror"},
        {ON("'pattern': 'checker', 'colors': [0, 1], 'tint': 1"), AT "/tint", "of a checker"},
    };
    ASSERT_REFUSED(cases);
}

static void patterns_need_a_chart_and_colors_that_multiply(void **state) {
    (void)state;
    static const refusal cases[] = {
        {OBJECT("'type': 'mesh', " CORNERS ", 'material': {" CHECKER "}"), "/objects/0",
         "needs `uvs`"},
        {"{'spectral': true, 'trace': {'shadows': true}, 'objects': [{'type': 'sphere', "
         "'material': {'opacity': {'pattern': "
         "'checker', 'colors': [0, [1, 1, 0.5]]}}}]}",
         "/objects/0", "one number"},
        {OBJECT("'type': 'sphere', 'interpolation': 'gouraud', 'material': {'model': 'westin', "
                "'microgeometry': {'type': 'grooves'}, " CHECKER "}"),
         "/objects/0", "westin"},
        {"{'spectral': true, 'objects': [{'type': 'sphere', 'material': {'model': 'westin', "
         "'microgeometry': {'type': 'grooves'}, 'emissive': {'pattern': 'checker', 'colors': [0, "
         "1]}}}]}",
         "/objects/0", "westin"},
    };
    ASSERT_REFUSED(cases);
    reading r = read_scene(
        OBJECT("'type': 'mesh', " CORNERS ", 'uvs': [0,0, 1,0, 0,1], 'material': {" CHECKER "}"));
    assert_true(r.scene->objects[0].mesh->uvs[2] == 1);
    drop(&r);
}

static void patterns_and_pictures_have_no_other_place(void **state) {
    (void)state;
#define PATTERN "{'pattern': 'checker', 'colors': [0, 1]}"
    static const char has_no_place[] = "a pattern has no place here: emissive, ambient,",
                      no_pictures[] = "a picture has no place here: emissive, ambient,";
    static const refusal cases[] = {
        {"{'objects': [], 'lights': [{'type': 'point', 'color': " PATTERN "}]}",
         "/lights/0/color/pattern", has_no_place},
        {"{'background': " PATTERN ", 'objects': []}", "/background/pattern", has_no_place},
        {ON("'pattern': 'checker', 'colors': [0, " PATTERN "]"), AT "/colors/1/pattern",
         has_no_place},
        {"{'background': {'texture': 'x'}, 'objects': []}", "/background/texture", no_pictures},
        {ON("'texture': 'x', 'tint': {'texture': 'x'}"), AT "/tint/texture", no_pictures},
    };
    ASSERT_REFUSED(cases);
}

#define FACETS(f0, top)                                                                            \
    "{" top "'objects': [{'type': 'sphere', 'material': {'model': 'cook-torrance', 'fresnel': "    \
    "{'f0': " f0 "}}}]}"

static void facets_mirror_shares_that_are_patterns(void **state) {
    (void)state;
    static const refusal cases[] = {
        {FACETS("{'pattern': 'grid', 'colors': [0, 1.1]}", ""), "/objects/0/material/fresnel/f0",
         "from 0 to 1"},
        {FACETS("{'pattern': 'grid', 'colors': [[0, 0, -0.1], 1]}", ""),
         "/objects/0/material/fresnel/f0", "from 0 to 1"},
        {FACETS(PATTERN ", 'n': 2", ""), "/objects/0/material/fresnel", "either `f0`, or `n`"},
        {FACETS(PATTERN, "'interpolation': 'gouraud', "), "/objects/0", "interpolation phong"},
        {FACETS("{'texture': 'x'}", ""), "/objects/0/material/fresnel/f0/texture", "no asset"},
    };
    ASSERT_REFUSED(cases);
    reading r = read_scene(FACETS("{'pattern': 'grid', 'colors': [[0.25, 0, 1], [0, 0.04, 1]]}",
                                  "'spectral': true, ")),
            one = read_scene(FACETS("0.25", ""));
    const shd_fresnel *index = &r.scene->materials[0].fresnel;
    assert_non_null(index->f0_texture);
    assert_null(index->f0_curve);
    assert_true(index->n[0] == one.scene->materials[0].fresnel.n[0] && isinf(index->n[2]));
    assert_true(fabs(index->n[1] - 1.5) < 1e-12 && index->k[0] == 0);
    assert_null(one.scene->materials[0].fresnel.f0_texture);
    drop(&r);
    drop(&one);
}

#define PANE(opacity)                                                                              \
    OBJECT("'type': 'disc', 'material': {'opacity': {'pattern': 'grid', 'colors': " opacity "}}")

static void opacities_are_shares(void **state) {
    (void)state;
    static const refusal cases[] = {
        {PANE("[0, 1.5]"), "/objects/0/material/opacity", "from 0 to 1"},
        {PANE("[-0.1, 1]"), "/objects/0/material/opacity", "from 0 to 1"},
        {PANE("[[0.1, 0.2, 3], 1]"), "/objects/0/material/opacity", "from 0 to 1"},
        {OBJECT("'type': 'disc', 'material': {'diffuse': [1, 1, 1, 0.5], 'opacity': {'pattern': "
                "'grid', 'colors': [0, 1]}}"),
         "/objects/0/material", "not both"},
    };
    ASSERT_REFUSED(cases);
    static const char traced[] =
        "{'trace': {'depth': 2}, 'objects': [{'type': 'disc', 'material': {'opacity': {'pattern': "
        "'grid', 'colors': [[0.5, 0.2, 1], [0.1, 0.3, 1]]}}}]}";
    reading r = read_scene(traced), opaque = read_scene(PANE("[1, 1]")),
            not_traced = read_scene(PANE("[0, 1]"));
    const shd_material *m = &r.scene->materials[0];
    assert_non_null(m->opacity_texture);
    assert_true(m->opacity[0] == 0.1 && m->opacity[1] == 0.2 && m->opacity[2] == 1);
    assert_null(opaque.scene->materials[0].opacity_texture);
    assert_true(opaque.scene->materials[0].opacity[0] == 1);
    assert_null(not_traced.scene->materials[0].opacity_texture); /* which has a warning */
    drop(&r);
    drop(&opaque);
    drop(&not_traced);
}

#define COAT(trace, members)                                                                       \
    "{'trace': {'depth': " trace "}, 'objects': [{'type': 'disc', 'material': {" members "}}]}"
#define GRID(colors) "{'pattern': 'grid', 'colors': " colors "}"

static void mirrors_and_glass_have_no_negative_colors(void **state) {
    (void)state;
    static const refusal cases[] = {
        {COAT("1", "'reflection': " GRID("[0, -1]")), "/objects/0/material/reflection",
         "must be 0 or more in every channel, and this has -1"},
        {COAT("0", "'transmission': " GRID("[[1, 1, -0.1], 1]")),
         "/objects/0/material/transmission", "0 or more"},
        {COAT("1", "'reflection': {'texture': 'x'}"), "/objects/0/material/reflection/texture",
         "no assets are kept here"},
        {COAT("1", "'transmission': {'pattern': 'grid'}"), "/objects/0/material/transmission",
         "colors"},
        {"{'spectral': true, 'trace': {'depth': 1}, 'objects': [{'type': 'sphere', 'material': "
         "{'reflection': " GRID("[0, [1, 1, 0.5]]") "}}]}",
         "/objects/0", "in a spectral scene a reflection that is"},
        {"{'spectral': true, 'trace': {'depth': 1}, 'objects': [{'type': 'sphere', 'material': "
         "{'transmission': " GRID("[[0, 0, 0.1], 1]") "}}]}",
         "/objects/0", "in a spectral scene a transmission that is"},
        {"{'trace': {'depth': 1}, 'objects': [{'type': 'mesh', " CORNERS
         ", 'material': {'reflection': " GRID("[0, 1]") "}}]}",
         "/objects/0", "needs `uvs`"},
    };
    ASSERT_REFUSED(cases);
}

static void mirrors_and_glass_are_the_most_of_their_patterns(void **state) {
    (void)state;
    reading r = read_scene(COAT("2", "'reflection': " GRID(
                                         "[[0.5, 0.2, 3], [0.1, 0.3, 0]]") ", "
                                                                           "'transmission': " GRID(
                                                                               "[0.25, 0.75]"))),
            turns =
                read_scene(COAT("2", "'reflection': " GRID("[0.9, 0]") ", 'transmission': " GRID(
                                         "[0, [1, 1, 1.5]]"))),
            dull = read_scene(COAT("2", "'reflection': " GRID("[0, 0]"))),
            not_traced = read_scene(COAT("0", "'reflection': " GRID("[0, 1]")));
    const shd_material *m = &r.scene->materials[0], *taking = &turns.scene->materials[0];
    assert_non_null(m->reflection_texture);
    assert_non_null(m->transmission_texture);
    assert_rgb(m->reflection, 0.5, 0.3, 3);
    assert_rgb(m->transmission, 0.75, 0.75, 0.75);
    /* Of both on one field no more than where it is least or most. */
    assert_true(shd_bounced_most(m, 0) == 0.1 + 0.75 && shd_bounced_most(m, 2) == 3 + 0.25);
    assert_true(has_warning(&r, "/objects/0/material", "3.25 times what its rays meet"));
    assert_true(shd_bounced_most(taking, 0) == 1 && shd_bounced_most(taking, 2) == 1.5);
    assert_true(has_warning(&turns, "/objects/0/material", "1.5 times what its rays meet"));
    assert_null(dull.scene->materials[0].reflection_texture);
    assert_int_equal(dull.report.warning_count, 0);
    assert_null(not_traced.scene->materials[0].reflection_texture);
    assert_true(has_warning(&not_traced, "/objects/0/material", "not seen without a `depth`"));
    drop(&r);
    drop(&turns);
    drop(&dull);
    drop(&not_traced);
}

static void digests_know_patterns(void **state) {
    (void)state;
    static const char *const scenes[] = {
        ON("'pattern': 'checker', 'colors': [0, 1]"),
        ON("'pattern': 'checker', 'colors': [0, 0.9]"),
        ON("'pattern': 'checker', 'colors': [0.1, 1]"),
        ON("'pattern': 'checker', 'colors': [0, 1], 'uv': {'scale': 2}"),
        ON("'pattern': 'checker', 'colors': [0, 1], 'uv': {'offset': [0, 1]}"),
        ON("'pattern': 'grid', 'colors': [0, 1]"),
        ON("'pattern': 'grid', 'colors': [0, 1], 'width': 0.2"),
        ON("'pattern': 'gradient', 'colors': [0, 1]"),
        ON("'pattern': 'gradient', 'colors': [0, 1], 'uv': {'wrap': 'repeat'}"),
        ON("'pattern': 'noise', 'colors': [0, 1]"),
        ON("'pattern': 'noise', 'colors': [0, 1], 'octaves': 3"),
        OBJECT("'type': 'sphere', 'material': {'diffuse': 1}"),
        OBJECT("'type': 'sphere', 'material': {'diffuse': 1, 'specular': {'pattern': 'checker', "
               "'colors': [0, 1]}}"),
        OBJECT("'type': 'sphere', 'material': {'diffuse': 1, 'specular': 1}"),
        COAT("1", "'reflection': 1"),
        COAT("1", "'reflection': " GRID("[0, 1]")),
        COAT("1", "'reflection': " GRID("[0.5, 1]")),
        COAT("1", "'transmission': " GRID("[0, 1]")),
        COAT("1", "'reflection': 1, 'transmission': " GRID("[0, 1]")),
        COAT("1", "'transmission': 1, 'reflection': " GRID("[0, 1]")),
        FACETS("1", ""),
        FACETS(GRID("[0, 1]"), ""),
        FACETS(GRID("[0.5, 1]"), ""),
        FACETS(GRID("[1, 0]"), ""),
    };
    enum { COUNT = sizeof scenes / sizeof scenes[0] };
    char digests[COUNT][33];
    for (int i = 0; i < COUNT; i++) {
        reading r = read_scene(scenes[i]);
        memcpy(digests[i], r.scene->digest, sizeof digests[i]);
        for (int k = 0; k < i; k++) assert_string_not_equal(digests[i], digests[k]);
        drop(&r);
    }
    reading same = read_scene(ON("'uv': {'scale': [1, 1], 'rotate': 0}, 'colors': ['black', 1], "
                                 "'pattern': 'checker'"));
    assert_string_equal(same.scene->digest, digests[0]);
    drop(&same);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(patterns_are_two_colors_and_a_map),
        cmocka_unit_test(mistakes_in_patterns_are_pointed_to),
        cmocka_unit_test(mistakes_in_pictures_are_pointed_to),
        cmocka_unit_test(patterns_need_a_chart_and_colors_that_multiply),
        cmocka_unit_test(patterns_and_pictures_have_no_other_place),
        cmocka_unit_test(facets_mirror_shares_that_are_patterns),
        cmocka_unit_test(opacities_are_shares),
        cmocka_unit_test(mirrors_and_glass_have_no_negative_colors),
        cmocka_unit_test(mirrors_and_glass_are_the_most_of_their_patterns),
        cmocka_unit_test(digests_know_patterns),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
