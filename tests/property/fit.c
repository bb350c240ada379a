/* Pictures of scenes, as 8-bit files, tell the coefficients that they were made with; and where
 * their light does not, that is said. */
#include <jansson.h>
#include <unistd.h>

#include "property/film_of.h"

static char photo[] = "/tmp/shaded-fit-XXXXXX";

/* Renders a scene into the out: WebP without loss. */
static void take_photo(shd_engine *engine, const char *json) {
    shd_request *request = read_scene(engine, json);
    shd_error error;
    size_t count;
    assert_int_equal(shd_request_render(request, NULL, &error), SHD_OK);
    const shd_picture *picture = shd_request_pictures(request, &count);
    FILE *out = fopen(photo, "wb");
    assert_non_null(out);
    assert_int_equal(fwrite(picture->data, 1, picture->size, out), picture->size);
    assert_int_equal(fclose(out), 0);
    shd_request_drop(request);
}

static shd_status ask(shd_engine *engine, const char *json, const char *object, json_t **out,
                      shd_error *error) {
    shd_request *request = read_scene(engine, json);
    char *text = NULL;
    const shd_status status = shd_request_fit(request, photo, SHD_WEBP, object, NULL, &text, error);
    if (status == SHD_OK) *out = json_loads(text, 0, NULL);
    free(text);
    shd_request_drop(request);
    return status;
}

static json_t *fit(shd_engine *engine, const char *json, const char *object) {
    json_t *told = NULL;
    shd_error error;
    take_photo(engine, json);
    if (ask(engine, json, object, &told, &error)) fail_msg("%s: %s", error.path, error.text);
    assert_non_null(told);
    return told;
}

static double number(const json_t *told, const char *term, const char *which, size_t channel) {
    const json_t *value = json_object_get(json_object_get(told, term), which);
    return json_number_value(json_is_array(value) ? json_array_get(value, channel) : value);
}

/* What is told of a term that is not known, or NULL. */
static const char *reason(const json_t *told, const char *term) {
    const json_t *list = json_object_get(told, "notIdentifiable");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *doubt = json_array_get(list, i);
        if (!strcmp(json_string_value(json_object_get(doubt, "term")), term))
            return json_string_value(json_object_get(doubt, "reason"));
    }
    return NULL;
}

#define WEBP "\"output\": {\"format\": \"webp\", \"quality\": 100%s}"

static const double kd[3] = {0.6, 0.3, 0.15}, ks[3] = {0.25, 0.3, 0.2};

#define MATERIAL                                                                                   \
    "\"ambient\": [0.3, 0.2, 0.4], \"diffuse\": [0.6, 0.3, 0.15], \"specular\": [0.25, 0.3, 0.2]"

/* `light` is within `by` of what it was, and of five of its own deviations where these are more. */
static void near(const json_t *told, const char *term, const double expected[3], double by) {
    for (size_t c = 0; c < 3; c++) {
        const double deviation = number(told, term, "deviation", c);
        assert_below(fabs(number(told, term, "value", c) - expected[c]), fmax(by, 5 * deviation));
        assert_below(deviation, 2 * by);
    }
}

/* The constant is ka (0.2, 0.15, 0.1). */
static void near_all(const json_t *told, double by, double shininess) {
    static const double constant[3] = {0.06, 0.03, 0.04};
    near(told, "constant", constant, by);
    near(told, "diffuse", kd, by);
    near(told, "specular", ks, by);
    const double n = number(told, "shininess", "value", 0);
    assert_below(fabs(n - shininess),
                 fmax(0.02 * shininess + 0.01, 5 * number(told, "shininess", "deviation", 0)));
    assert_int_equal(json_array_size(json_object_get(told, "notIdentifiable")), 0);
}

/* "camera", "lights" and "objects" of the parts; 96 x 72 pixels. */
static char *scene_of(const char *camera, const char *lights, const char *objects,
                      const char *output) {
    char *out = text_of(WEBP, output), *all;
    all = text_of("{\"image\": {\"width\": 96, \"height\": 72}, \"ambient\": [0.2, 0.15, 0.1], %s%s"
                  "\"lights\": [%s], \"objects\": [%s], %s}",
                  camera, *camera ? ", " : "", lights, objects, out);
    free(out);
    return all;
}

