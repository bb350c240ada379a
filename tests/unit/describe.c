/* The lists of what there is are JSON, complete, and true. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>
#include <jansson.h>

#include "shaded.h"

static int start(void **state) {
    shd_engine_options options = shd_engine_defaults();
    options.threads = 1;
    return (int)shd_engine_new(&options, (shd_engine **)state, NULL);
}

static int stop(void **state) {
    shd_engine_drop(*state);
    return 0;
}

static json_t *describe(shd_engine *engine, shd_topic topic) {
    char *text = NULL;
    shd_error error;
    assert_int_equal(shd_engine_describe(engine, topic, &text, &error), SHD_OK);
    json_t *value = json_loads(text, 0, NULL);
    free(text);
    assert_non_null(value);
    return value;
}

/* Takes `document`. */
static void assert_read(shd_engine *engine, json_t *document, bool accepted) {
    char *text = json_dumps(document, 0);
    shd_request *request;
    assert_int_equal(shd_request_new(engine, &request, NULL), SHD_OK);
    if (accepted != !shd_request_read(request, text, strlen(text), SHD_PNG)) {
        const shd_problem *problem = &shd_request_report(request)->errors[0];
        if (accepted) fail_msg("%s\n%s: %s", text, problem->pointer, problem->detail);
        fail_msg("%s\naccepted", text);
    }
    shd_request_drop(request);
    free(text);
    json_decref(document);
}

static void assert_accepted(shd_engine *engine, json_t *document) {
    assert_read(engine, document, true);
}

/* Adds the members' defaults to `object`. */
static void set_defaults(json_t *object, const json_t *members) {
    size_t i;
    json_t *member;
    json_array_foreach(members, i, member) {
        json_t *initial = json_object_get(member, "default");
        assert_false(json_boolean_value(json_object_get(member, "required")) && initial);
        assert_non_null(json_object_get(member, "description"));
        if (initial)
            json_object_set(object, json_string_value(json_object_get(member, "name")), initial);
    }
}

static void every_shape_is_accepted_with_the_members_that_it_requires(void **state) {
    json_t *list = describe(*state, SHD_TOPIC_SHAPES);
    size_t i;
    json_t *shape;
    json_array_foreach(json_object_get(list, "shapes"), i, shape) {
        json_t *object = json_pack("{sO}", "type", json_object_get(shape, "type"));
        set_defaults(object, json_object_get(shape, "members"));
        set_defaults(object, json_object_get(list, "common"));
        if (!strcmp(json_string_value(json_object_get(object, "type")), "mesh")) {
            json_object_set_new(object, "positions",
                                json_pack("[iiiiiiiii]", 0, 0, 0, 1, 0, 0, 0, 1, 0));
        }
        assert_accepted(*state, json_pack("{s[O]}", "objects", object));
        size_t k;
        json_t *member;
        json_array_foreach(json_object_get(shape, "members"), k, member) {
            json_t *without = json_copy(object);
            json_object_del(without, json_string_value(json_object_get(member, "name")));
            assert_read(*state, json_pack("{s[o]}", "objects", without),
                        !json_boolean_value(json_object_get(member, "required")));
        }
        json_decref(object);
    }
    assert_int_equal(i, 10);
    json_decref(list);
}

static void described_defaults_are_the_readers_own(void **state) {
    /* The entity tag tells a document's meaning apart, not its spelling, so defaults are compared
     * by their pictures. */
    json_t *list = describe(*state, SHD_TOPIC_SHAPES);
    size_t i;
    json_t *shape;
    json_array_foreach(json_object_get(list, "shapes"), i, shape) {
        const char *type = json_string_value(json_object_get(shape, "type"));
        if (!strcmp(type, "mesh")) continue;
        unsigned char *pictures[2];
        size_t sizes[2];
        for (int with = 0; with < 2; with++) {
            json_t *object = json_pack("{ss}", "type", type);
            if (with) {
                set_defaults(object, json_object_get(shape, "members"));
                set_defaults(object, json_object_get(list, "common"));
            }
            json_t *document =
                json_pack("{s[o] s{si si si} s{s[fff]}}", "objects", object, "image", "width", 32,
                          "height", 32, "samples", 1, "camera", "position", 3.0, 2.0, 3.0);
            char *text = json_dumps(document, 0);
            json_decref(document);
            shd_request *request;
            assert_int_equal(shd_request_new(*state, &request, NULL), SHD_OK);
            assert_int_equal(shd_request_read(request, text, strlen(text), SHD_PNG), SHD_OK);
            assert_int_equal(shd_request_render(request, NULL, NULL), SHD_OK);
            size_t count;
            sizes[with] = shd_request_pictures(request, &count)[0].size;
            pictures[with] = shd_request_take(request, 0);
            shd_request_drop(request);
            free(text);
        }
        assert_int_equal(sizes[0], sizes[1]);
        assert_memory_equal(pictures[0], pictures[1], sizes[0]);
        free(pictures[0]);
        free(pictures[1]);
    }
    json_decref(list);
}

