/* Lights in both frames and in homogeneous form, and colors in every spelling. */
#include "unit/scene_support.h"

static void homogeneous_position_at_infinity_is_directional(void **state) {
    (void)state;
    reading r = read_scene(LIGHT("'position': [0, 2, 0, 0], 'attenuation': [0, 0, 1],"
                                 "'minDistance': 3"));
    assert_int_equal(r.scene->lights->type, SHD_LIGHT_DIRECTIONAL);
    assert_vec(r.scene->lights->direction, 0, -1, 0);
    assert_rgb(r.scene->lights->attenuation, 1, 0, 0);
    assert_float_equal(r.scene->lights->min_distance, 0, 0);
    drop(&r);
    r = read_scene(LIGHT("'type': 'directional', 'position': [0, 0, -3, 0]"));
    assert_vec(r.scene->lights->direction, 0, 0, 1);
    drop(&r);
}

static void homogeneous_position_is_divided_by_w(void **state) {
    (void)state;
    reading r = read_scene(WITH("'lights': [{'position': [2, 4, 6, 2], 'attenuation': [0, 0, 1]},"
                                "{'position': [2, 4, 6, -2]},"
                                "{'type': 'spot', 'position': [1, 2, 3, 0.5]}]"));
    assert_int_equal(r.scene->lights[0].type, SHD_LIGHT_POINT);
    assert_vec(r.scene->lights[0].position, 1, 2, 3);
    assert_rgb(r.scene->lights[0].attenuation, 0, 0, 1);
    assert_vec(r.scene->lights[1].position, -1, -2, -3);
    assert_int_equal(r.scene->lights[2].type, SHD_LIGHT_SPOT);
    assert_vec(r.scene->lights[2].position, 2, 4, 6);
    drop(&r);
}

/* The camera looks along +x: its right is +z, its up +y, its back -x. */
#define FROM_THE_SIDE "'camera': {'position': [-5, 1, 0], 'target': [0, 1, 0]}"

static void camera_lights_are_carried_over_to_the_world(void **state) {
    (void)state;
    reading r = read_scene(
        WITH(FROM_THE_SIDE
             ", 'lights': [{'type': 'point', 'position': [1, 2, 3], 'frame': 'camera'},"
             "{'type': 'spot', 'position': [0, 0, 0], 'direction': [0, 0, -9], 'frame': 'camera'},"
             "{'type': 'directional', 'direction': [1, 0, 0], 'frame': 'camera'},"
             "{'position': [0, 0, 1, 0], 'frame': 'camera'},"
             "{'position': [2, 0, 0, 2], 'frame': 'camera'},"
             "{'type': 'point', 'position': [1, 2, 3], 'frame': 'world'}]"));
    const shd_light *l = r.scene->lights;
    assert_vec(l[0].position, -8, 3, 1);
    assert_vec(l[1].position, -5, 1, 0);
    assert_vec(l[1].direction, 1, 0, 0);
    assert_vec(l[2].direction, 0, 0, 1);
    assert_vec(l[3].direction, 1, 0, 0);
    assert_vec(l[4].position, -5, 1, 1);
    assert_vec(l[5].position, 1, 2, 3);
    drop(&r);
}

static void directions_of_any_length_become_unit(void **state) {
    (void)state;
    reading r =
        read_scene(WITH("'lights': [{'type': 'directional', 'direction': [0, 3e-25, 4e-25]},"
                        "{'type': 'directional', 'direction': [3e25, 0, 4e25]},"
                        "{'type': 'spot', 'direction': [0, 1e300, 0]}]"));
    assert_vec(r.scene->lights[0].direction, 0, .6, .8);
    assert_vec(r.scene->lights[1].direction, .6, 0, .8);
    assert_vec(r.scene->lights[2].direction, 0, 1, 0);
    drop(&r);
}

static void intensity_multiplies_color_but_not_ambient(void **state) {
    (void)state;
    reading r = read_scene(
        WITH("'lights': [{'type': 'point', 'color': [1, 0.5, 0], 'intensity': 4, 'ambient': 0.25},"
             "{'type': 'ambient', 'color': [1, 0.5, 0], 'intensity': 4}]"));
    assert_rgb(r.scene->lights[0].color, 4, 2, 0);
    assert_rgb(r.scene->lights[0].ambient, .25, .25, .25);
    assert_rgb(r.scene->lights[1].color, 0, 0, 0);
    assert_rgb(r.scene->lights[1].ambient, 4, 2, 0);
    drop(&r);
}

static void negative_intensity_gives_a_warning(void **state) {
    (void)state;
    reading r = read_scene(LIGHT("'type': 'point', 'intensity': -1"));
    assert_rgb(r.scene->lights->color, -1, -1, -1);
    assert_true(has_warning(&r, "/lights/0", "negative"));
    drop(&r);
}

static void light_of_full_sphere_is_allowed(void **state) {
    (void)state;
    reading r = read_scene(LIGHT("'type': 'spot', 'angle': 180, 'penumbra': 1, 'exponent': 2.5"));
    assert_float_equal(r.scene->lights->angle, SHD_PI, 1e-15);
    assert_float_equal(r.scene->lights->penumbra, 1, 0);
    assert_float_equal(r.scene->lights->exponent, 2.5, 0);
    drop(&r);
}

