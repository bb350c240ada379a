/* Every way in which a document can fail to be a scene, with the place that is named. */
#include "unit/scene_support.h"

static void values_of_the_wrong_kind_are_refused(void **state) {
    (void)state;
    static const refusal cases[] = {
        {"[]", "", "expected an object, got an array"},
        {"null", "", "expected an object, got null"},
        {"12", "", "expected an object, got a number"},
        {"{}", "", "\"objects\" is missing"},
        {"{'objects': {}}", "/objects", "expected an array of objects, got an object"},
        {"{'objects': [null]}", "/objects/0", "expected an object, got null"},
        {WITH("'camera': []"), "/camera", "expected an object"},
        {WITH("'camera': {'fov': '40'}"), "/camera/fov", "expected a number, got a string"},
        {WITH("'camera': {'type': 1}"), "/camera/type", "expected a string, got a number"},
        {WITH("'camera': {'position': [1, 2]}"), "/camera/position", "3 numbers, got 2"},
        {WITH("'camera': {'position': [1, 2, true]}"), "/camera/position/2", "got true"},
        {WITH("'image': {'width': 1.5}"), "/image/width", "from 1 to 65535, got 1.5"},
        {WITH("'image': {'width': '1'}"), "/image/width", "expected an integer, got a string"},
        {WITH("'image': {'region': {}}"), "/image/region", "4 integers: x, y, width, height"},
        {WITH("'image': null"), "/image", "expected an object, got null"},
        {WITH("'ambient': null"), "/ambient", "expected a color"},
        {WITH("'background': false"), "/background", "expected a color"},
        {WITH("'lights': null"), "/lights", "expected an array of lights"},
        {WITH("'lights': [5]"), "/lights/0", "expected an object, got a number"},
        {WITH("'materials': []"), "/materials", "expected an object"},
        {WITH("'materials': {'a': 'brass'}"), "/materials/a", "expected an object, got a string"},
        {WITH("'interpolation': 3"), "/interpolation", "expected a string"},
        {WITH("'accuracy': 'exact'"), "/accuracy", "expected an object"},
        {WITH("'output': []"), "/output", "expected an object"},
        {WITH("'outputs': {}"), "/outputs", "expected an array of 1 to 16 outputs"},
        {OBJECT("'type': 'sphere', 'transform': null"), "/objects/0/transform", "got null"},
        {OBJECT("'type': 'sphere', 'material': 1"), "/objects/0/material",
         "its name, got a number"},
        {OBJECT("'type': 'sphere', 'transform': {'scale': 'big'}"), "/objects/0/transform/scale",
         "a number or an array"},
    };
    ASSERT_REFUSED(cases);
}

