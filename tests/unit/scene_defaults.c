/* What a document does not say, and that saying it changes nothing. */
#include "unit/scene_support.h"

static void smallest_scene_has_every_default(void **state) {
    (void)state;
    reading r = read_scene("{'objects': [{'type': 'sphere'}]}");
    const shd_scene *s = r.scene;
    assert_int_equal(s->camera.projection, SHD_PERSPECTIVE);
    assert_vec(s->camera.position, 0, 0, 4);
    assert_vec(s->camera.right, 1, 0, 0);
    assert_vec(s->camera.up, 0, 1, 0);
    assert_vec(s->camera.back, 0, 0, 1);
    assert_float_equal(s->camera.fov, 40 * SHD_PI / 180, 1e-15);
    shd_raster raster = s->raster;
    assert_int_equal(raster.width, 512);
    assert_int_equal(raster.height, 512);
    assert_int_equal(raster.samples, 4);
    assert_true(raster.x == 0 && raster.y == 0 && raster.w == 512 && raster.h == 512);
    assert_rgb(s->ambient, 0, 0, 0);
    assert_rgb(s->background, 0, 0, 0);
    assert_false(s->transparent);
    assert_ptr_equal(s->working_space, scene_catalog.scene_linear);
    assert_int_equal(s->accuracy.tier, SHD_STANDARD);
    assert_false(s->accuracy.budget);
    assert_false(s->multipart);
    assert_int_equal(strlen(s->digest), 32);

    assert_int_equal(s->object_count, 1);
    const shd_object *sphere = s->objects;
    assert_int_equal(sphere->shape, SHD_SPHERE);
    assert_float_equal(sphere->radius, 1, 0);
    assert_int_equal(sphere->interpolation, SHD_PHONG);
    assert_int_equal(sphere->segments, 32);
    assert_vec(shd_transform(&sphere->transform, (shd_vec3){1, 2, 3}), 1, 2, 3);

    assert_int_equal(s->material_count, 1);
    const shd_material *m = &s->materials[sphere->material];
    assert_string_equal(m->name, "");
    assert_rgb(m->emissive, 0, 0, 0);
    assert_rgb(m->ambient, .8, .8, .8);
    assert_rgb(m->diffuse, .8, .8, .8);
    assert_int_equal(m->lobe_count, 1);
    assert_rgb(m->lobes[0].specular, 0, 0, 0);
    assert_float_equal(m->lobes[0].shininess, 32, 0);
    assert_false(m->front_only);

    assert_int_equal(s->output_count, 1);
    const shd_output *o = s->outputs;
    assert_null(o->name);
    assert_int_equal(o->format, SHD_PNG);
    assert_false(o->format_given);
    assert_string_equal(o->display, "sRGB");
    assert_string_equal(o->view, "Standard");
    assert_null(o->color_space);
    assert_int_equal(o->channel, -1);
    assert_int_equal(o->depth, SHD_U8);
    assert_int_equal(o->quality, 90);
    assert_int_equal(o->layer_count, 0);
    assert_int_equal(r.report.warning_count, 0);
    drop(&r);
}

static void absent_lights_are_one_along_the_view(void **state) {
    (void)state;
    reading r = read_scene(WITH("'camera': {'position': [5, 0, 0], 'target': [1, 0, 0]}"));
    assert_int_equal(r.scene->light_count, 1);
    const shd_light *light = r.scene->lights;
    assert_int_equal(light->type, SHD_LIGHT_DIRECTIONAL);
    assert_vec(light->direction, -1, 0, 0);
    assert_rgb(light->color, 1, 1, 1);
    assert_rgb(light->ambient, 0, 0, 0);
    assert_rgb(light->attenuation, 1, 0, 0);
    drop(&r);
}

/* The catalog of tests leaves the numbers of YIQ and HSV as they are. */
static void one_number_is_grey_in_every_space(void **state) {
    (void)state;
    reading r = read_scene(WITH("'colorSpace': 'YIQ', 'ambient': 0.5"));
    assert_rgb(r.scene->ambient, .5, 0, 0);
    assert_rgb(r.scene->lights[0].color, 1, 0, 0);
    assert_rgb(r.scene->materials[0].diffuse, (float).8, 0, 0);
    drop(&r);
    r = read_scene(WITH("'colorSpace': 'HSV', 'ambient': 0.5"));
    assert_rgb(r.scene->ambient, 0, 0, .5);
    assert_rgb(r.scene->lights[0].color, 0, 0, 1);
    drop(&r);
    r = read_scene(WITH("'colorSpace': 'wide', 'ambient': 0.5"));
    assert_rgb(r.scene->ambient, 1, 1, 1);
    drop(&r);
}

