/* One mistake hides no other one: the answer has them all, and says nothing that is not known. */
#include "unit/scene_support.h"

static void all_violations_are_in_one_answer(void **state) {
    (void)state;
    reading r = read_with("{'camera': {'fov': 200, 'up': [0, 0, 0], 'roll': 1},"
                          "'image': {'width': 0, 'samples': 1.5},"
                          "'lights': [{'type': 'lamp', 'angle': -1}, {}],"
                          "'materials': {'a': {'diffuse': 'rde', 'shininess': -1}},"
                          "'objects': [{'type': 'sphere', 'radius': -1, 'material': 'b'},"
                          "{'type': 'blob', 'height': 0}, 7],"
                          "'output': {'format': 'gif', 'quality': 0}}",
                          &scene_limits);
    static const char *const pointers[] = {"/camera/fov",
                                           "/camera/up",
                                           "/camera/roll",
                                           "/image/width",
                                           "/image/samples",
                                           "/lights/0/type",
                                           "/lights/0/angle",
                                           "/lights/1",
                                           "/materials/a/diffuse",
                                           "/objects/0/radius",
                                           "/materials/a/shininess",
                                           "/objects/0/material",
                                           "/objects/1/type",
                                           "/objects/1/height",
                                           "/objects/2",
                                           "/output/format",
                                           "/output/quality"};
    size_t count = sizeof pointers / sizeof pointers[0];
    for (size_t i = 0; i < count; i++) assert_true(has_error(&r, pointers[i], ""));
    assert_int_equal(r.report.error_count, count);
    drop(&r);
}

/* The document gives errors at these places, ended by NULL, and at no others. */
static void assert_errors(const char *text, const char *const *pointers) {
    reading r = read_with(text, &scene_limits);
    size_t count = 0;
    for (; pointers[count]; count++) {
        if (has_error(&r, pointers[count], "")) continue;
        print_error("%s\n  wanted an error at %s\n", text, pointers[count]);
        fail();
    }
    for (size_t e = 0; count != r.report.error_count && e < shd_report_errors_kept(&r.report); e++)
        print_error("got %s: %s\n", r.report.errors[e].pointer, r.report.errors[e].detail);
    assert_int_equal(r.report.error_count, count);
    drop(&r);
}

#define ASSERT_ERRORS(text, ...) assert_errors(text, (const char *const[]){__VA_ARGS__, NULL})

static void a_wrong_member_hides_nothing_else_of_the_camera(void **state) {
    (void)state;
    ASSERT_ERRORS(WITH("'camera': {'fov': 200, 'up': [0, 0, 1]}"), "/camera/fov", "/camera/up");
    ASSERT_ERRORS(WITH("'camera': {'type': 'x', 'position': [0, 0, 0]}"), "/camera/type",
                  "/camera/position");
    ASSERT_ERRORS(WITH("'camera': {'up': 1, 'target': [0, 0, 4]}"), "/camera/up", "/camera/target");
    ASSERT_ERRORS(WITH("'camera': {'position': 1, 'target': [0, 0, 4]}"), "/camera/position");
    ASSERT_ERRORS(WITH("'camera': {'target': 1, 'up': [0, 0, 1]}"), "/camera/target");
}

static void a_wrong_member_hides_nothing_else_of_the_image(void **state) {
    (void)state;
    ASSERT_ERRORS(WITH("'image': {'region': [600, 700, 10, 10.5]}"), "/image/region/0",
                  "/image/region/1", "/image/region/3");
    ASSERT_ERRORS(WITH("'image': {'region': [null, 0.5, 600, 600]}"), "/image/region/0",
                  "/image/region/1", "/image/region/2", "/image/region/3");
    ASSERT_ERRORS(WITH("'image': {'width': 0, 'region': [600, 0, 10, 513]}"), "/image/width",
                  "/image/region/3");
    ASSERT_ERRORS(WITH("'image': {'width': 60000, 'height': 60000, 'samples': 0}"),
                  "/image/samples", "/image");
    ASSERT_ERRORS(WITH("'image': {'width': 60000, 'height': -1}"), "/image/height");
}

#define FLAT_MATRIX "[0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1]"