static void values_out_of_range_are_refused(void **state) {
    (void)state;
    static const refusal cases[] = {
        {WITH("'camera': {'fov': 0}"), "/camera/fov", "between 0 and 180"},
        {WITH("'camera': {'fov': 180}"), "/camera/fov", "got 180"},
        {WITH("'camera': {'type': 'orthographic', 'height': 0}"), "/camera/height",
         "greater than 0"},
        {WITH("'image': {'width': 0}"), "/image/width", "1 to 65535, got 0"},
        {WITH("'image': {'height': 65536}"), "/image/height", "1 to 65535"},
        {WITH("'image': {'samples': 65}"), "/image/samples", "1 to 64"},
        {WITH("'image': {'samples': 0}"), "/image/samples", "1 to 64"},
        {WITH("'image': {'samples': 1e300}"), "/image/samples", "1 to 64"},
        {LIGHT("'type': 'spot', 'angle': 0"), "/lights/0/angle", "up to 180"},
        {LIGHT("'type': 'spot', 'angle': 181"), "/lights/0/angle", "up to 180"},
        {LIGHT("'type': 'spot', 'penumbra': 1.01"), "/lights/0/penumbra", "0 to 1"},
        {LIGHT("'type': 'spot', 'exponent': -1"), "/lights/0/exponent", "0 or more"},
        {LIGHT("'type': 'point', 'minDistance': -1"), "/lights/0/minDistance", "0 or more"},
        {LIGHT("'type': 'point', 'attenuation': [1, -1, 0]"), "/lights/0/attenuation/1",
         "0 or more"},
        {LIGHT("'type': 'point', 'attenuation': [0, 0, 0]"), "/lights/0/attenuation", "all be 0"},
        {OBJECT("'type': 'sphere', 'radius': 0"), "/objects/0/radius", "greater than 0"},
        {OBJECT("'type': 'torus', 'tube': -1"), "/objects/0/tube", "greater than 0"},
        {OBJECT("'type': 'cone', 'height': 0"), "/objects/0/height", "greater than 0"},
        {OBJECT("'type': 'box', 'size': [1, 0, 1]"), "/objects/0/size/1", "greater than 0"},
        {OBJECT("'type': 'disc', 'segments': 2"), "/objects/0/segments", "3 to 1024"},
        {OBJECT("'type': 'disc', 'segments': 1025"), "/objects/0/segments", "3 to 1024"},
        {OBJECT(
             "'type': 'disc', 'material': {'model': 'cook-torrance', 'lobes': [{'roughness': 0}]}"),
         "/objects/0/material/lobes/0/roughness", "0.0001 to 10"},
        {OBJECT("'type': 'disc', 'material': {'shininess': -1}"), "/objects/0/material/shininess",
         "0 or more"},
        {WITH("'accuracy': {'maxError': 0}"), "/accuracy/maxError", "greater than 0"},
        {OUTPUT("'quality': 0"), "/output/quality", "1 to 100"},
        {OUTPUT("'quality': 50.5"), "/output/quality", "an integer"},
        {OUTPUT("'bitDepth': 12"), "/output/bitDepth", "8, 16, \"half\" or \"float\""},
    };
    ASSERT_REFUSED(cases);
}

static void unknown_names_come_with_a_suggestion(void **state) {
    (void)state;
    static const refusal cases[] = {
        {OBJECT("'type': 'sphere', 'radus': 1"), "/objects/0/radus",
         "unknown member \"radus\" of a sphere: did you mean \"radius\"?"},
        {OBJECT("'type': 'sphere', 'Radius': 1"), "/objects/0/Radius", "did you mean \"radius\"?"},
        {OBJECT("'type': 'sphere', 'size': 1"), "/objects/0/size",
         "of a sphere: there is type, radius, transform"},
        {OBJECT("'type': 'plane', 'segments': 9"), "/objects/0/segments", "of a plane"},
        {OBJECT("'type': 'shpere'"), "/objects/0/type", "did you mean \"sphere\"?"},
        {OBJECT("'type': 'pyramid'"), "/objects/0/type", "there is sphere, plane, disc, box"},
        {WITH("'camra': {}"), "/camra", "did you mean \"camera\"?"},
        {WITH("'name': 'x'"), "/name", "of the scene: there is $schema, workingSpace"},
        {LIGHT("'type': 'point', 'fame': 1"), "/lights/0/fame", "did you mean \"frame\"?"},
        {OBJECT("'type': 'sphere', 'material': {'name': 'x'}"), "/objects/0/material/name",
         "of a material: there is model"},
        {WITH("'camera': {'type': 'ortographic'}"), "/camera/type", "\"orthographic\"?"},
        {WITH("'camera': {'height': 2}"), "/camera/height", "unknown member \"height\""},
        {WITH("'camera': {'type': 'orthographic', 'fov': 2}"), "/camera/fov",
         "of an orthographic camera"},
        {LIGHT("'type': 'ambient', 'position': [1, 2, 3]"), "/lights/0/position",
         "of an ambient light"},
        {LIGHT("'type': 'directional', 'attenuation': [1, 0, 0]"), "/lights/0/attenuation",
         "of a directional light"},
        {LIGHT("'position': [1, 2, 3, 1], 'angle': 3"), "/lights/0/angle",
         "of a light without `type`"},
        {LIGHT("'type': 'point', 'colour': 1"), "/lights/0/colour", "did you mean \"color\"?"},
        {LIGHT("'type': 'point', 'frame': 'eye'"), "/lights/0/frame", "there is world, camera"},
        {WITH("'interpolation': 'gourad'"), "/interpolation", "did you mean \"gouraud\"?"},
        {WITH("'accuracy': {'tier': 'standart'}"), "/accuracy/tier", "\"standard\"?"},
        {OBJECT("'type': 'disc', 'material': 'brasss'"), "/objects/0/material",
         "no material \"brasss\": did you mean \"brass\"?"},
        {"{'materials': {'my own': {}}, 'objects': [{'type': 'disc', 'material': 'my-own'}]}",
         "/objects/0/material", "did you mean \"my own\"?"},
        {OBJECT("'type': 'disc', 'material': {'preset': 'jad'}"), "/objects/0/material/preset",
         "no preset \"jad\": did you mean \"jade\"?"},
        {OBJECT("'type': 'disc', 'material': {'model': 'lambert'}"), "/objects/0/material/model",
         "there is phong, blinn-phong, phong-normalized, oren-nayar, cook-torrance"},
        {OBJECT("'type': 'disc', 'material': {'lobes': [{'shine': 1}]}"),
         "/objects/0/material/lobes/0/shine", "of a lobe: there is specular, shininess"},
        {WITH("'workingSpace': 'lin_rec7090'"), "/workingSpace", "did you mean \"lin_rec709\"?"},
        {WITH("'colorSpace': 'srbg'"), "/colorSpace", "did you mean \"sRGB\"?"},
        {WITH("'ambient': {'space': 'xyz', 'value': [1, 1, 1]}"), "/ambient/space",
         "there is lin_rec709, wide, sRGB"},
        {WITH("'ambient': {'space': 'sRGB', 'value': [1, 1, 1], 'alpha': 1}"), "/ambient/alpha",
         "of a color"},
        {WITH("'x~y/z': 1"), "/x~0y~1z", "unknown member \"x~y/z\""},
    };
    ASSERT_REFUSED(cases);
}