static void every_material_is_a_preset(void **state) {
    json_t *list = describe(*state, SHD_TOPIC_MATERIALS);
    json_t *materials = json_object_get(list, "materials");
    assert_true(json_array_size(materials) >= 20);
    size_t i;
    json_t *material;
    json_array_foreach(materials, i, material) {
        assert_int_equal(json_array_size(json_object_get(material, "diffuse")), 3);
        assert_true(json_is_number(json_object_get(material, "shininess")));
        assert_accepted(*state, json_pack("{s[{ss s{sO}}]}", "objects", "type", "sphere",
                                          "material", "preset", json_object_get(material, "name")));
    }
    json_decref(list);
}

static void every_space_and_view_is_accepted_as_output(void **state) {
    json_t *list = describe(*state, SHD_TOPIC_COLORSPACES);
    size_t i, k;
    json_t *space, *display, *view;
    json_array_foreach(json_object_get(list, "spaces"), i, space) {
        assert_int_equal(json_array_size(json_object_get(space, "channels")), 3);
        assert_accepted(*state, json_pack("{s[{ss}] s{sO}}", "objects", "type", "sphere", "output",
                                          "colorSpace", json_object_get(space, "name")));
    }
    assert_true(i > 8);
    json_array_foreach(json_object_get(list, "displays"), i, display) {
        json_array_foreach(json_object_get(display, "views"), k, view) {
            assert_accepted(*state,
                            json_pack("{s[{ss}] s{sO sO}}", "objects", "type", "sphere", "output",
                                      "display", json_object_get(display, "name"), "view", view));
        }
    }
    assert_int_equal(i, 8);
    json_t *defaults = json_object_get(list, "defaults");
    assert_string_equal(json_string_value(json_object_get(defaults, "colorSpace")), "lin_rec709");
    assert_string_equal(json_string_value(json_object_get(defaults, "display")), "sRGB");
    assert_string_equal(json_string_value(json_object_get(defaults, "view")), "Standard");
    json_decref(list);
}

static void version_names_what_it_is_made_of(void **state) {
    json_t *version = describe(*state, SHD_TOPIC_VERSION);
    assert_string_equal(json_string_value(json_object_get(version, "name")), "shaded");
    assert_string_equal(json_string_value(json_object_get(version, "version")), shd_version());
    assert_true(json_string_length(json_object_get(version, "compiler")) > 4);
    assert_true(json_string_length(json_object_get(version, "colorConfig")) >= 8);
    json_t *kernels = json_object_get(version, "kernels");
    assert_int_equal(json_array_size(kernels), 2);
    assert_string_equal(json_string_value(json_array_get(kernels, 0)), "standard f32");
    assert_string_equal(json_string_value(json_array_get(kernels, 1)), "exact f64");
    json_t *libraries = json_object_get(version, "libraries");
    assert_non_null(json_object_get(libraries, "OpenColorIO"));
    assert_non_null(json_object_get(libraries, "jansson"));
    const char *name;
    json_t *number;
    json_object_foreach(libraries, name, number) {
        assert_true(json_string_length(number) > 0);
    }
    json_decref(version);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_shape_is_accepted_with_the_members_that_it_requires),
        cmocka_unit_test(described_defaults_are_the_readers_own),
        cmocka_unit_test(every_material_is_a_preset),
        cmocka_unit_test(every_space_and_view_is_accepted_as_output),
        cmocka_unit_test(version_names_what_it_is_made_of),
    };
    return cmocka_run_group_tests(tests, start, stop);
}