static void a_wrong_member_hides_nothing_else_of_a_light(void **state) {
    (void)state;
    ASSERT_ERRORS(LIGHT("'type': 'point', 'position': [1, 1, 1, 0], 'color': 1e200, "
                        "'intensity': 1e200"),
                  "/lights/0/position", "/lights/0");
    ASSERT_ERRORS(LIGHT("'type': 'lamp', 'color': 1e200, 'intensity': 1e200"), "/lights/0/type",
                  "/lights/0");
    ASSERT_ERRORS(LIGHT("'type': 'spot', 'position': [null, 1, 1, 0]"), "/lights/0/position/0",
                  "/lights/0/position");
    ASSERT_ERRORS(LIGHT("'type': 'directional', 'position': [1, 1, 1], 'direction': [0, 0, 0]"),
                  "/lights/0/direction", "/lights/0/position", "/lights/0/position");
    /* A white of "wide" is twice as bright, which a color that is wrong does not say. */
    ASSERT_ERRORS("{'colorSpace': 'wide', 'objects': [], 'lights': [{'type': 'point', "
                  "'color': null, 'intensity': 1e308}]}",
                  "/lights/0/color");
}

static void a_wrong_member_hides_nothing_else_of_an_output(void **state) {
    (void)state;
    ASSERT_ERRORS(WITH("'outputs': [{'name': 'a'}, {'name': 'a', 'format': 'gif', "
                       "'colorSpace': 'YIQ', 'view': 'Raw', 'channel': 'Z', 'layers': ['x']}]"),
                  "/outputs/1/format", "/outputs/1/name", "/outputs/1", "/outputs/1/channel",
                  "/outputs/1/layers", "/outputs/1/layers", "/outputs/1/layers/0");
    ASSERT_ERRORS(OUTPUT("'format': 'exr', 'view': 'no', 'channel': 'Y', 'layers': []"),
                  "/output/view", "/output/channel", "/output/layers", "/output/layers",
                  "/output/layers");
    ASSERT_ERRORS(OUTPUT("'display': 'no', 'colorSpace': 'no', 'channel': 'Y'"), "/output",
                  "/output/display", "/output/colorSpace");
}

static void a_wrong_member_hides_nothing_else_of_a_transform(void **state) {
    (void)state;
#define TRANSFORM(members) OBJECT("'type': 'box', 'transform': {" members "}")
    ASSERT_ERRORS(TRANSFORM("'matrix': " FLAT_MATRIX ", 'scale': 1e-320"), "/objects/0/transform",
                  "/objects/0/transform/matrix", "/objects/0/transform/scale");
    ASSERT_ERRORS(TRANSFORM("'scale': [0, null, 1], 'translate': [1, 2]"),
                  "/objects/0/transform/scale", "/objects/0/transform/scale/1",
                  "/objects/0/transform/translate");
    ASSERT_ERRORS(TRANSFORM("'scale': 1e-320, 'translate': [1, 2]"), "/objects/0/transform/scale",
                  "/objects/0/transform/translate");
    ASSERT_ERRORS(TRANSFORM("'matrix': [1, 0, 0, 1, 0, 1, 0, 0, 0, null]"),
                  "/objects/0/transform/matrix", "/objects/0/transform/matrix/9");
}

static void a_wrong_array_hides_nothing_else_of_a_mesh(void **state) {
    (void)state;
    ASSERT_ERRORS(MESH("'positions': [0, 0, 0, 1, null, 0, 0, 1], 'indices': [0, 1, 3, 0.5], "
                       "'normals': [0, 0, 0, 'x']"),
                  "/objects/0/positions", "/objects/0/positions/4", "/objects/0/indices",
                  "/objects/0/indices/2", "/objects/0/indices/3", "/objects/0/normals",
                  "/objects/0/normals/0", "/objects/0/normals/3");
    ASSERT_ERRORS(MESH("'indices': [0, 1, -1], 'normals': [0, 0, 0]"), "/objects/0",
                  "/objects/0/indices/2", "/objects/0/normals/0");
    ASSERT_ERRORS(OBJECT("'type': 'msh', 'positions': [1, 2]"), "/objects/0/type",
                  "/objects/0/positions");
    ASSERT_ERRORS(MESH("'positions': [1, 'x', 3]"), "/objects/0/positions",
                  "/objects/0/positions/1");
}