static void scenes_that_make_no_sense_are_refused(void **state) {
    (void)state;
    static const refusal cases[] = {
        {WITH("'camera': {'target': [0, 0, 4]}"), "/camera/target", "the same point"},
        {WITH("'camera': {'position': [0, 0, 0]}"), "/camera/position", "the same point"},
        {WITH("'camera': {'up': [0, 0, 0]}"), "/camera/up", "must not be zero"},
        {WITH("'camera': {'up': [0, 0, -7]}"), "/camera/up", "parallel to the view"},
        {WITH("'camera': {'up': [1e-12, 0, 1]}"), "/camera/up", "parallel to the view"},
        {WITH("'camera': {'position': [0, 5, 0]}"), "/camera", "parallel to the view"},
        {WITH("'image': {'region': [0, 0, 513, 1]}"), "/image/region/2", "out of the picture"},
        {WITH("'image': {'region': [500, 0, 13, 1]}"), "/image/region/2", "512 pixels"},
        {WITH("'image': {'region': [0, 512, 1, 1]}"), "/image/region/3", "out of the picture"},
        {WITH("'image': {'region': [-1, 0, 1, 1]}"), "/image/region/0", "out of the picture"},
        {WITH("'image': {'region': [0, 0, 0, 1]}"), "/image/region/2",
         "at least 1 pixel wide, got 0"},
        {WITH("'image': {'region': [0, 0, 1, -2]}"), "/image/region/3", "1 pixel high, got -2"},
        {WITH("'image': {'region': [0, 0.5, 1, 1]}"), "/image/region/1", "an integer"},
        {WITH("'lights': [{}]"), "/lights/0", "needs a `type`"},
        {LIGHT("'position': [1, 2, 3]"), "/lights/0", "needs a `type`"},
        {LIGHT("'position': [1, 2, 3, 4, 5]"), "/lights/0/position", "got 5"},
        {LIGHT("'position': [0, 0, 0, 0]"), "/lights/0/position", "with w = 0"},
        {LIGHT("'position': [1e300, 0, 0, 1e-300]"), "/lights/0/position", "not finite"},
        {LIGHT("'type': 'point', 'position': [1, 2, 3, 0]"), "/lights/0/position", "at infinity"},
        {LIGHT("'type': 'directional', 'position': [1, 2, 3]"), "/lights/0/position",
         "has no position"},
        {LIGHT("'type': 'directional', 'position': [1, 2, 3, 0], 'direction': [1, 1, 1]"),
         "/lights/0/position", "either"},
        {LIGHT("'type': 'directional', 'direction': [0, 0, 0]"), "/lights/0/direction",
         "must not be zero"},
        {LIGHT("'type': 'spot', 'direction': [0, 0, 0]"), "/lights/0/direction", "zero"},
        {LIGHT("'type': 'point', 'color': 1e200, 'intensity': 1e200"), "/lights/0", "not finite"},
        {WITH("'ambient': '#12345'"), "/ambient", "\"#12345\" is no color of CSS: a # has 3, 4, 6"},
        {WITH("'ambient': '#12345g'"), "/ambient", "digits from 0 to 9 and from a to f"},
        {WITH("'ambient': '123456'"), "/ambient", "\"#rrggbb\""},
        {WITH("'ambient': 'bleu'"), "/ambient", "did you mean \"blue\"?"},
        {WITH("'ambient': 'rgb(1 2)'"), "/ambient", "rgb() takes three components, got 2"},
        {WITH("'ambient': '#f008'"), "/ambient",
         "an alpha below 1 may stand in `background` and a material's `diffuse` alone"},
        {WITH("'ambient': [1, 1, 1, 0]"), "/ambient", "`diffuse` alone, got 0"},
        {WITH("'background': [1, 1, 1, 1.5]"), "/background/3", "from 0 to 1, got 1.5"},
        {WITH("'ambient': {'value': [1, 1, 1]}"), "/ambient", "\"space\" is missing"},
        {WITH("'ambient': {'space': 'sRGB'}"), "/ambient", "\"value\" is missing"},
        {WITH("'ambient': [1, 2, 3, 4]"), "/ambient/3", "an alpha is from 0 to 1, got 4"},
        {WITH("'ambient': [1, 2, 3, 1, 1]"), "/ambient", "or 4 with an alpha, got 5"},
        {WITH("'workingSpace': 'sRGB'"), "/workingSpace", "not scene-linear"},
        {WITH("'accuracy': {'tier': 'exact', 'maxError': 1}"), "/accuracy", "not both"},
        {WITH("'accuracy': {'metric': 'code'}"), "/accuracy", "needs a `maxError`"},
        {OBJECT("'radius': 1"), "/objects/0", "\"type\" is missing"},
        {OBJECT("'type': 'plane', 'interpolation': 'flat'"), "/objects/0",
         "an infinite plane has no faces: use disc or box, or interpolation phong"},
        {"{'interpolation': 'gouraud', 'objects': [{'type': 'plane'}]}", "/objects/0", "no faces"},
        {OBJECT("'type': 'box', 'transform': {'scale': 0}"), "/objects/0/transform/scale",
         "must not be 0"},
        {OBJECT("'type': 'box', 'transform': {'scale': [1, 0, 1]}"), "/objects/0/transform/scale",
         "must not be 0"},
        {OBJECT("'type': 'box', 'transform': {'scale': 1e-320}"), "/objects/0/transform/scale",
         "no inverse"},
        {OBJECT("'type': 'box', 'transform': {'matrix': [1, 2, 3]}"), "/objects/0/transform/matrix",
         "16 numbers, got 3"},
        {OBJECT("'type': 'box', 'transform': {'matrix': [1,0,0,1, 0,1,0,0, 0,0,1,0, 0,0,0,1]}"),
         "/objects/0/transform/matrix", "last row"},
        {OBJECT("'type': 'box', 'transform': {'matrix': [1,0,0,0, 1,0,0,0, 0,0,1,0, 0,0,0,1]}"),
         "/objects/0/transform/matrix", "no inverse"},
        {OBJECT("'type': 'box', 'transform': {'scale': 2, 'matrix': [1,0,0,0, 0,1,0,0, 0,0,1,0,"
                "0,0,0,1]}"),
         "/objects/0/transform", "stands alone"},
    };
    ASSERT_REFUSED(cases);
}

