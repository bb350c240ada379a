/* Scenes that name meshes: by their digest, or by a name of the scene that objects share. */
#include "unit/scene_support.h"

/* ---- Meshes that are kept ---- */

#define NAME "sha256-00000000000000000000000000000000000000000000000000000000000000"

static const double kept_positions[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
static const double kept_normals[] = {0, 0, -1, 0, 0, -1, 0, 0, -1};
static const uint32_t kept_indices[] = {0, 1, 2};

/* The digest's last byte is 1: it is kept; 2: kept, with normals to its back; else it is not. */
static const shd_mesh *find(void *context, const shd_digest *digest) {
    static shd_mesh_kept kept[2];
    static shd_mesh meshes[2];
    int *asked = context;
    (*asked)++;
    const int last = digest->bytes[31];
    if (last != 1 && last != 2) return NULL;
    kept[last - 1].digest = *digest;
    meshes[last - 1] = (shd_mesh){.vertex_count = 3,
                                  .triangle_count = 1,
                                  .positions = kept_positions,
                                  .normals = last == 2 ? kept_normals : NULL,
                                  .indices = kept_indices,
                                  .high = {1, 1, 0},
                                  .inverted = last == 2,
                                  .kept = &kept[last - 1]};
    return &meshes[last - 1];
}

static reading read_named(const char *text, bool has_shelf) {
    static int asked;
    const shd_shelf shelf = {.find = find, .context = &asked};
    reading out = {.arena = shd_arena_new(scene_limits.memory)};
    assert_non_null(out.arena);
    shd_report_init(&out.report, out.arena);
    char *quoted = strdup(text);
    assert_non_null(quoted);
    for (char *c = quoted; *c; c++)
        if (*c == '\'') *c = '"';
    out.status =
        shd_scene_read(quoted, strlen(quoted), &scene_catalog, &scene_limits, NULL, SHD_PNG,
                       has_shelf ? &shelf : NULL, out.arena, &out.scene, &out.report);
    free(quoted);
    return out;
}

static void assert_unnamed(const char *text, bool has_shelf, shd_status status, const char *pointer,
                           const char *words) {
    reading r = read_named(text, has_shelf);
    assert_int_equal(r.status, status);
    if (!has_problem(r.report.errors, shd_report_errors_kept(&r.report), pointer, words))
        fail_msg("no '%s' at '%s', but '%s' at '%s'", words, pointer, r.report.errors[0].detail,
                 r.report.errors[0].pointer);
    drop(&r);
}

static void scenes_name_meshes(void **state) {
    (void)state;
    reading r = read_named("{'objects': [{'type': 'mesh', 'data': '" NAME "01'}]}", true);
    assert_int_equal(r.status, SHD_OK);
    assert_ptr_equal(r.scene->objects[0].mesh->positions, kept_positions);
    assert_int_equal(r.report.warning_count, 0);
    drop(&r);
    r = read_named("{'objects': [{'type': 'mesh', 'data': '" NAME "02'}]}", true);
    assert_int_equal(r.status, SHD_OK);
    assert_true(has_problem(r.report.warnings, 1, "/objects/0/data", "point to the side"));
    drop(&r);
}

static void names_are_digests_or_mistakes(void **state) {
    (void)state;
    static const char *const wrong[] = {"'sha256-'",    "'" NAME "0'", "'" NAME "011'",
                                        "'" NAME "0A'", "'SHA256-0'",  "''",
                                        "'" NAME "0g'"};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        char text[256];
        snprintf(text, sizeof text, "{'objects': [{'type': 'mesh', 'data': %s}]}", wrong[i]);
        assert_unnamed(text, true, SHD_SCENE, "/objects/0/data", "64 hexadecimal digits");
    }
    assert_unnamed("{'objects': [{'type': 'mesh', 'data': 1}]}", true, SHD_SCENE, "/objects/0/data",
                   "expected a string");
    assert_unnamed("{'objects': [{'type': 'sphere', 'data': '" NAME "01'}]}", true, SHD_SCENE,
                   "/objects/0/data", "unknown member");
    static const char *const arrays[] = {"'positions': [0,0,0, 1,0,0, 0,1,0]", "'indices': [0,1,2]",
                                         "'normals': null"};
    for (int i = 0; i < 3; i++) {
        char text[256];
        snprintf(text, sizeof text, "{'objects': [{'type': 'mesh', 'data': '" NAME "01', %s}]}",
                 arrays[i]);
        assert_unnamed(text, true, SHD_SCENE, "/objects/0/data", "not both");
    }
    assert_unnamed("{'objects': [{'type': 'mesh', 'data': '" NAME "01'}]}", false, SHD_SCENE,
                   "/objects/0/data", "no meshes are kept here");
}