static const char two_lights[] =
    "{\"type\": \"point\", \"position\": [3, 3, 3], \"color\": [0.8, 0.7, 0.6]}, "
    "{\"type\": \"directional\", \"direction\": [1, -0.5, -1], \"color\": [0.15, 0.2, 0.25]}";

static void a_picture_tells_what_it_was_made_with(void **state) {
    /* Of 256 x 192 pixels, everything to 1e-3 (docs/fit.md); the deviations are told. */
    char *scene = text_of("{\"image\": {\"width\": 256, \"height\": 192}, \"ambient\": [0.2, 0.15, "
                          "0.1], \"lights\": [%s], \"objects\": [{\"type\": \"sphere\", "
                          "\"material\": {" MATERIAL ", \"shininess\": 20}}], " WEBP "}",
                          two_lights, "");
    json_t *told = fit(*state, scene, NULL);
    static const double constant[3] = {0.06, 0.03, 0.04};
    for (size_t c = 0; c < 3; c++) {
        assert_below(fabs(number(told, "constant", "value", c) - constant[c]), 1e-3);
        assert_below(fabs(number(told, "diffuse", "value", c) - kd[c]), 1e-3);
        assert_below(fabs(number(told, "specular", "value", c) - ks[c]), 1e-3);
        assert_below(number(told, "specular", "deviation", c), 1e-3);
    }
    assert_below(fabs(number(told, "shininess", "value", 0) - 20), 0.1);
    json_decref(told);
    free(scene);
}

