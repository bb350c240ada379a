/* Objects, their transforms, meshes, materials and the library. */
#include "unit/scene_support.h"

static shd_vec3 apply(const char *transform, double x, double y, double z) {
    char text[512];
    snprintf(text, sizeof text, OBJECT("'type': 'sphere', 'transform': {%s}"), transform);
    reading r = read_scene(text);
    shd_vec3 out = shd_transform(&r.scene->objects->transform, (shd_vec3){x, y, z});
    drop(&r);
    return out;
}

static void transform_scales_then_rotates_then_translates(void **state) {
    (void)state;
    assert_vec(apply("'scale': 2", 1, 2, 3), 2, 4, 6);
    assert_vec(apply("'scale': [1, -2, 3]", 1, 1, 1), 1, -2, 3);
    assert_vec(apply("'translate': [1, 2, 3]", 0, 0, 1), 1, 2, 4);
    assert_vec(apply("'rotate': [90, 0, 0]", 0, 1, 0), 0, 0, 1);
    assert_vec(apply("'rotate': [0, 90, 0]", 0, 0, 1), 1, 0, 0);
    assert_vec(apply("'rotate': [0, 0, 90]", 1, 0, 0), 0, 1, 0);
    /* About x first, y then: y goes to z, z to x. */
    assert_vec(apply("'rotate': [90, 90, 0]", 0, 1, 0), 1, 0, 0);
    assert_vec(apply("'rotate': [0, 90, 90]", 0, 0, 1), 0, 1, 0);
    assert_vec(apply("'translate': [10, 0, 0], 'scale': 3, 'rotate': [0, 0, 90]", 1, 0, 0), 10, 3,
               0);
    assert_vec(apply("'rotate': [0, 0, 30]", 1, 0, 0), sqrt(.75), .5, 0);
}

static void quarter_turns_are_exact(void **state) {
    (void)state;
    static const double sines[] = {0, 1, 0, -1, 0};
    for (int i = -4; i <= 4; i++) {
        char rotate[64];
        snprintf(rotate, sizeof rotate, "'rotate': [0, 0, %d]", 90 * i);
        shd_vec3 v = apply(rotate, 1, 0, 0);
        assert_true(v.y == (i < 0 ? -sines[-i] : sines[i]));
    }
}

static void matrix_is_column_major(void **state) {
    (void)state;
    assert_vec(apply("'matrix': [1,0,0,0, 0,0,1,0, 0,-1,0,0, 7,8,9,1]", 0, 1, 0), 7, 8, 10);
    assert_vec(apply("'matrix': [2,0,0,0, 0,3,0,0, 0,0,4,0, 0,0,0,1]", 1, 1, 1), 2, 3, 4);
}

static void extreme_scales_are_transforms(void **state) {
    (void)state;
    shd_vec3 v = apply("'scale': 1e20", 1, 2, 3);
    assert_true(v.x == 1e20 && v.z == 3e20);
    v = apply("'scale': [1e-23, 1, 1e20]", 1, 1, 1);
    assert_true(v.x == 1e-23 && v.y == 1 && v.z == 1e20);
}

static void mesh_without_indices_is_consecutive_triangles(void **state) {
    (void)state;
#define SIX "'positions': [0,0,0, 1,0,0, 0,1,0, 5,5,5, 6,5,5, 5,6,5]"
    reading r = read_scene(MESH(SIX));
    const shd_mesh *mesh = r.scene->objects->mesh;
    assert_int_equal(mesh->vertex_count, 6);
    assert_int_equal(mesh->triangle_count, 2);
    for (uint32_t i = 0; i < 6; i++) assert_int_equal(mesh->indices[i], i);
    assert_float_equal(mesh->positions[15], 5, 0);
    assert_null(mesh->normals);
    drop(&r);
}

static void mesh_keeps_indices_and_normals(void **state) {
    (void)state;
    reading r = read_scene(MESH("'positions': [0,0,0, 1,0,0, 0,1,0, 1,1,0],"
                                "'indices': [0,1,2, 1.0,3,2, 0,0,0],"
                                "'normals': [0,0,1, 0,0,2, 0,1,0, 1e-30,0,0]"));
    const shd_mesh *mesh = r.scene->objects->mesh;
    assert_int_equal(mesh->triangle_count, 3);
    assert_int_equal(mesh->indices[3], 1);
    assert_int_equal(mesh->indices[4], 3);
    assert_non_null(mesh->normals);
    assert_float_equal(mesh->normals[5], 2, 0);
    drop(&r);
}