static void all_that_is_missing_is_told_at_once(void **state) {
    (void)state;
    const char *text = "{'objects': [{'type': 'mesh', 'data': '" NAME "03'},"
                       "{'type': 'mesh', 'data': '" NAME "01'},"
                       "{'type': 'mesh', 'data': '" NAME "03'},"
                       "{'type': 'mesh', 'data': '" NAME "04'}%s]}";
    char whole[1024];
    snprintf(whole, sizeof whole, text, "");
    reading r = read_named(whole, true);
    assert_int_equal(r.status, SHD_MISSING);
    assert_int_equal(r.report.error_count, 2);
    assert_true(has_problem(r.report.errors, 2, "/objects/0/data", NAME "03"));
    assert_true(has_problem(r.report.errors, 2, "/objects/3/data", NAME "04"));
    drop(&r);
    /* What can be mended without asking for anything comes first. */
    snprintf(whole, sizeof whole, text, ", {'type': 'sphere', 'radius': -1}");
    r = read_named(whole, true);
    assert_int_equal(r.status, SHD_SCENE);
    assert_int_equal(r.report.error_count, 3);
    assert_true(has_problem(r.report.errors, 1, "/objects/4/radius", "greater"));
    assert_true(has_problem(r.report.errors, 3, "/objects/3/data", NAME "04"));
    drop(&r);
}

static void more_are_missing_than_are_told(void **state) {
    (void)state;
    char *text = malloc(1 << 16);
    assert_non_null(text);
    strcpy(text, "{'objects': [");
    for (int i = 0; i < 300; i++)
        sprintf(text + strlen(text), "%s{'type': 'mesh', 'data': 'sha256-%060d%04x'}", i ? "," : "",
                0, 0x1000 + i);
    strcat(text, "]}");
    reading r = read_named(text, true);
    assert_int_equal(r.status, SHD_MISSING);
    assert_int_equal(r.report.error_count, 296); /* four of them end in 1 or 2 */
    drop(&r);
    free(text);
}

static void digests_tell_scenes_apart(void **state) {
    (void)state;
    static const char *const texts[] = {
        "{'objects': [{'type': 'mesh', 'data': '" NAME "01'}]}",
        "{'objects': [{'type': 'mesh', 'data': '" NAME "02'}]}",
        "{'objects': [{'type': 'mesh', 'positions': [0,0,0, 1,0,0, 0,1,0]}]}",
        "{'objects': [{'data': '" NAME "01', 'type': 'mesh', 'name': 'a'}], 'lights': [{"
        "'type': 'directional', 'direction': [0, 0, -1]}]}"};
    char digests[4][33];
    for (int i = 0; i < 4; i++) {
        reading r = read_named(texts[i], true);
        assert_int_equal(r.status, SHD_OK);
        strcpy(digests[i], r.scene->digest);
        drop(&r);
    }
    assert_string_not_equal(digests[0], digests[1]);
    assert_string_not_equal(digests[0], digests[2]);
    assert_string_equal(digests[0], digests[3]);
}

/* ---- Meshes that objects share ---- */

#define TRIANGLE                "'positions': [0,0,0, 1,0,0, 0,1,0]"
#define SHARED(meshes, objects) "{'meshes': {" meshes "}, 'objects': [" objects "]}"
#define OF(name)                "{'type': 'mesh', 'mesh': '" name "'}"

static void objects_share_a_mesh(void **state) {
    (void)state;
    reading r = read_scene(SHARED("'b': {'positions': [0,0,0, 2,0,0, 0,2,0, 0,2,2], 'indices': "
                                  "[0,1,2, 0,2,3]}, 'a': {" TRIANGLE "}, 'unused': {" TRIANGLE "}",
                                  "{'type': 'sphere'}, " OF("a") ", " OF("b") ", " OF("b")));
    const shd_object *objects = r.scene->objects;
    assert_int_equal(objects[1].mesh->triangle_count, 1);
    assert_int_equal(objects[2].mesh->triangle_count, 2);
    assert_ptr_equal(objects[2].mesh, objects[3].mesh);
    assert_true(objects[1].mesh->shared && objects[2].mesh->shared);
    assert_int_equal(objects[1].mesh->first, 1);
    assert_int_equal(objects[2].mesh->first, 2);
    assert_int_equal(r.scene->mesh_triangles, 5);
    drop(&r);
}

static void a_shared_mesh_counts_once(void **state) {
    (void)state;
    const char *twice = SHARED("'a': {" TRIANGLE "}", OF("a") ", " OF("a"));
    const char *faces = "{'interpolation': 'flat', 'meshes': {'a': {" TRIANGLE
                        "}}, 'objects': [" OF("a") ", " OF("a") "]}";
    shd_limits limits = scene_limits;
    limits.triangles = 1;
    reading r = read_with(twice, &limits);
    assert_int_equal(r.status, SHD_OK);
    drop(&r);
    r = read_with(faces, &limits); /* each has facets of its own */
    assert_int_equal(r.status, SHD_LIMIT);
    assert_true(has_error(&r, "/objects", "the limit `triangles`"));
    drop(&r);
    limits.objects = 2;
    limits.triangles = 1 << 10;
    r = read_with(SHARED("'a': {" TRIANGLE "}, 'b': {" TRIANGLE "}, 'c': {" TRIANGLE "}", ""),
                  &limits);
    assert_int_equal(r.status, SHD_LIMIT);
    assert_true(has_error(&r, "/meshes", "the limit `objects`"));
    drop(&r);
}