static void empty_lights_are_none(void **state) {
    (void)state;
    reading r = read_scene(WITH("'lights': []"));
    assert_int_equal(r.scene->light_count, 0);
    drop(&r);
}

static void every_light_has_its_defaults(void **state) {
    (void)state;
    reading r = read_scene(WITH("'lights': [{'type': 'ambient'}, {'type': 'directional'},"
                                "{'type': 'point'}, {'type': 'spot'}]"));
    const shd_light *l = r.scene->lights;
    assert_int_equal(l[0].type, SHD_LIGHT_AMBIENT);
    assert_rgb(l[0].ambient, 1, 1, 1);
    assert_rgb(l[0].color, 0, 0, 0);
    assert_int_equal(l[1].type, SHD_LIGHT_DIRECTIONAL);
    assert_vec(l[1].direction, 0, -sqrt(.5), -sqrt(.5));
    assert_int_equal(l[2].type, SHD_LIGHT_POINT);
    assert_vec(l[2].position, 3, 3, 3);
    assert_int_equal(l[3].type, SHD_LIGHT_SPOT);
    assert_vec(l[3].position, 0, 4, 0);
    assert_vec(l[3].direction, 0, -1, 0);
    assert_float_equal(l[3].angle, SHD_PI / 6, 1e-15);
    assert_float_equal(l[3].penumbra, .2, 0);
    assert_float_equal(l[3].exponent, 0, 0);
    for (int i = 1; i < 4; i++) {
        assert_rgb(l[i].color, 1, 1, 1);
        assert_rgb(l[i].ambient, 0, 0, 0);
        assert_rgb(l[i].attenuation, 1, 0, 0);
        assert_float_equal(l[i].min_distance, 0, 0);
    }
    drop(&r);
}

static void every_shape_has_its_defaults(void **state) {
    (void)state;
    reading r =
        read_scene("{'objects': [{'type': 'sphere'}, {'type': 'plane'}, {'type': 'disc'},"
                   "{'type': 'box'}, {'type': 'cylinder'}, {'type': 'cone'},"
                   "{'type': 'torus'}, {'type': 'mesh', 'positions': [0,0,0,1,0,0,0,1,0]}]}");
    assert_int_equal(r.scene->object_count, SHD_SHAPE_COUNT);
    assert_int_equal(r.scene->material_count, 1);
    for (int i = 0; i < SHD_SHAPE_COUNT; i++) {
        const shd_object *o = &r.scene->objects[i];
        assert_int_equal(o->shape, i);
        assert_float_equal(o->radius, 1, 0);
        assert_float_equal(o->tube, .25, 0);
        assert_float_equal(o->height, 2, 0);
        assert_vec(o->size, 1, 1, 1);
        assert_true((o->mesh != NULL) == (i == SHD_MESH));
    }
    drop(&r);
}

static void orthographic_camera_sees_a_height_of_two(void **state) {
    (void)state;
    reading r = read_scene(WITH("'camera': {'type': 'orthographic'}"));
    assert_int_equal(r.scene->camera.projection, SHD_ORTHOGRAPHIC);
    assert_float_equal(r.scene->camera.height, 2, 0);
    drop(&r);
}

static void camera_frame_survives_extreme_coordinates(void **state) {
    (void)state;
    static const char *const scales[] = {"1e20", "1e-23", "1e300", "1.7e308"};
    for (int i = 0; i < 4; i++) {
        char text[256];
        snprintf(text, sizeof text,
                 WITH("'camera': {'position': [%s, 0, 0], 'target': [-%s, 0, 0],"
                      "'up': [0, 0, %s]}"),
                 scales[i], scales[i], scales[i]);
        reading r = read_scene(text);
        assert_vec(r.scene->camera.back, 1, 0, 0);
        assert_vec(r.scene->camera.up, 0, 0, 1);
        assert_vec(r.scene->camera.right, 0, 1, 0);
        drop(&r);
    }
}

static void camera_frame_is_orthonormal_for_a_slanted_up(void **state) {
    (void)state;
    reading r = read_scene(WITH("'camera': {'position': [3, 4, 5], 'target': [1, -1, 0],"
                                "'up': [0.3, 2, -0.1]}"));
    const shd_camera *c = &r.scene->camera;
    assert_float_equal(shd_dot(c->right, c->up), 0, 1e-15);
    assert_float_equal(shd_dot(c->right, c->back), 0, 1e-15);
    assert_float_equal(shd_dot(c->up, c->back), 0, 1e-15);
    assert_float_equal(shd_length(c->up), 1, 1e-15);
    assert_float_equal(shd_length(c->right), 1, 1e-15);
    shd_vec3 across = shd_cross(c->right, c->up);
    assert_vec(across, c->back.x, c->back.y, c->back.z);
    drop(&r);
}

