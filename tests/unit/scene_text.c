/* The document as text: syntax, limits, memory, digest. */
#include "unit/scene_support.h"

typedef struct mistake {
    const char *text;
    int line, column;
    const char *words;
} mistake;

static void syntax_errors_have_line_and_column(void **state) {
    (void)state;
    static const mistake cases[] = {
        {"", 1, 1, "empty"},
        {" \n\t ", 1, 1, "empty"},
        {"{", 1, 1, ""},
        {"{\"objects\":\n  [tru]}", 2, 6, "invalid token"},
        {"{\"objects\": []} x", 1, 17, "end of file expected"},
        {"{\"objects\": []}{}", 1, 16, "end of file expected"},
        {"{\"objects\": [01]}", 1, 14, ""},
        {"{\"objects\": [NaN]}", 1, 16, ""},
        {"{\"objects\": [-Infinity]}", 1, 14, ""},
        {"{\"objects\": [1,]}", 1, 16, ""},
        {"{'objects': []}", 1, 2, ""},
        {"{\"ambient\": 1e999}", 1, 17, "real number overflow"},
        {"{\"ambient\": -1e999}", 1, 18, "real number overflow"},
        {"{\"a\": 1,\n \"a\": 2}", 2, 4, "the key \"a\" is there twice"},
        {"{\"x\": \"\\u0000\"}", 1, 14, "\\u0000 is not allowed in strings"},
        {"{\"x\": \"\\ud800\"}", 1, 14, ""},
        {"{\"x\": \"\xff\"}", 1, 7, "unable to decode byte 0xff"},
        {"{\"x\": \"\xc0\x80\"}", 1, 7, "unable to decode byte 0xc0"},
        {"\xef\xbb\xbf{}", 1, 1, "byte order mark"},
        {"{\"x\": \"a\nb\"}", 1, 8, "newline"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        reading r = read_bytes(cases[i].text, strlen(cases[i].text), &scene_limits);
        if (r.status != SHD_SYNTAX || r.report.line != cases[i].line ||
            r.report.column != cases[i].column || !has_error(&r, "", cases[i].words)) {
            print_error("%s: wanted line %d, column %d, %s; got %d, %d, %s\n", cases[i].text,
                        cases[i].line, cases[i].column, cases[i].words, r.report.line,
                        r.report.column, r.report.errors[0].detail);
            fail();
        }
        drop(&r);
    }
}

static void long_duplicate_keys_are_named(void **state) {
    (void)state;
    reading r = read_with("{'a-rather-long-name-of-a-member \\'q\\'': 1,"
                          "'a-rather-long-name-of-a-member \\'q\\'': 2}",
                          &scene_limits);
    assert_int_equal(r.status, SHD_SYNTAX);
    assert_true(has_error(&r, "", "the key \"a-rather-long-name-of-a-member \\\"q\\\"\""));
    drop(&r);
}

/* Looking for its beginning takes no more than one look at each byte: else this would take hours.
 */
static void duplicate_keys_of_backslashes_are_named_at_once(void **state) {
    (void)state;
    enum { KEY = (1 << 20) - 2 };
    char *text = malloc(2 * KEY + 16), *end = text;
    assert_non_null(text);
    for (int k = 0; k < 2; k++) {
        *end++ = k ? ',' : '{';
        *end++ = '"';
        memset(end, '\\', KEY);
        end += KEY;
        end = stpcpy(end, "\":1");
    }
    reading r = read_bytes(text, (size_t)(end - text), &scene_limits);
    assert_int_equal(r.status, SHD_SYNTAX);
    assert_true(has_error(&r, "", "the key \"\\\\\\"));
    drop(&r);
    free(text);
}

static void bytes_of_zero_are_syntax_errors(void **state) {
    (void)state;
    static const char inside[] = "{\"obj\0ects\": []}", after[] = "{\"objects\": []}\0";
    reading r = read_bytes(inside, sizeof inside - 1, &scene_limits);
    assert_int_equal(r.status, SHD_SYNTAX);
    drop(&r);
    r = read_bytes(after, sizeof after - 1, &scene_limits);
    assert_int_equal(r.status, SHD_SYNTAX);
    drop(&r);
    r = read_bytes("\0\0\0", 3, &scene_limits);
    assert_int_equal(r.status, SHD_SYNTAX);
    drop(&r);
}

static void nesting_without_end_is_refused(void **state) {
    (void)state;
    enum { DEPTH = 100000 };
    static const char *const pieces[] = {"[", "{\"a\":"};
    for (int p = 0; p < 2; p++) {
        size_t length = strlen(pieces[p]);
        char *text = malloc(DEPTH * length);
        assert_non_null(text);
        for (size_t i = 0; i < DEPTH; i++) memcpy(text + i * length, pieces[p], length);
        reading r = read_bytes(text, DEPTH * length, &scene_limits);
        assert_int_equal(r.status, SHD_SYNTAX);
        assert_true(has_error(&r, "", "nested too deeply"));
        drop(&r);
        free(text);
    }
    /* As deep as the parser goes, in a place where anything is an error. */
    char deep[4096] = "{\"objects\": ";
    memset(deep + 12, '[', 2000);
    memset(deep + 2012, ']', 2000);
    strcpy(deep + 4012, "}");
    reading r = read_bytes(deep, strlen(deep), &scene_limits);
    assert_int_equal(r.status, SHD_SCENE);
    drop(&r);
}

static void every_prefix_of_a_document_is_refused(void **state) {
    (void)state;
    static const char text[] =
        "{\"lights\": [{\"position\": [1.5e1, -2, 3, 1], \"color\": \"#ffeedd\"}], "
        "\"background\": null, \"objects\": [{\"type\": \"sphere\", \"m\\u00e4\": true}]}";
    for (size_t length = 0; length < sizeof text - 1; length++) {
        reading r = read_bytes(text, length, &scene_limits);
        assert_int_equal(r.status, SHD_SYNTAX);
        drop(&r);
    }
}

/* ---- Limits ---- */

static void assert_limit(const char *text, shd_limits limits, const char *pointer,
                         const char *words) {
    reading r = read_with(text, &limits);
    if (r.status != SHD_LIMIT || !has_error(&r, pointer, words)) {
        print_error("%s: %s\n", text,
                    r.report.error_count ? r.report.errors[0].detail : "accepted");
        fail();
    }
    drop(&r);
}

static void limits_are_named_with_what_was_asked(void **state) {
    (void)state;
    shd_limits l = scene_limits;
    assert_limit(WITH("'image': {'width': 10000, 'height': 10000}"), l, "/image",
                 "the image asks for 100000000 pixels; the limit `pixels` is 16777216");
    l.pixels = 1000;
    assert_limit("{'objects': []}", l, "", "262144 pixels");
    assert_limit(WITH("'image': {'region': [0, 0, 1001, 1], 'width': 60000}"), l, "/image",
                 "1001 pixels");
    reading r = read_with(WITH("'image': {'width': 65535, 'height': 65535,"
                               "'region': [65000, 65000, 100, 10], 'samples': 1}"),
                          &l);
    assert_int_equal(r.status, SHD_OK);
    drop(&r);

    l = scene_limits;
    l.samples = 4 * 512 * 512 - 1;
    assert_limit("{'objects': []}", l, "",
                 "1048576 samples (262144 pixels of 4); the limit `samples` is 1048575");
    assert_limit(WITH("'image': {'width': 65535, 'height': 65535, 'region': [9, 9, 129, 128],"
                      "'samples': 64}"),
                 l, "/image", "1056768 samples");
    r = read_with(WITH("'image': {'region': [9, 9, 128, 127], 'samples': 64}"), &l);
    assert_int_equal(r.status, SHD_OK);
    drop(&r);

    l = scene_limits;
    l.lights = 2;
    assert_limit(WITH("'lights': [{'type': 'point'}, {'type': 'point'}, {'type': 'point'}]"), l,
                 "/lights", "3 lights; the limit `lights` is 2");
    /* What was not read is not held against the rest. */
    shd_limits none = l;
    none.lights = 0;
    reading few = read_with(WITH("'lights': [{'type': 'point'}], 'output': {'format': 'exr',"
                                 "'layers': ['light.0']}"),
                            &none);
    assert_int_equal(few.report.error_count, 1);
    drop(&few);
    l.objects = 1;
    assert_limit("{'objects': [{'type': 'box'}, {'type': 'box'}]}", l, "/objects",
                 "2 objects; the limit `objects` is 1");
    l = scene_limits;
    l.body = 10;
    assert_limit("{'objects': []}", l, "", "15 bytes; the limit `body` is 10");
    l = scene_limits;
    l.triangles = 2100;
    assert_limit("{'objects': [{'type': 'torus', 'interpolation': 'flat'},"
                 "{'type': 'box', 'interpolation': 'flat'}, {'type': 'cylinder',"
                 "'interpolation': 'gouraud'}]}",
                 l, "/objects", "2188 triangles; the limit `triangles` is 2100");
    l.triangles = 1;
    assert_limit(MESH("'positions': [0,0,0, 1,0,0, 0,1,0], 'indices': [0,1,2, 0,2,1]"), l,
                 "/objects", "2 triangles");
    assert_limit("{'objects': [{'type': 'sphere', 'radius': 0.5}, {'type': 'disc',"
                 "'interpolation': 'flat'}]}",
                 l, "/objects", "32 triangles");
}

/* The tree may be far larger than its text: it is measured before it is made. */
static void a_tree_larger_than_the_memory_limit_is_not_made(void **state) {
    (void)state;
    enum { COUNT = 1 << 20 };
    char *text = malloc(3 * COUNT);
    assert_non_null(text);
    for (size_t i = 0; i < COUNT; i++) memcpy(text + 3 * i, "{},", 3);
    text[0] = '[';
    reading r = read_bytes(text, 3 * COUNT, &scene_limits);
    assert_int_equal(r.status, SHD_LIMIT);
    assert_true(has_error(&r, "", "the limit `memory` is 268435456"));
    drop(&r);
    free(text);
}

static void full_arena_is_a_memory_error(void **state) {
    (void)state;
    /* Materials with lobes: little text and much scene. */
    char text[1 << 15] = "{'objects': [";
    for (int i = 0; i < 500; i++) strcat(text, i ? ",{'type': 'box'}" : "{'type': 'box'}");
    strcat(text, "]}");
    shd_limits limits = scene_limits;
    shd_arena *arena = shd_arena_new(100000);
    shd_report report;
    shd_report_init(&report, arena);
    const shd_scene *scene = NULL;
    for (char *c = text; *c; c++)
        if (*c == '\'') *c = '"';
    shd_status status = shd_scene_read(text, strlen(text), &scene_catalog, &limits, NULL, SHD_PNG,
                                       NULL, arena, &scene, &report);
    assert_int_equal(status, SHD_MEMORY);
    assert_null(scene);
    assert_int_equal(report.error_count, 1);
    shd_arena_drop(arena);
}

/* What is long is bounded, or it could not be left amid its work. */
static void lists_that_are_too_long_are_refused(void **state) {
    (void)state;
    enum { MATERIALS = 1001, LAYERS = 144, VALUES = 1 << 21, ROOM = 2 * VALUES + 64 };
    char *text = malloc(ROOM), *end = stpcpy(text, "{'objects': [], 'materials': {'m0': {}");
    for (int i = 1; i < MATERIALS; i++) end += sprintf(end, ",'m%d': {}", i);
    strcpy(end, "}}");
    assert_limit(text, scene_limits, "/materials",
                 "the scene has 1001 materials, more than objects may have: the limit `objects` is "
                 "1000");
    end = stpcpy(text, "{'objects': [], 'output': {'format': 'exr', 'layers': ['depth'");
    for (int i = 1; i < LAYERS; i++) end = stpcpy(end, ",'depth'");
    strcpy(end, "]}}");
    assert_limit(text, scene_limits, "/output/layers",
                 "144 layers are more than there may be: the limit `lights` is 64");
    end = stpcpy(text, "{'objects': [0");
    for (int i = 0; i < VALUES; i++) end = stpcpy(end, ",0");
    strcpy(end, "]}");
    assert_limit(text, scene_limits, "",
                 "the document has about 2097155 values beside the numbers of meshes; at most "
                 "2097152 are read");
    end = stpcpy(text, "{'objects': [], '$schema': '");
    memset(end, 'x', VALUES);
    strcpy(end + VALUES, "'}");
    assert_limit(text, scene_limits, "", "a string has 2097154 bytes; at most 1048576 are read");
    free(text);
}

/* ---- Digest ---- */

static void assert_same_digests(const char *const *documents, size_t count) {
    char digest[33];
    for (size_t i = 0; i < count; i++) {
        reading r = read_scene(documents[i]);
        if (!i) strcpy(digest, r.scene->digest);
        if (strcmp(r.scene->digest, digest) != 0) fail_msg("%s is another scene", documents[i]);
        assert_int_equal(strspn(digest, "0123456789abcdef"), 32);
        drop(&r);
    }
}

static void digest_is_of_what_the_document_says(void **state) {
    (void)state;
    static const char *const same[] = {
        "{'ambient': 0.5, 'background': [0, 1, 2], 'objects': [{'type': 'sphere', 'radius': 10}]}",
        "{'objects':[{'radius':1e1,'type':'spher\\u0065'}],'background':[0,1,2],'ambient':0.5}",
        "\n{'background':[-0,1.0,2], 'objects':[{'type':'sphere','radius':1e1}], 'ambient':5e-1}",
        "{'$schema': 'scene.schema.json', 'ambient': {'space': 'lin_rec709', 'value': [0.5, 0.5, "
        "0.5]},"
        " 'background': [0, 1, 2], 'objects': [{'type': 'sphere', 'name': 'ball', 'radius': 10}]}",
    };
    assert_same_digests(same, sizeof same / sizeof same[0]);
}

static void digest_does_not_change_with_defaults_and_unused_materials(void **state) {
    (void)state;
    static const char *const smallest[] = {
        "{'objects': [{'type': 'sphere'}]}",
        "{'workingSpace': 'lin_rec709', 'colorSpace': 'lin_rec709', 'ambient': 0,"
        " 'camera': {'type': 'perspective', 'position': [0, 0, 4], 'target': [0, 0, 0],"
        " 'up': [0, 2, 0], 'fov': 40},"
        " 'image': {'width': 512, 'height': 512, 'samples': 4, 'region': [0, 0, 512, 512]},"
        " 'background': '#000', 'interpolation': 'phong', 'materials': {},"
        " 'accuracy': {'tier': 'standard'},"
        " 'output': {'format': 'png', 'display': 'sRGB', 'view': 'Standard', 'bitDepth': 8,"
        " 'quality': 90}, 'objects': [{'type': 'sphere', 'radius': 1, 'interpolation': 'phong',"
        " 'transform': {'scale': 1, 'rotate': [0, 0, 0], 'translate': [0, 0, 0]}, 'segments': 7,"
        " 'material': {'model': 'phong', 'emissive': 0, 'ambient': 0.8, 'diffuse': [0.8, 0.8, 0.8],"
        " 'specular': 0, 'shininess': 32, 'lobes': [], 'side': 'both'}}]}",
        "{'materials': {'grey': {'diffuse': 0.8}, 'unused': {'diffuse': 0.3}, 'brass': {}},"
        " 'objects': [{'type': 'sphere', 'material': 'grey'}]}",
        "{'lights': [{'type': 'directional', 'direction': [0, 0, -1], 'name': 'the default'}],"
        " 'objects': [{'type': 'sphere', 'transform': {'matrix': [1,0,0,0, 0,1,0,0, 0,0,1,0,"
        " 0,0,0,1]}}]}",
    };
    assert_same_digests(smallest, sizeof smallest / sizeof smallest[0]);
#define TRIANGLE "'positions': [0,0,0, 1,0,0, 0,1,0]"
    static const char *const meshes[] = {MESH(TRIANGLE), MESH(TRIANGLE ", 'indices': [0, 1, 2]"),
                                         MESH(TRIANGLE ", 'normals': null")};
    assert_same_digests(meshes, sizeof meshes / sizeof meshes[0]);
    static const char *const lit[] = {
        LIGHT("'type': 'spot'"), LIGHT("'position': [0, 8, 0, 2], 'type': 'spot', 'intensity': 1"),
        LIGHT("'type': 'spot', 'position': [0, 4, 0], 'direction': [0, -3, 0], 'angle': 30,"
              "'penumbra': 0.2, 'exponent': 0, 'color': '#fff', 'ambient': 0, 'frame': 'world',"
              "'attenuation': [1, 0, 0], 'minDistance': 0")};
    assert_same_digests(lit, sizeof lit / sizeof lit[0]);
    static const char *const backgrounds[] = {
        WITH("'background': '#f00'"), WITH("'background': ' RED '"),
        WITH("'background': 'hsl(0deg 100% 50% / 1)'"), WITH("'background': [1, 0, 0, 1]")};
    assert_same_digests(backgrounds, sizeof backgrounds / sizeof backgrounds[0]);
    static const char *const clear[] = {WITH("'background': null"),
                                        WITH("'background': [3, 2, 1, 0]"),
                                        WITH("'background': 'transparent'")};
    assert_same_digests(clear, sizeof clear / sizeof clear[0]);
    static const char *const budgets[] = {
        WITH("'accuracy': {'maxError': 0.5}"),
        WITH("'accuracy': {'maxError': 0.5, 'metric': 'deltaE2000'}")};
    assert_same_digests(budgets, sizeof budgets / sizeof budgets[0]);
    static const char *const lossless[] = {OUTPUT("'format': 'webp', 'quality': 100"),
                                           OUTPUT("'format': 'webp', 'quality': 100, 'effort': 2")};
    assert_same_digests(lossless, sizeof lossless / sizeof lossless[0]);
}

/* Whatever a picture depends on: each of these is another scene than all the others. */
static void digest_differs_where_scenes_do(void **state) {
    (void)state;
#define PART(members)     OBJECT("'type': 'sphere', " members)
#define MATERIAL(members) PART("'material': {" members "}")
#define SPOT(members)     LIGHT("'type': 'spot', " members)
    static const char *const scenes[] = {
        WITH("'ambient': 0"),
        WITH("'ambient': 0.5"),
        WITH("'ambient': [0.5, 0.5, 0.6]"),
        WITH("'workingSpace': 'wide'"),
        WITH("'background': null"),
        WITH("'background': [0, 1, 2]"),
        WITH("'background': [0, 2, 1]"),
        WITH("'background': [0, 2, 1, 0.5]"),
        WITH("'background': [0, 2, 1, 0.25]"),
        WITH("'camera': {'position': [0, 0, 5]}"),
        WITH("'camera': {'position': [0, 1, 4]}"),
        WITH("'camera': {'target': [0, 1, 0]}"),
        WITH("'camera': {'up': [1, 1, 0]}"),
        WITH("'camera': {'fov': 41}"),
        WITH("'camera': {'type': 'orthographic'}"),
        WITH("'camera': {'type': 'orthographic', 'height': 40}"),
        WITH("'image': {'width': 9}"),
        WITH("'image': {'height': 9}"),
        WITH("'image': {'samples': 5}"),
        WITH("'image': {'region': [0, 0, 9, 8]}"),
        WITH("'image': {'region': [0, 0, 8, 9]}"),
        WITH("'image': {'region': [1, 0, 9, 8]}"),
        WITH("'image': {'region': [0, 1, 9, 8]}"),
        WITH("'lights': []"),
        LIGHT("'type': 'point'"),
        LIGHT("'type': 'ambient'"),
        LIGHT("'type': 'directional'"),
        WITH("'lights': [{'type': 'point'}, {'type': 'point'}]"),
        SPOT("'color': 2"),
        SPOT("'intensity': 3"),
        SPOT("'ambient': 2"),
        SPOT("'angle': 31"),
        SPOT("'penumbra': 0.3"),
        SPOT("'exponent': 1"),
        SPOT("'minDistance': 1"),
        SPOT("'attenuation': [1, 0, 1]"),
        SPOT("'attenuation': [1, 1, 0]"),
        SPOT("'direction': [1, -1, 0]"),
        SPOT("'position': [1, 4, 0]"),
        SPOT("'frame': 'camera'"),
        "{'objects': []}",
        "{'objects': [{'type': 'sphere'}, {'type': 'sphere'}]}",
        "{'objects': [{'type': 'sphere'}, {'type': 'box'}]}",
        "{'objects': [{'type': 'box'}, {'type': 'sphere'}]}",
        OBJECT("'type': 'torus'"),
        OBJECT("'type': 'torus', 'tube': 0.3"),
        OBJECT("'type': 'torus', 'radius': 0.3"),
        OBJECT("'type': 'cone'"),
        OBJECT("'type': 'cone', 'height': 3"),
        OBJECT("'type': 'plane'"),
        OBJECT("'type': 'box', 'size': [1, 2, 1]"),
        PART("'radius': 2"),
        PART("'transform': {'scale': 2}"),
        PART("'transform': {'rotate': [1, 0, 0]}"),
        PART("'transform': {'translate': [1, 0, 0]}"),
        PART("'interpolation': 'flat'"),
        PART("'interpolation': 'gouraud'"),
        PART("'interpolation': 'flat', 'segments': 9"),
        MATERIAL("'emissive': 1"),
        MATERIAL("'ambient': 1"),
        MATERIAL("'diffuse': 1"),
        MATERIAL("'specular': 1"),
        MATERIAL("'shininess': 1"),
        MATERIAL("'side': 'front'"),
        MATERIAL("'lobes': [{}]"),
        MATERIAL("'lobes': [{'specular': 1}]"),
        MATERIAL("'lobes': [{'shininess': 1}]"),
        PART("'material': 'brass'"),
        MESH(TRIANGLE),
        MESH(TRIANGLE ", 'indices': [0, 2, 1]"),
        MESH(TRIANGLE ", 'indices': [0, 1, 2, 0, 1, 2]"),
        MESH(TRIANGLE ", 'normals': [0,0,1, 0,0,1, 0,0,1]"),
        MESH(TRIANGLE ", 'normals': [0,0,1, 0,1,0, 0,0,1]"),
        MESH("'positions': [0,0,0, 1,0,0, 0,1,1]"),

        WITH("'accuracy': {'tier': 'draft'}"),
        WITH("'accuracy': {'tier': 'exact'}"),
        WITH("'accuracy': {'maxError': 0.5}"),
        WITH("'accuracy': {'maxError': 0.6}"),
        WITH("'accuracy': {'maxError': 0.5, 'metric': 'code'}"),
        OUTPUT("'format': 'jpeg'"),
        OUTPUT("'format': 'jpeg', 'quality': 91"),
        OUTPUT("'format': 'webp'"),
        OUTPUT("'format': 'webp', 'effort': 5"),
        OUTPUT("'display': 'Rec.1886'"),
        OUTPUT("'view': 'Raw'"),
        OUTPUT("'colorSpace': 'YIQ'"),
        OUTPUT("'colorSpace': 'sRGB'"),
        OUTPUT("'bitDepth': 16"),
        OUTPUT("'channel': 'R'"),
        OUTPUT("'channel': 'A'"),
        OUTPUT("'format': 'exr'"),
        OUTPUT("'format': 'exr', 'layers': ['beauty']"),
        OUTPUT("'format': 'exr', 'layers': ['beauty', 'light.0']"),
        WITH("'outputs': [{'name': 'a'}]"),
        WITH("'outputs': [{'name': 'b'}]"),
        WITH("'outputs': [{'name': 'a'}, {'name': 'b'}]"),
    };
    enum { COUNT = sizeof scenes / sizeof scenes[0] };
    char digests[COUNT][33];
    for (size_t i = 0; i < COUNT; i++) {
        reading r = read_scene(scenes[i]);
        strcpy(digests[i], r.scene->digest);
        for (size_t k = 0; k < i; k++)
            if (!strcmp(digests[i], digests[k])) fail_msg("%s is %s", scenes[i], scenes[k]);
        drop(&r);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(syntax_errors_have_line_and_column),
        cmocka_unit_test(long_duplicate_keys_are_named),
        cmocka_unit_test(duplicate_keys_of_backslashes_are_named_at_once),
        cmocka_unit_test(bytes_of_zero_are_syntax_errors),
        cmocka_unit_test(nesting_without_end_is_refused),
        cmocka_unit_test(every_prefix_of_a_document_is_refused),
        cmocka_unit_test(limits_are_named_with_what_was_asked),
        cmocka_unit_test(a_tree_larger_than_the_memory_limit_is_not_made),
        cmocka_unit_test(full_arena_is_a_memory_error),
        cmocka_unit_test(lists_that_are_too_long_are_refused),
        cmocka_unit_test(digest_is_of_what_the_document_says),
        cmocka_unit_test(digest_does_not_change_with_defaults_and_unused_materials),
        cmocka_unit_test(digest_differs_where_scenes_do),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