static void mistakes_in_shared_meshes_are_told(void **state) {
    (void)state;
    static const refusal cases[] = {
        {SHARED("'arm': {" TRIANGLE "}", OF("amr")), "/objects/0/mesh", "did you mean \"arm\""},
        {"{'objects': [" OF("arm") "]}", "/objects/0/mesh", "there is no mesh \"arm\""},
        {"{'meshes': [], 'objects': [" OF("arm") "]}", "/meshes", "expected an object"},
        {SHARED("'a': {}", OF("a")), "/meshes/a", "\"positions\" is missing"},
        {SHARED("'a': 1", OF("a")), "/meshes/a", "expected an object"},
        {SHARED("'a/b': {'positions': [0,0,0, 1,0,0]}", OF("a/b")), "/meshes/a~1b/positions",
         "without `indices`"},
        {SHARED("'a': {" TRIANGLE ", 'indices': [0, 1, 3]}", ""), "/meshes/a/indices/2", "to 2"},
        {SHARED("'a': {" TRIANGLE ", 'material': 'brass'}", ""), "/meshes/a/material", "unknown"},
        {SHARED("'a': {" TRIANGLE ", 'data': 'sha256-'}", ""), "/meshes/a/data", "not both"},
        {SHARED("'a': {" TRIANGLE "}", "{'type': 'mesh', 'mesh': 'a', " TRIANGLE "}"),
         "/objects/0/mesh", "not both"},
        {SHARED("'a': {" TRIANGLE "}", "{'type': 'mesh', 'mesh': 1}"), "/objects/0/mesh",
         "the name of a mesh"},
        {SHARED("'a': {" TRIANGLE "}", "{'type': 'sphere', 'mesh': 'a'}"), "/objects/0/mesh",
         "unknown member"},
        {SHARED("'a\\n': {" TRIANGLE "}", ""), "/meshes", "control characters"},
    };
    ASSERT_REFUSED(cases);
    reading r = read_named(
        SHARED("'~': {'data': '" NAME "03'}, 'b': {'data': '" NAME "01'}", OF("~") ", " OF("b")),
        true);
    assert_int_equal(r.status, SHD_MISSING);
    assert_int_equal(r.report.error_count, 1);
    assert_true(has_problem(r.report.errors, 1, "/meshes/~0/data", NAME "03"));
    drop(&r);
}

static void what_is_not_used_has_no_part_in_the_digest(void **state) {
    (void)state;
    static const char *const texts[] = {
        "{'objects': [{'type': 'mesh', " TRIANGLE "}]}",
        SHARED("'a': {" TRIANGLE "}", OF("a")),
        SHARED("'b': {" TRIANGLE "}, 'c': {'positions': [0,0,0, 1,0,0, 0,2,0]}", OF("b")),
        SHARED("'b': {" TRIANGLE "}, 'c': {'positions': [0,0,0, 1,0,0, 0,2,0]}", OF("c")),
        SHARED("'a': {" TRIANGLE "}, 'b': {'positions': [0,0,0, 1,0,0, 0,2,0]}",
               OF("a") ", " OF("b") ", " OF("a")),
        SHARED("'a': {" TRIANGLE "}, 'b': {'positions': [0,0,0, 1,0,0, 0,2,0]}",
               OF("a") ", " OF("b") ", " OF("b"))};
    char digests[6][33];
    for (int i = 0; i < 6; i++) {
        reading r = read_scene(texts[i]);
        strcpy(digests[i], r.scene->digest);
        drop(&r);
    }
    assert_string_equal(digests[0], digests[1]);
    assert_string_equal(digests[0], digests[2]);
    assert_string_not_equal(digests[0], digests[3]);
    assert_string_not_equal(digests[4], digests[5]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(scenes_name_meshes),
        cmocka_unit_test(names_are_digests_or_mistakes),
        cmocka_unit_test(all_that_is_missing_is_told_at_once),
        cmocka_unit_test(more_are_missing_than_are_told),
        cmocka_unit_test(digests_tell_scenes_apart),
        cmocka_unit_test(objects_share_a_mesh),
        cmocka_unit_test(a_shared_mesh_counts_once),
        cmocka_unit_test(mistakes_in_shared_meshes_are_told),
        cmocka_unit_test(what_is_not_used_has_no_part_in_the_digest),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