static void meshes_that_do_not_fit_are_refused(void **state) {
    (void)state;
#define TRIANGLE "'positions': [0,0,0, 1,0,0, 0,1,0], "
    static const refusal cases[] = {
        {"{'objects': [{'type': 'mesh'}]}", "/objects/0", "\"positions\" is missing"},
        {MESH("'positions': []"), "/objects/0/positions", "in threes, got 0"},
        {MESH("'positions': [1, 2]"), "/objects/0/positions", "in threes, got 2"},
        {MESH("'positions': null"), "/objects/0/positions", "got null"},
        {MESH("'positions': [1, 2, 3]"), "/objects/0/positions", "without `indices`"},
        {MESH("'positions': [0,0,0, 1,null,0, 0,1,0]"), "/objects/0/positions/4", "got null"},
        {MESH(TRIANGLE "'indices': [0, 1]"), "/objects/0/indices", "in threes, got 2"},
        {MESH(TRIANGLE "'indices': []"), "/objects/0/indices", "in threes, got 0"},
        {MESH(TRIANGLE "'indices': {}"), "/objects/0/indices", "got an object"},
        {MESH(TRIANGLE "'indices': [0, 1, 3]"), "/objects/0/indices/2", "from 0 to 2, got 3"},
        {MESH(TRIANGLE "'indices': [0, 1, -1]"), "/objects/0/indices/2", "got -1"},
        {MESH(TRIANGLE "'indices': [0, 1, 1.5]"), "/objects/0/indices/2", "got 1.5"},
        {MESH(TRIANGLE "'indices': [0, 1, 1e300]"), "/objects/0/indices/2", "got 1e+300"},
        {MESH(TRIANGLE "'indices': [0, 1, '2']"), "/objects/0/indices/2", "got a string"},
        {MESH(TRIANGLE "'normals': [0, 0, 1]"), "/objects/0/normals", "9 numbers, got 3"},
        {MESH(TRIANGLE "'normals': [0,0,1, 0,0,0, 0,0,1]"), "/objects/0/normals/3",
         "the normal of vertex 1 is zero"},
        {MESH(TRIANGLE "'normals': [0,0,1, 0,'1',0, 0,0,1]"), "/objects/0/normals/4", "a number"},
        {MESH(TRIANGLE "'normals': 1"), "/objects/0/normals", "an array of numbers"},
        {MESH(TRIANGLE "'segments': 5"), "/objects/0/segments", "of a mesh"},
    };
    ASSERT_REFUSED(cases);
}

