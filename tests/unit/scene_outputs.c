/* Outputs: formats, color, depths, channels and layers. */
#include "unit/scene_support.h"

static shd_output output_of(const char *members) {
    char text[512];
    snprintf(text, sizeof text, OUTPUT("%s"), members);
    reading r = read_scene(text);
    shd_output out = r.scene->outputs[0];
    out.layers = NULL; /* they go with the arena; all names that are looked at are constant */
    drop(&r);
    return out;
}

static void every_format_has_its_color_and_depth(void **state) {
    (void)state;
    static const struct {
        const char *members;
        shd_format format;
        bool display;
        shd_depth depth;
    } cases[] = {
        {"'format': 'png'", SHD_PNG, true, SHD_U8},
        {"'format': 'jpeg'", SHD_JPEG, true, SHD_U8},
        {"'format': 'webp'", SHD_WEBP, true, SHD_U8},
        {"'format': 'tiff'", SHD_TIFF, true, SHD_U8},
        {"'format': 'exr'", SHD_EXR, false, SHD_HALF},
        {"'format': 'hdr'", SHD_HDR, false, SHD_FLOAT},
        {"'format': 'png', 'bitDepth': 16.0", SHD_PNG, true, SHD_U16},
        {"'format': 'tiff', 'bitDepth': 'half'", SHD_TIFF, true, SHD_HALF},
        {"'format': 'exr', 'bitDepth': 'float'", SHD_EXR, false, SHD_FLOAT},
        {"'format': 'exr', 'display': 'sRGB'", SHD_EXR, true, SHD_HALF},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        shd_output o = output_of(cases[i].members);
        assert_true(o.format_given);
        assert_int_equal(o.format, cases[i].format);
        assert_int_equal(o.depth, cases[i].depth);
        assert_true((o.display != NULL) == cases[i].display);
        assert_true((o.view != NULL) == cases[i].display);
        assert_true((o.color_space != NULL) != cases[i].display);
    }
}

static void display_and_view_complete_each_other(void **state) {
    (void)state;
    shd_output o = output_of("'display': 'Rec.1886'");
    assert_string_equal(o.display, "Rec.1886");
    assert_string_equal(o.view, "Standard");
    o = output_of("'view': 'Raw'");
    assert_string_equal(o.display, "sRGB");
    assert_string_equal(o.view, "Raw");
    o = output_of("'colorSpace': 'YIQ'");
    assert_null(o.display);
    assert_string_equal(o.color_space->name, "YIQ");
}

static void linear_formats_hold_the_working_space(void **state) {
    (void)state;
    reading r = read_scene(WITH("'workingSpace': 'wide', 'output': {'format': 'exr'}"));
    assert_string_equal(r.scene->outputs->color_space->name, "wide");
    drop(&r);
}