static void image_and_region_are_read(void **state) {
    (void)state;
    reading r = read_scene(
        WITH("'image': {'width': 64.0, 'height': 4e1, 'samples': 16, 'region': [10, 20, 54, 20]}"));
    shd_raster raster = r.scene->raster;
    assert_int_equal(raster.width, 64);
    assert_int_equal(raster.height, 40);
    assert_int_equal(raster.samples, 16);
    assert_true(raster.x == 10 && raster.y == 20 && raster.w == 54 && raster.h == 20);
    drop(&r);
}

static void accuracy_is_a_tier_or_a_budget(void **state) {
    (void)state;
    reading r = read_scene(WITH("'accuracy': {'tier': 'exact'}"));
    assert_int_equal(r.scene->accuracy.tier, SHD_EXACT);
    drop(&r);
    r = read_scene(WITH("'accuracy': {'maxError': 0.5}"));
    assert_true(r.scene->accuracy.budget);
    assert_float_equal(r.scene->accuracy.max_error, .5, 0);
    assert_int_equal(r.scene->accuracy.metric, SHD_DELTA_E_2000);
    drop(&r);
    r = read_scene(WITH("'accuracy': {'maxError': 2, 'metric': 'code'}"));
    assert_int_equal(r.scene->accuracy.metric, SHD_CODE);
    drop(&r);
}

static void null_background_is_transparent(void **state) {
    (void)state;
    reading r = read_scene(WITH("'background': null, 'ambient': [0.1, 0.2, 0.3]"));
    assert_true(r.scene->transparent);
    assert_rgb(r.scene->ambient, .1, .2, .3);
    drop(&r);
}

static void a_background_has_an_alpha(void **state) {
    (void)state;
    static const struct {
        const char *document;
        bool transparent;
        double rgb, alpha;
    } cases[] = {
        {WITH("'background': [4, 4, 4, 1]"), false, 4, 0},
        {WITH("'background': [4, 4, 4, 0.25]"), true, 4, .25},
        {WITH("'background': [4, 4, 4, 0]"), true, 0, 0},
        {WITH("'background': '#ffffff33'"), true, 1, .2},
        {WITH("'background': 'rgb(51 51 51 / 25%)'"), true, .04, .25}, /* sRGB is a square here */
        {WITH("'background': 'transparent'"), true, 0, 0},
        {WITH("'background': 'white'"), false, 1, 0},
        /* Where no output holds alpha, it is laid over the mattes if these are the same. */
        {WITH("'background': [4, 4, 4, 0.25], 'output': {'format': 'jpeg', 'matte': 8}"), false, 7,
         0},
        {WITH("'background': [4, 4, 4, 0.25], 'output': {'format': 'jpeg'}"), false, 1, 0},
        {WITH("'background': null, 'output': {'format': 'jpeg', 'matte': 8}"), false, 8, 0},
        {WITH("'background': null, 'output': {'format': 'jpeg'}"), true, 0, 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        reading r = read_scene(cases[i].document);
        assert_int_equal(r.scene->transparent, cases[i].transparent);
        assert_rgb(r.scene->background, cases[i].rgb, cases[i].rgb, cases[i].rgb);
        assert_float_equal(r.scene->background_alpha, cases[i].alpha, 0);
        drop(&r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(smallest_scene_has_every_default),
        cmocka_unit_test(absent_lights_are_one_along_the_view),
        cmocka_unit_test(one_number_is_grey_in_every_space),
        cmocka_unit_test(empty_lights_are_none),
        cmocka_unit_test(every_light_has_its_defaults),
        cmocka_unit_test(every_shape_has_its_defaults),
        cmocka_unit_test(orthographic_camera_sees_a_height_of_two),
        cmocka_unit_test(camera_frame_survives_extreme_coordinates),
        cmocka_unit_test(camera_frame_is_orthonormal_for_a_slanted_up),
        cmocka_unit_test(image_and_region_are_read),
        cmocka_unit_test(accuracy_is_a_tier_or_a_budget),
        cmocka_unit_test(null_background_is_transparent),
        cmocka_unit_test(a_background_has_an_alpha),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