static void mistakes_in_a_mesh_are_named_and_then_counted(void **state) {
    (void)state;
    reading r =
        read_with(MESH("'positions': [0,0,0], 'indices': [0,0,1, 2,3,4, 5,6,-1]"), &scene_limits);
    assert_int_equal(r.report.error_count, 4);
    assert_true(has_error(&r, "/objects/0/indices/2", "from 0 to 0, got 1"));
    assert_true(has_error(&r, "/objects/0/indices/4", "got 3"));
    assert_true(has_error(&r, "/objects/0/indices", "4 more"));
    drop(&r);
}

static void interpolation_of_the_scene_is_for_objects_that_do_not_say(void **state) {
    (void)state;
    reading r = read_scene("{'interpolation': 'flat', 'objects': [{'type': 'sphere'},"
                           "{'type': 'torus', 'interpolation': 'gouraud', 'segments': 3},"
                           "{'type': 'plane', 'interpolation': 'phong'}]}");
    assert_int_equal(r.scene->objects[0].interpolation, SHD_FLAT);
    assert_int_equal(r.scene->objects[1].interpolation, SHD_GOURAUD);
    assert_int_equal(r.scene->objects[1].segments, 3);
    assert_int_equal(r.scene->objects[2].interpolation, SHD_PHONG);
    drop(&r);
}

static void tessellations_are_counted(void **state) {
    (void)state;
    assert_int_equal(shd_tessellation_triangles(SHD_SPHERE, 3), 6);
    assert_int_equal(shd_tessellation_triangles(SHD_SPHERE, 32), 2 * 32 * 15);
    assert_int_equal(shd_tessellation_triangles(SHD_DISC, 32), 32);
    assert_int_equal(shd_tessellation_triangles(SHD_BOX, 32), 12);
    assert_int_equal(shd_tessellation_triangles(SHD_CYLINDER, 32), 128);
    assert_int_equal(shd_tessellation_triangles(SHD_CONE, 32), 64);
    assert_int_equal(shd_tessellation_triangles(SHD_TORUS, 32), 2048);
    assert_int_equal(shd_tessellation_triangles(SHD_PLANE, 32), 0);
}

/* ---- Materials ---- */

static const shd_material *material_of(const reading *r, size_t object) {
    return &r->scene->materials[r->scene->objects[object].material];
}

static void only_used_materials_are_in_the_scene_and_once(void **state) {
    (void)state;
    reading r = read_scene("{'materials': {'a': {}, 'b': {'diffuse': 0.1}, 'c': {}},"
                           "'objects': [{'type': 'sphere', 'material': 'b'}, {'type': 'box'},"
                           "{'type': 'disc', 'material': 'jade'}, {'type': 'sphere'},"
                           "{'type': 'disc', 'material': 'jade'}, {'type': 'box', 'material': 'b'},"
                           "{'type': 'box', 'material': {}}]}");
    assert_int_equal(r.scene->material_count, 4);
    assert_string_equal(material_of(&r, 0)->name, "b");
    assert_string_equal(material_of(&r, 2)->name, "jade");
    assert_ptr_equal(material_of(&r, 0), material_of(&r, 5));
    assert_ptr_equal(material_of(&r, 1), material_of(&r, 3));
    assert_ptr_equal(material_of(&r, 2), material_of(&r, 4));
    assert_rgb(material_of(&r, 0)->diffuse, .1, .1, .1);
    assert_rgb(material_of(&r, 0)->ambient, .1, .1, .1);
    drop(&r);
}

static void named_material_hides_the_preset(void **state) {
    (void)state;
    reading r = read_scene("{'materials': {'brass': {'diffuse': 0.5}},"
                           "'objects': [{'type': 'sphere', 'material': 'brass'}]}");
    assert_rgb(material_of(&r, 0)->diffuse, .5, .5, .5);
    drop(&r);
}

static const shd_preset *named_preset(const char *name) {
    const size_t index = shd_preset_find(scene_library, name);
    assert_true(index != SIZE_MAX);
    return shd_preset_at(scene_library, index);
}