static void misread_files_give_warnings(void **state) {
    (void)state;
    static const struct {
        const char *json, *pointer, *detail; /* NULL: there is no warning */
    } cases[] = {
        {"'format': 'exr', 'display': 'sRGB'", "/output/display", "scene-linear light"},
        {"'format': 'hdr', 'view': 'ACES 1.0 - SDR Video'", "/output/view", "hdr holds"},
        {"'format': 'exr', 'colorSpace': 'sRGB'", "/output/colorSpace", "encoded"},
        {"'format': 'png', 'colorSpace': 'wide'", "/output/colorSpace", "8 bits"},
        {"'format': 'tiff', 'colorSpace': 'lin_rec709'", "/output/colorSpace", "8 bits"},
        {"'format': 'png', 'bitDepth': 16, 'colorSpace': 'wide'", NULL, NULL},
        {"'format': 'exr'", NULL, NULL},
        {"'format': 'exr', 'view': 'Raw'", NULL, NULL},
        {"'format': 'exr', 'colorSpace': 'YIQ'", NULL, NULL},
        {"'format': 'png', 'colorSpace': 'raw'", NULL, NULL},
        {"'format': 'png'", NULL, NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char json[256];
        snprintf(json, sizeof json, OUTPUT("%s"), cases[i].json);
        reading r = read_scene(json);
        assert_int_equal(r.report.warning_count, cases[i].pointer != NULL);
        if (cases[i].pointer) assert_true(has_warning(&r, cases[i].pointer, cases[i].detail));
        drop(&r);
    }
}

static void channels_are_those_of_the_space(void **state) {
    (void)state;
    assert_int_equal(output_of("'channel': 'G'").channel, 1);
    assert_int_equal(output_of("'channel': 'A'").channel, 3);
    assert_int_equal(output_of("'colorSpace': 'YIQ', 'channel': 'Q'").channel, 2);
    assert_int_equal(output_of("'colorSpace': 'HSV', 'channel': 'H'").channel, 0);
    assert_int_equal(output_of("'quality': 100").quality, 100);
    assert_int_equal(output_of("'quality': 100").effort, 2);
    assert_int_equal(output_of("'quality': 99").effort, 4);
    assert_int_equal(output_of("'effort': 0").effort, 0);
}

static void layers_are_read_in_order(void **state) {
    (void)state;
    reading r = read_scene(WITH(
        "'lights': [{'type': 'point'}, {'type': 'ambient'}], 'output': {'format': 'exr', 'layers':"
        "['light.1', 'beauty', 'depth', 'light.0', 'emissive', 'ambient', 'diffuse', 'specular',"
        "'normal', 'position', 'object']}"));
    const shd_output *o = r.scene->outputs;
    assert_int_equal(o->layer_count, 11);
    assert_int_equal(o->layers[0].kind, SHD_LAYER_LIGHT);
    assert_int_equal(o->layers[0].light, 1);
    assert_string_equal(o->layers[0].name, "light.1");
    assert_int_equal(o->layers[1].kind, SHD_LAYER_BEAUTY);
    assert_int_equal(o->layers[2].kind, SHD_LAYER_DEPTH);
    assert_int_equal(o->layers[10].kind, SHD_LAYER_OBJECT);
    drop(&r);
    r = read_scene(OUTPUT("'format': 'exr', 'layers': ['light.0']")); /* the default light */
    drop(&r);
}

static void several_outputs_are_multipart(void **state) {
    (void)state;
    reading r = read_scene(WITH("'outputs': [{'name': 'a.b_c-1'},"
                                "{'name': 'two', 'format': 'exr', 'layers': ['beauty']}]"));
    assert_true(r.scene->multipart);
    assert_int_equal(r.scene->output_count, 2);
    assert_string_equal(r.scene->outputs[0].name, "a.b_c-1");
    assert_false(r.scene->outputs[0].format_given);
    assert_int_equal(r.scene->outputs[1].format, SHD_EXR);
    drop(&r);
}

static void outputs_that_cannot_be_are_refused(void **state) {
    (void)state;
    static const refusal cases[] = {
        {OUTPUT("'format': 'jpg'"), "/output/format", "did you mean \"jpeg\"?"},
        {OUTPUT("'format': 'PNG'"), "/output/format", "did you mean \"png\"?"},
        {OUTPUT("'name': 'x'"), "/output/name", "unknown member"},
        {OUTPUT("'display': 'sRBG'"), "/output/display", "did you mean \"sRGB\"?"},
        {OUTPUT("'view': 'Filmic'"), "/output/view",
         "there is Standard, ACES 1.0 - SDR Video, Raw"},
        {OUTPUT("'display': 'Rec.1886', 'view': 'Raw'"), "/output/view",
         "\"Rec.1886\" has no view \"Raw\""},
        {OUTPUT("'colorSpace': 'YIQ', 'view': 'Raw'"), "/output", "not both"},
        {OUTPUT("'colorSpace': 'yuv'"), "/output/colorSpace", "no color space \"yuv\""},
        {OUTPUT("'format': 'jpeg', 'bitDepth': 16"), "/output/bitDepth",
         "jpeg cannot hold bitDepth 16: it holds 8"},
        {OUTPUT("'format': 'exr', 'bitDepth': 8"), "/output/bitDepth", "it holds half, float"},
        {OUTPUT("'format': 'hdr', 'bitDepth': 'half'"), "/output/bitDepth", "it holds float"},
        {OUTPUT("'bitDepth': 'float'"), "/output/bitDepth", "png cannot hold bitDepth float"},
        {OUTPUT("'bitDepth': 'eight'"), "/output/bitDepth", "must be 8, 16"},
        {OUTPUT("'channel': 'Y'"), "/output/channel",
         "there is R, G, B, A; for it, set colorSpace YIQ"},
        {OUTPUT("'channel': 'H'"), "/output/channel", "set colorSpace HSV"},
        {OUTPUT("'colorSpace': 'YIQ', 'channel': 'R'"), "/output/channel", "there is Y, I, Q, A"},
        {OUTPUT("'channel': 'alpha'"), "/output/channel", "there is R, G, B, A"},
        {OUTPUT("'channel': 0"), "/output/channel", "expected a string"},
        {OUTPUT("'layers': ['beauty']"), "/output/layers", "png has no layers: set format exr"},
        {OUTPUT("'format': 'exr', 'layers': []"), "/output/layers", "one or more"},
        {OUTPUT("'format': 'exr', 'layers': 'beauty'"), "/output/layers", "an array"},
        {OUTPUT("'format': 'exr', 'layers': ['beauti']"), "/output/layers/0", "\"beauty\"?"},
        {OUTPUT("'format': 'exr', 'layers': [1]"), "/output/layers/0", "name of a layer"},
        {OUTPUT("'format': 'exr', 'layers': ['light.1']"), "/output/layers/0",
         "there is no light 1: the scene has 1"},
        {OUTPUT("'format': 'exr', 'layers': ['lobe.1']"), "/output/layers/0",
         "there is no lobe 1: materials of the scene have 1 at most"},
        {OUTPUT("'format': 'exr', 'layers': ['lobe.']"), "/output/layers/0", "\"lobe.0\""},
        {OUTPUT("'format': 'exr', 'layers': ['lobe.<i>']"), "/output/layers/0", "number"},
        {OUTPUT("'format': 'exr', 'layers': ['lobe.0', 'lobe.0']"), "/output/layers",
         "\"lobe.0\" is there twice"},
        {OUTPUT("'format': 'exr', 'layers': ['light.01']"), "/output/layers/0", "\"light.0\""},
        {OUTPUT("'format': 'exr', 'layers': ['light.']"), "/output/layers/0", "\"light.0\""},
        {OUTPUT("'format': 'exr', 'layers': ['light.<i>']"), "/output/layers/0", "number"},
        {OUTPUT("'format': 'exr', 'layers': ['light.9999999999']"), "/output/layers/0",
         "\"light.0\""},
        {OUTPUT("'format': 'exr', 'layers': ['depth', 'depth']"), "/output/layers",
         "\"depth\" is there twice"},
        {OUTPUT("'format': 'exr', 'colorSpace': 'sRGB', 'layers': ['beauty']"), "/output/layers",
         "scene-linear"},
        {OUTPUT("'format': 'exr', 'display': 'sRGB', 'layers': ['beauty']"), "/output/layers",
         "scene-linear"},
        {OUTPUT("'format': 'exr', 'channel': 'R', 'layers': ['beauty']"), "/output/layers",
         "not both"},
        {WITH("'outputs': []"), "/outputs", "1 to 16 outputs, got 0"},
        {WITH("'outputs': [{}]"), "/outputs/0", "\"name\" is missing"},
        {WITH("'outputs': [{'name': ''}]"), "/outputs/0/name", "1 to 64 letters"},
        {WITH("'outputs': [{'name': 'a b'}]"), "/outputs/0/name", "got \"a b\""},
        {WITH("'outputs': [{'name': 'a'}, {'name': 'b'}, {'name': 'a'}]"), "/outputs/2/name",
         "taken by output 0"},
        {WITH("'output': {}, 'outputs': [{'name': 'a'}]"), "/outputs", "not both"},
    };
    ASSERT_REFUSED(cases);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_format_has_its_color_and_depth),
        cmocka_unit_test(display_and_view_complete_each_other),
        cmocka_unit_test(linear_formats_hold_the_working_space),
        cmocka_unit_test(misread_files_give_warnings),
        cmocka_unit_test(channels_are_those_of_the_space),
        cmocka_unit_test(layers_are_read_in_order),
        cmocka_unit_test(several_outputs_are_multipart),
        cmocka_unit_test(outputs_that_cannot_be_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