/* ---- Colors ---- */

static void colors_have_every_spelling(void **state) {
    (void)state;
    static const struct {
        const char *text;
        double rgb[3];
    } cases[] = {
        {"0.25", {.25, .25, .25}},
        {"[0.1, 0.2, 0.3]", {.1, .2, .3}},
        {"'#fff'", {1, 1, 1}},
        {"'#000000'", {0, 0, 0}},
        {"'#F0a'", {1, 0, (float)((170 / 255.) * (170 / 255.))}},
        {"'#ff00aa'", {1, 0, (float)((170 / 255.) * (170 / 255.))}},
        {"{'space': 'sRGB', 'value': [0.5, 1, 0]}", {.25, 1, 0}},
        {"{'space': 'wide', 'value': [0.5, 1, -1]}", {1, 2, -2}},
        {"{'space': 'lin_rec709', 'value': [0.1, 5, -1]}", {.1, 5, -1}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char text[256];
        snprintf(text, sizeof text, WITH("'ambient': %s"), cases[i].text);
        reading r = read_scene(text);
        assert_rgb(r.scene->ambient, cases[i].rgb[0], cases[i].rgb[1], cases[i].rgb[2]);
        drop(&r);
    }
}

static void numbers_of_the_working_space_keep_every_bit(void **state) {
    (void)state;
    reading r = read_scene(WITH("'ambient': [0.1, 1e-300, 123456789.123456789]"));
    assert_true(r.scene->ambient[0] == 0.1 && r.scene->ambient[1] == 1e-300 &&
                r.scene->ambient[2] == 123456789.123456789);
    drop(&r);
}

static void plain_numbers_are_of_the_color_space(void **state) {
    (void)state;
    reading r = read_scene(WITH("'ambient': 0.5, 'colorSpace': 'wide', 'background': '#fff'"));
    assert_rgb(r.scene->ambient, 1, 1, 1);
    assert_rgb(r.scene->background, 1, 1, 1);
    assert_rgb(r.scene->materials[0].diffuse, (float)1.6, (float)1.6, (float)1.6);
    drop(&r);
}

static void colors_arrive_in_the_working_space(void **state) {
    (void)state;
    reading r = read_scene("{'workingSpace': 'wide', 'ambient': 0.5, 'background': '#fff',"
                           "'objects': [{'type': 'sphere', 'material': 'chrome'}]}");
    assert_string_equal(r.scene->working_space->name, "wide");
    assert_rgb(r.scene->ambient, .25, .25, .25);
    assert_rgb(r.scene->background, .5, .5, .5);
    /* half of chrome's published 0.4, decoded */
    const float grey = (float)(0.13286832 / 2);
    for (int c = 0; c < 3; c++) assert_float_equal(r.scene->materials[0].diffuse[c], grey, 1e-8);
    assert_rgb(r.scene->lights[0].color, .5, .5, .5);
    drop(&r);
}

static void a_default_written_out_changes_nothing(void **state) {
    (void)state;
    reading a = read_scene("{'colorSpace': 'wide', 'objects': [{'type': 'sphere'}],"
                           "'lights': [{'type': 'point'}]}");
    reading b = read_scene("{'colorSpace': 'wide',"
                           "'objects': [{'type': 'sphere', 'material': {'diffuse': 0.8}}],"
                           "'lights': [{'type': 'point', 'color': [1, 1, 1]}]}");
    assert_memory_equal(a.scene->materials[0].diffuse, b.scene->materials[0].diffuse, 24);
    assert_memory_equal(a.scene->lights[0].color, b.scene->lights[0].color, 24);
    drop(&a);
    drop(&b);
}

static void a_conversion_that_fails_is_an_error_at_the_color(void **state) {
    (void)state;
    reading r = read_with(WITH("'ambient': {'space': 'raw', 'value': [1, 1, 1]}"), &scene_limits);
    assert_true(has_error(&r, "/ambient", "raw has no meaning"));
    drop(&r);
    r = read_with(WITH("'ambient': {'space': 'wide', 'value': [1e300, 1, 1]}"), &scene_limits);
    assert_true(has_error(&r, "/ambient", "too large"));
    drop(&r);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(homogeneous_position_at_infinity_is_directional),
        cmocka_unit_test(homogeneous_position_is_divided_by_w),
        cmocka_unit_test(camera_lights_are_carried_over_to_the_world),
        cmocka_unit_test(directions_of_any_length_become_unit),
        cmocka_unit_test(intensity_multiplies_color_but_not_ambient),
        cmocka_unit_test(negative_intensity_gives_a_warning),
        cmocka_unit_test(light_of_full_sphere_is_allowed),
        cmocka_unit_test(colors_have_every_spelling),
        cmocka_unit_test(numbers_of_the_working_space_keep_every_bit),
        cmocka_unit_test(plain_numbers_are_of_the_color_space),
        cmocka_unit_test(colors_arrive_in_the_working_space),
        cmocka_unit_test(a_default_written_out_changes_nothing),
        cmocka_unit_test(a_conversion_that_fails_is_an_error_at_the_color),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