static void preset_is_overridden_member_by_member(void **state) {
    (void)state;
    reading r = read_scene(OBJECT("'type': 'sphere', 'material':"
                                  "{'shininess': 5, 'diffuse': 0.25, 'preset': 'brass'}"));
    const shd_preset brass = *named_preset("brass");
    const shd_material *m = material_of(&r, 0);
    assert_rgb(m->diffuse, .25, .25, .25);
    assert_float_equal(m->lobes[0].shininess, 5, 0);
    assert_memory_equal(m->ambient, brass.ambient, sizeof m->ambient);
    assert_memory_equal(m->lobes[0].specular, brass.specular, sizeof brass.specular);
    assert_int_equal(r.report.warning_count, 0);
    drop(&r);
}

static void lobes_follow_the_first(void **state) {
    (void)state;
    reading r = read_scene(OBJECT("'type': 'sphere', 'material': {'specular': 0.1, 'shininess': 2,"
                                  "'lobes': [{'specular': 0.2, 'shininess': 500}, {}],"
                                  "'side': 'front', 'model': 'phong'}"));
    const shd_material *m = material_of(&r, 0);
    assert_true(m->front_only);
    assert_int_equal(m->lobe_count, 3);
    assert_float_equal(m->lobes[0].shininess, 2, 0);
    assert_float_equal(m->lobes[1].specular[1], .2, 0);
    assert_float_equal(m->lobes[1].shininess, 500, 0);
    assert_float_equal(m->lobes[2].specular[1], 0, 0);
    assert_float_equal(m->lobes[2].shininess, 32, 0);
    drop(&r);
}

static void suspicious_materials_give_warnings(void **state) {
    (void)state;
    reading r = read_scene(
        "{'materials': {'a/b': {'diffuse': 0.5, 'specular': [0, 0.8, 0], 'shininess': 0},"
        "'ambient': {'ambient': [1, 1, 1.25], 'diffuse': 0.5},"
        "'ordinary': {'ambient': 0.1, 'diffuse': 0.6, 'specular': 0.3},"
        "'glossy': {'diffuse': 0.8, 'specular': 1, 'shininess': 50},"
        "'sharp': {'shininess': 1001}, 'lobe': {'lobes': [{'shininess': 1e5}]}},"
        "'objects': [{'type': 'sphere', 'material': {'emissive': [0, 0, -1]}}]}");
    assert_int_equal(r.report.warning_count, 5);
    assert_true(has_warning(&r, "/materials/a~1b", "1.3 times"));
    assert_true(has_warning(&r, "/materials/ambient", "1.25 times"));
    assert_true(has_warning(&r, "/materials/sharp", "1001"));
    assert_true(has_warning(&r, "/materials/lobe", "100000"));
    assert_true(has_warning(&r, "/objects/0/material", "negative"));
    drop(&r);
}

/* The spelling of a material does not count, nor how often it is there. */
static void warnings_are_about_what_a_material_is(void **state) {
    (void)state;
    static const char *const same[] = {
        "'diffuse': 1.2", "'ambient': 1.2, 'diffuse': 1.2",
        "'ambient': [1.2, 1.2, 1.2], 'diffuse': 1.2",
        "'diffuse': 1.2, 'specular': 0, 'lobes': [], 'side': 'both', 'shininess': 32"};
    char words[256] = "";
    for (size_t i = 0; i < 4; i++) {
        char text[512];
        snprintf(text, sizeof text,
                 "{'objects': [{'type': 'sphere', 'material': {%s}}, {'type': 'torus', 'material': "
                 "{%s}}]}",
                 same[i], same[3 - i]);
        reading r = read_scene(text);
        assert_int_equal(r.report.warning_count, 1);
        assert_string_equal(r.report.warnings[0].pointer, "/objects/0/material");
        if (i) assert_string_equal(r.report.warnings[0].detail, words);
        snprintf(words, sizeof words, "%s", r.report.warnings[0].detail);
        drop(&r);
    }
    for (size_t i = 0; i < shd_preset_count(scene_library); i++) {
        size_t warnings[2];
        for (int k = 0; k < 2; k++) {
            char material[64], text[256];
            snprintf(material, sizeof material, k ? "{'preset': '%s'}" : "'%s'",
                     shd_preset_at(scene_library, i)->name);
            snprintf(text, sizeof text, OBJECT("'type': 'sphere', 'material': %s"), material);
            reading r = read_scene(text);
            warnings[k] = r.report.warning_count;
            drop(&r);
        }
        assert_int_equal(warnings[0], warnings[1]);
    }
}