static void a_limit_hides_nothing_within_it(void **state) {
    (void)state;
    static const shd_limits limits = {.pixels = 100,
                                      .samples = 100,
                                      .lights = 2,
                                      .objects = 2,
                                      .triangles = 1,
                                      .body = 4096,
                                      .memory = 1 << 24};
    reading r = read_with("{'image': {'samples': 0}, 'lights': [{}, {'type': 'point', "
                          "'intensity': null}, {}], 'objects': [{'type': 'mesh', 'positions': "
                          "[0, 0, 0, 1, 0, 0, 0, 1, 0], 'indices': [0, 1, 2, 0, 1, 3]}, 1, 2],"
                          "'output': {'format': 'exr', 'layers': ['light.2', 'light.3']}}",
                          &limits);
    static const char *const pointers[] = {"/image/samples",
                                           "/image",
                                           "/lights",
                                           "/lights/0",
                                           "/lights/1/intensity",
                                           "/objects",
                                           "/objects/0/indices/5",
                                           "/objects/1",
                                           "/output/layers/1"};
    size_t count = sizeof pointers / sizeof pointers[0];
    for (size_t i = 0; i < count; i++) assert_true(has_error(&r, pointers[i], ""));
    assert_true(has_error(&r, "/objects", "`triangles`"));
    assert_int_equal(r.report.error_count, count + 1);
    drop(&r);
}

static void what_is_not_known_is_not_judged(void **state) {
    (void)state;
    /* The interpolation of a plane, the names of materials, the space of a color. */
    ASSERT_ERRORS("{'interpolation': 'flat', 'objects': [{'type': 'plane', 'interpolation': 1}]}",
                  "/objects/0/interpolation");
    ASSERT_ERRORS("{'materials': [], 'objects': [{'type': 'disc', 'material': 'mine'}]}",
                  "/materials");
    ASSERT_ERRORS("{'colorSpace': 'raw', 'ambient': 1, 'lights': [{'type': 'point'}], "
                  "'objects': [{'type': 'disc'}]}",
                  "/colorSpace");
    ASSERT_ERRORS("{'workingSpace': 'sRGB', 'ambient': {'space': 'wide', 'value': [1e300, 0, 0]}, "
                  "'objects': []}",
                  "/workingSpace");
}

static void a_wrong_member_hides_nothing_else_of_the_rest(void **state) {
    (void)state;
    ASSERT_ERRORS(WITH("'image': {'width': 16384, 'height': 0}, 'output': {'format': 'webp', "
                       "'quality': 0}"),
                  "/image", "/image/height", "/output/quality");
    ASSERT_ERRORS(WITH("'accuracy': {'tier': 'exact', 'metric': 'code'}"), "/accuracy",
                  "/accuracy");
    ASSERT_ERRORS(WITH("'ambient': [1, null], 'camera': {'up': [1, 2, 'x', 4]}"), "/ambient",
                  "/ambient/1", "/camera/up", "/camera/up/2");
    ASSERT_ERRORS(WITH("'image': {'width': 0, 'height': 60000, 'region': [0, 0, 60000, 60000]}"),
                  "/image/width", "/image", "/image");
    ASSERT_ERRORS(WITH("'output': {'bitDepth': 'half', 'channel': 'Y', 'foo': 1}"), "/output/foo",
                  "/output/bitDepth", "/output/channel");
    ASSERT_ERRORS(WITH("'output': {'format': 'gif', 'bitDepth': 'half'}"), "/output/format");
    ASSERT_ERRORS(WITH("'output': {'colorSpace': 'nowhere', 'channel': 'Y', 'bitDepth': 'half'}"),
                  "/output/colorSpace", "/output/bitDepth");
    ASSERT_ERRORS(WITH("'lights': [{'type': 'point', 'position': [1, 1, 1, 0], "
                       "'attenuation': [0, 0, 0]}]"),
                  "/lights/0/attenuation", "/lights/0/position");
    ASSERT_ERRORS("{'objects': [{'type': 'sphere', 'transform': {'matrix': " FLAT_MATRIX
                  ", 'foo': 1}}]}",
                  "/objects/0/transform/foo", "/objects/0/transform/matrix");
    ASSERT_ERRORS("{'objects': [{'type': 'mesh', 'positions': [0, 0], 'indices': [0, 0], "
                  "'normals': [1]}]}",
                  "/objects/0/positions", "/objects/0/indices", "/objects/0/normals");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(all_violations_are_in_one_answer),
        cmocka_unit_test(a_wrong_member_hides_nothing_else_of_the_camera),
        cmocka_unit_test(a_wrong_member_hides_nothing_else_of_the_image),
        cmocka_unit_test(a_wrong_member_hides_nothing_else_of_a_light),
        cmocka_unit_test(a_wrong_member_hides_nothing_else_of_an_output),
        cmocka_unit_test(a_wrong_member_hides_nothing_else_of_a_transform),
        cmocka_unit_test(a_wrong_array_hides_nothing_else_of_a_mesh),
        cmocka_unit_test(a_limit_hides_nothing_within_it),
        cmocka_unit_test(what_is_not_known_is_not_judged),
        cmocka_unit_test(a_wrong_member_hides_nothing_else_of_the_rest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