static void pictures_that_no_format_holds_are_refused(void **state) {
    (void)state;
    static const refusal cases[] = {
        {WITH("'image': {'width': 16384, 'height': 1}, 'output': {'format': 'webp'}"), "/image",
         "a webp picture is at most 16383 pixels wide and high, not 16384"},
        {WITH("'image': {'width': 1, 'height': 65501}, 'output': {'format': 'jpeg'}"), "/image",
         "at most 65500"},
        {OBJECT("'type': 'sphere', 'radius': 1e-320"), "/objects/0", "size and transform"},
    };
    ASSERT_REFUSED(cases);
    reading r = read_scene(WITH("'image': {'width': 16384, 'height': 1, 'region': "
                                "[1, 0, 16383, 1]}, 'output': {'format': 'webp'}"));
    drop(&r);
    r = read_scene(WITH("'image': {'width': 65500, 'height': 1}, 'output': {'format': 'jpeg'}"));
    drop(&r);
}

static void more_errors_than_are_kept_are_counted(void **state) {
    (void)state;
    char text[8192] = "{'objects': [";
    for (int i = 0; i < 200; i++) strcat(text, i ? ",{'type': 'x'}" : "{'type': 'x'}");
    strcat(text, "]}");
    reading r = read_with(text, &scene_limits);
    assert_int_equal(r.report.error_count, 200);
    assert_true(has_error(&r, "/objects/63/type", ""));
    drop(&r);
}