static void library_is_sorted_and_plausible(void **state) {
    (void)state;
    assert_true(shd_preset_count(scene_library) >= 60);
    for (size_t i = 0; i < shd_preset_count(scene_library); i++) {
        const shd_preset preset = *shd_preset_at(scene_library, i);
        if (i) assert_true(strcmp(shd_preset_at(scene_library, i - 1)->name, preset.name) < 0);
        assert_int_equal(shd_preset_find(scene_library, preset.name), i);
        assert_true(*preset.note && *preset.source && *preset.group);
        assert_in_range((uintmax_t)preset.shininess, 0, 200);
        for (int c = 0; c < 3; c++) {
            assert_true(preset.ambient[c] >= 0 && preset.ambient[c] <= 1);
            assert_true(preset.diffuse[c] >= 0 && preset.diffuse[c] <= 1);
            assert_true(preset.specular[c] >= 0 && preset.specular[c] <= 1);
        }
    }
    assert_true(shd_preset_find(scene_library, "unobtainium") == SIZE_MAX);
    assert_float_equal(named_preset("brass")->shininess, 27.8974, 0);
    assert_float_equal(named_preset("planet")->shininess, 0, 0);
}

/* The published 0.75164, 0.60648, 0.22648 by IEC 61966-2-1: a lamp of 1 shows these codes. */
static void the_librarys_display_codes_are_decoded(void **state) {
    (void)state;
    reading r = read_scene(OBJECT("'type': 'sphere', 'material': 'gold'"));
    const shd_preset gold = *named_preset("gold");
    const double expected[3] = {0.52508004, 0.32616264, 0.04196316};
    for (int c = 0; c < 3; c++) {
        assert_float_equal(gold.diffuse[c], expected[c], 5e-8);
        assert_float_equal(material_of(&r, 0)->diffuse[c], gold.diffuse[c], 0);
    }
    drop(&r);
}

static void normals_of_the_back_give_a_warning(void **state) {
    (void)state;
    static const char *const orders[] = {"0,1,2", "0,2,1"};
    for (int i = 0; i < 2; i++) {
        char text[300];
        snprintf(text, sizeof text,
                 "{'objects': [{'type': 'mesh', 'positions': [0,0,0, 1,0,0, 0,1,0],"
                 "'normals': [0,0,1, 0,1,1, 0,0,3], 'indices': [%s]}]}",
                 orders[i]);
        reading r = read_scene(text);
        assert_int_equal(r.report.warning_count, i);
        if (i) assert_true(has_warning(&r, "/objects/0/normals", "of 1 of 1 triangles"));
        drop(&r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(transform_scales_then_rotates_then_translates),
        cmocka_unit_test(quarter_turns_are_exact),
        cmocka_unit_test(matrix_is_column_major),
        cmocka_unit_test(extreme_scales_are_transforms),
        cmocka_unit_test(mesh_without_indices_is_consecutive_triangles),
        cmocka_unit_test(mesh_keeps_indices_and_normals),
        cmocka_unit_test(mistakes_in_a_mesh_are_named_and_then_counted),
        cmocka_unit_test(interpolation_of_the_scene_is_for_objects_that_do_not_say),
        cmocka_unit_test(tessellations_are_counted),
        cmocka_unit_test(only_used_materials_are_in_the_scene_and_once),
        cmocka_unit_test(named_material_hides_the_preset),
        cmocka_unit_test(preset_is_overridden_member_by_member),
        cmocka_unit_test(lobes_follow_the_first),
        cmocka_unit_test(suspicious_materials_give_warnings),
        cmocka_unit_test(warnings_are_about_what_a_material_is),
        cmocka_unit_test(library_is_sorted_and_plausible),
        cmocka_unit_test(normals_of_the_back_give_a_warning),
        cmocka_unit_test(the_librarys_display_codes_are_decoded),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