static void any_view_and_model_do(void **state) {
    static const struct {
        const char *camera, *lights, *object;
        double shininess;
        const char *output;
    } cases[] = {
        {"", two_lights, "\"type\": \"sphere\", \"material\": {\"shininess\": 0, ", 0, ""},
        {"", two_lights, "\"type\": \"sphere\", \"material\": {\"shininess\": 1, ", 1,
         ", \"display\": \"Display P3\""},
        {"\"camera\": {\"type\": \"orthographic\", \"height\": 3, \"position\": [0, 0, 4]}",
         two_lights, "\"type\": \"torus\", \"material\": {\"shininess\": 12, ", 12,
         ", \"exposure\": -0.5"},
        /* The light is at the eye. */
        {"", "{\"type\": \"point\", \"position\": [0, 0, 4], \"color\": 0.9}",
         "\"type\": \"sphere\", \"material\": {\"model\": \"blinn-phong\", \"shininess\": 30, ", 30,
         ""},
        {"", two_lights,
         "\"type\": \"teapot\", \"material\": {\"model\": \"phong-normalized\", \"shininess\": "
         "15, ",
         15, ", \"gamma\": 1.5"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *object = text_of("{%s" MATERIAL "}}", cases[i].object),
             *scene = scene_of(cases[i].camera, cases[i].lights, object, cases[i].output);
        json_t *told = fit(*state, scene, NULL);
        near_all(told, 2e-3, cases[i].shininess);
        json_decref(told);
        free(scene);
        free(object);
    }
}

static void clipped_highlights_are_left_out(void **state) {
    char *scene =
        scene_of("", "{\"type\": \"point\", \"position\": [3, 3, 3], \"color\": 1.8}",
                 "{\"type\": \"sphere\", \"material\": {" MATERIAL ", \"shininess\": 10}}", "");
    json_t *told = fit(*state, scene, NULL);
    assert_true(json_integer_value(json_object_get(json_object_get(told, "pixels"), "clipped")) >
                50);
    near_all(told, 2e-3, 10);
    json_decref(told);
    free(scene);
}

/* Each of two objects has its own; what is known of the other's does not matter. */
static void objects_are_fitted_apart(void **state) {
    const char *objects = "{\"type\": \"sphere\", \"name\": \"ball\", \"material\": {" MATERIAL
                          ", \"shininess\": 20}}, {\"type\": \"plane\", \"name\": \"floor\", "
                          "\"transform\": {\"translate\": [0, -1, 0]}, \"material\": {\"diffuse\": "
                          "[0.2, 0.5, 0.7]}}";
    char *scene = scene_of("", two_lights, objects, "");
    static const double floor_kd[3] = {0.2, 0.5, 0.7};
    static const char *const floors[] = {"floor", "1"};
    json_t *told = fit(*state, scene, "ball");
    near_all(told, 2e-3, 20);
    json_decref(told);
    for (int i = 0; i < 2; i++) {
        shd_error error;
        assert_int_equal(ask(*state, scene, floors[i], &told, &error), SHD_OK);
        near(told, "diffuse", floor_kd, 1e-3);
        assert_non_null(reason(told, "shininess"));
        assert_non_null(strstr(reason(told, "specular"), "no highlight"));
        assert_true(number(told, "specular", "value", 0) == 0);
        json_decref(told);
    }
    free(scene);
}

static void light_that_tells_nothing_is_named(void **state) {
    char *scene = scene_of("\"camera\": {\"type\": \"orthographic\", \"height\": 1, \"position\": "
                           "[0, 0, 4]}",
                           "{\"type\": \"directional\", \"direction\": [0, 0, -1], \"color\": [1, "
                           "1, 0]}",
                           "{\"type\": \"box\", \"size\": [9, 9, 1], \"material\": {" MATERIAL
                           ", \"shininess\": 20}}",
                           "");
    json_t *told = fit(*state, scene, NULL);
    assert_non_null(strstr(reason(told, "constant"), "is the same on all pixels"));
    assert_non_null(strstr(reason(told, "diffuse"), "is the same on all pixels"));
    assert_non_null(strstr(reason(told, "specular"), "the highlight is the same"));
    assert_non_null(reason(told, "shininess"));
    /* Blue has no light but ambient. */
    assert_below(fabs(number(told, "constant", "value", 2) - 0.04), 1e-3);
    assert_true(number(told, "constant", "deviation", 2) > 0);
    json_decref(told);
    free(scene);
}

static void what_cannot_be_fitted_is_refused(void **state) {
    char *scene = scene_of("", two_lights, "{\"type\": \"sphere\", \"name\": \"ball\"}", "");
    static const struct {
        const char *objects, *output, *name, *path, *words;
    } cases[] = {
        {"{\"type\": \"sphere\", \"name\": \"ball\"}", "", "bell", "/object", "did you mean"},
        {"{\"type\": \"sphere\", \"name\": \"ball\"}", "", "1", "/object", "no object"},
        {"", "", NULL, "/object", "no object"},
        {"{\"type\": \"sphere\"}, {\"type\": \"box\", \"material\": {\"diffuse\": 0.1}}", "", NULL,
         "/object", "several materials"},
        {"{\"type\": \"sphere\", \"material\": {\"model\": \"oren-nayar\"}}", "", NULL, "/object",
         "oren-nayar"},
        {"{\"type\": \"sphere\", \"transform\": {\"translate\": [0, 0, 9]}}", "", NULL, "/object",
         "no pixel"},
        {"{\"type\": \"sphere\"}", ", \"channel\": \"R\"", NULL, "/output/channel", "colors"},
        {"{\"type\": \"sphere\"}", ", \"colorSpace\": \"HSV\"", NULL, "/output", "red, green"},
    };
    take_photo(*state, scene);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        json_t *told;
        shd_error error;
        char *other = scene_of("", two_lights, cases[i].objects, cases[i].output);
        assert_int_equal(ask(*state, other, cases[i].name, &told, &error), SHD_SCENE);
        assert_string_equal(error.path, cases[i].path);
        if (!strstr(error.text, cases[i].words)) fail_msg("%s", error.text);
        free(other);
    }
    json_t *told;
    shd_error error;
    assert_int_equal(ask(*state, "{\"objects\": [{\"type\": \"sphere\"}]}", NULL, &told, &error),
                     SHD_SCENE);
    assert_string_equal(error.path, "");
    assert_string_equal(error.text, "the picture has 96 x 72 pixels, not 512 x 512");
    free(scene);
}

static int begin(void **state) {
    const int made = mkstemp(photo);
    return made < 0 || close(made) || make_engine(state);
}

static int end(void **state) {
    unlink(photo);
    return drop_engine(state);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_picture_tells_what_it_was_made_with),
        cmocka_unit_test(any_view_and_model_do),
        cmocka_unit_test(clipped_highlights_are_left_out),
        cmocka_unit_test(objects_are_fitted_apart),
        cmocka_unit_test(light_that_tells_nothing_is_named),
        cmocka_unit_test(what_cannot_be_fitted_is_refused),
    };
    return cmocka_run_group_tests(tests, begin, end);
}