/* A configuration has sRGB, linear Rec.709, both or neither. */
static void colors_of_css_need_their_spaces(void **state) {
    (void)state;
    static const struct {
        const char *color;
        bool css, rec709;
        const char *words;
    } cases[] = {
        {"red", false, true, "no sRGB space for colors like \"red\""},
        {"lab(50 0 0)", true, false, "no linear Rec.709 space for colors like \"lab(50 0 0)\""},
        {"rgb(-1 0 0)", true, false, "no linear Rec.709 space"},
        {"#123", true, false, NULL},
        {"rgb(-1 0 0)", false, true, NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        shd_catalog catalog = scene_catalog;
        if (!cases[i].css) catalog.css = NULL;
        if (!cases[i].rec709) catalog.rec709 = NULL;
        char text[200];
        snprintf(text, sizeof text, "{\"ambient\": \"%s\", \"objects\": []}", cases[i].color);
        reading r = {.arena = shd_arena_new(scene_limits.memory)};
        shd_report_init(&r.report, r.arena);
        shd_scene_read(text, strlen(text), &catalog, &scene_limits, NULL, SHD_PNG, NULL, r.arena,
                       &r.scene, &r.report);
        assert_int_equal(r.report.error_count, cases[i].words != NULL);
        if (cases[i].words) assert_true(has_error(&r, "/ambient", cases[i].words));
        drop(&r);
    }
}

/* What a client wrote is shown without its control characters and not at any length. */
static void messages_are_fit_to_be_shown(void **state) {
    (void)state;
    char text[4096] = "{'objects': [], 'material", *end = text + strlen(text);
    memset(end, 'z', 3000);
    strcpy(end + 3000, "': 1, 'a\\u001b[31m\\u0085b': 1}");
    reading r = read_with(text, &scene_limits);
    assert_int_equal(r.report.error_count, 2);
    for (int i = 0; i < 2; i++) {
        assert_string_equal(r.report.errors[i].pointer, "");
        assert_true(strlen(r.report.errors[i].detail) < 400);
        assert_null(strpbrk(r.report.errors[i].detail, "\x1b\x85\n"));
    }
    assert_true(has_error(&r, "", "\"a?[31m?b\""));
    assert_true(has_error(&r, "", "zzz...\""));
    drop(&r);
    /* A name that cannot be shown is one all the same. */
    r = read_with("{'materials': {'a\\nb': {'diffuse': 'rde'}},"
                  "'objects': [{'type': 'disc', 'material': 'a\\nb'}]}",
                  &scene_limits);
    assert_true(has_error(&r, "/materials", "\"a?b\""));
    assert_true(has_error(&r, "/materials", "\"rde\""));
    assert_int_equal(r.report.error_count, 2);
    drop(&r);
    /* Cut between characters: 29 times two bytes and the half of one. */
    r = read_with(OBJECT("'type': 'xüüüüüüüüüüüüüüüüüüüüüüüüüüüüüüüüüüüü'"), &scene_limits);
    assert_true(has_error(&r, "/objects/0/type", "ü...\""));
    drop(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_of_the_wrong_kind_are_refused),
        cmocka_unit_test(values_out_of_range_are_refused),
        cmocka_unit_test(unknown_names_come_with_a_suggestion),
        cmocka_unit_test(scenes_that_make_no_sense_are_refused),
        cmocka_unit_test(meshes_that_do_not_fit_are_refused),
        cmocka_unit_test(pictures_that_no_format_holds_are_refused),
        cmocka_unit_test(more_errors_than_are_kept_are_counted),
        cmocka_unit_test(colors_of_css_need_their_spaces),
        cmocka_unit_test(messages_are_fit_to_be_shown),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
