/* Colors that go straight to codes give the bytes that they give through floats. */
#include "property/pieces.h"

/* With light beyond every range. */
static char *scene(const char *background, const char *outputs) {
    return text_of(
        "{\"image\": {\"width\": 167, \"height\": 131, \"samples\": 4}, \"background\": %s,"
        " \"lights\": [{\"type\": \"point\", \"position\": [2, 3, 4], \"intensity\": 40,"
        " \"attenuation\": [1, 0, 1]}, {\"type\": \"directional\", \"color\": [0.5, 0.2, 1]}],"
        " \"objects\": [{\"type\": \"sphere\", \"material\": {\"diffuse\": [0.8, 0.3, 0.1],"
        " \"specular\": 0.5, \"shininess\": 30}}, {\"type\": \"sphere\", \"transform\": "
        "{\"translate\": [1, 1, 0]},"
        " \"radius\": 0.4, \"material\": {\"emissive\": [3e38, -3e38, 1e-6]}}],"
        " \"outputs\": [%s]}",
        background, outputs);
}

typedef struct result {
    file files[16];
    size_t count;
    uint64_t saturated, clipped;
} result;

static result render(shd_engine *engine, const char *json) {
    result r = {.count = 0};
    shd_request *request = read_scene(engine, json);
    shd_error error = {.status = SHD_OK};
    if (shd_request_render(request, NULL, &error)) fail_msg("%s: %s", error.path, error.text);
    const shd_picture *pictures = shd_request_pictures(request, &r.count);
    assert_true(r.count <= 16);
    r.saturated = request->rendering.saturated;
    r.clipped = request->rendering.clipped;
    for (size_t i = 0; i < r.count; i++) {
        r.files[i].size = pictures[i].size;
        r.files[i].data = shd_request_take(request, i);
    }
    shd_request_drop(request);
    return r;
}

/* Renders both ways; the number of values that were saturated is returned. */
static uint64_t same_both_ways(shd_engine *engine, const char *background, const char *outputs) {
    char *json = scene(background, outputs);
    result with = render(engine, json);
    engine->floats_only = true;
    result without = render(engine, json);
    engine->floats_only = false;
    free(json);
    assert_int_equal(with.count, without.count);
    for (size_t i = 0; i < with.count; i++) {
        if (!same_file(with.files[i], without.files[i]))
            fail_msg("output %zu of background %s: %s", i, background, outputs);
        free(with.files[i].data);
        free(without.files[i].data);
    }
    assert_true(with.saturated == without.saturated);
    assert_true(with.clipped == without.clipped);
    return with.saturated;
}

static const char *const backgrounds[] = {"0.1", "null"};

static void pictures_are_the_same_bytes(void **state) {
    static const char *const outputs =
        "{\"name\": \"a\", \"format\": \"png\"},"
        "{\"name\": \"b\", \"format\": \"png\", \"bitDepth\": 16},"
        "{\"name\": \"c\", \"format\": \"jpeg\"},"
        "{\"name\": \"d\", \"format\": \"webp\", \"quality\": 100},"
        "{\"name\": \"e\", \"format\": \"tiff\"},"
        "{\"name\": \"f\", \"format\": \"tiff\", \"bitDepth\": 16},"
        "{\"name\": \"g\", \"format\": \"png\", \"display\": \"Rec.1886\"},"
        "{\"name\": \"h\", \"format\": \"png\", \"view\": \"Raw\"},"
        "{\"name\": \"i\", \"format\": \"png\", \"display\": \"Display P3\"},"
        "{\"name\": \"j\", \"format\": \"png\", \"colorSpace\": \"YIQ\"},"
        "{\"name\": \"k\", \"format\": \"png\", \"colorSpace\": \"sRGB\"}";
    for (int i = 0; i < 2; i++) assert_true(same_both_ways(*state, backgrounds[i], outputs) > 0);
}

static void single_channels_are_the_same_bytes(void **state) {
    static const char *const outputs =
        "{\"name\": \"a\", \"format\": \"png\", \"channel\": \"R\", \"bitDepth\": 16},"
        "{\"name\": \"b\", \"format\": \"png\", \"channel\": \"G\"},"
        "{\"name\": \"c\", \"format\": \"jpeg\", \"channel\": \"B\"},"
        "{\"name\": \"d\", \"format\": \"webp\", \"channel\": \"G\"},"
        "{\"name\": \"e\", \"format\": \"tiff\", \"channel\": \"B\"}%s";
    for (int i = 0; i < 2; i++) {
        char *all = text_of(outputs, i ? ", {\"name\": \"f\", \"format\": \"png\", \"channel\": "
                                         "\"A\"}, {\"name\": \"g\", \"format\": \"tiff\", "
                                         "\"channel\": \"A\", \"bitDepth\": 16}"
                                       : "");
        same_both_ways(*state, backgrounds[i], all);
        free(all);
    }
}

/* Floats and codes of one film: neither may leave a trace in what the other starts from. */
static void outputs_do_not_disturb_each_other(void **state) {
    static const char *const outputs =
        "{\"name\": \"a\", \"format\": \"jpeg\"},"
        "{\"name\": \"b\", \"format\": \"exr\", \"layers\": [\"diffuse\"]},"
        "{\"name\": \"c\", \"format\": \"tiff\"},"
        "{\"name\": \"d\", \"format\": \"hdr\"},"
        "{\"name\": \"e\", \"format\": \"png\"}";
    for (int i = 0; i < 2; i++) same_both_ways(*state, backgrounds[i], outputs);
}

/* Tables of both depths from the start, as though many pictures had asked for them. */
static int make_tables(void **state) {
    make_engine(state);
    shd_color_config *color = ((shd_engine *)*state)->color;
    static const char *const views[][2] = {
        {"sRGB", "Standard"}, {"Rec.1886", "Standard"}, {"sRGB", "Raw"}};
    shd_color_lease *lease = NULL;
    bool ok = true;
    for (int i = 0; ok && i < 3; i++) {
        const shd_color_transform *made;
        ok = !shd_color_to_view(color, "lin_rec709", views[i][0], views[i][1], &lease, &made,
                                NULL) &&
             shd_color_codes_of(made, 255, SIZE_MAX, NULL, NULL) &&
             shd_color_codes_of(made, 65535, SIZE_MAX, NULL, NULL);
    }
    shd_color_lease_drop(lease);
    return !ok;
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_are_the_same_bytes),
        cmocka_unit_test(single_channels_are_the_same_bytes),
        cmocka_unit_test(outputs_do_not_disturb_each_other),
    };
    return cmocka_run_group_tests(tests, make_tables, drop_engine);
}
