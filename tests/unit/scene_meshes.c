/* Meshes by themselves, in JSON and as plain numbers. */
#include "unit/scene_support.h"

/* ---- Plain numbers ---- */

typedef struct plain {
    uint32_t words[64];
    size_t count;
} plain;

static void add_word(plain *p, uint32_t word) {
    p->words[p->count++] = word;
}

static void add_floats(plain *p, const float *values, size_t count) {
    memcpy(p->words + p->count, values, count * sizeof *values);
    p->count += count;
}

static const float corners[] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0.1f};
static const float fronts[] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0.5f, 0, 2};
static const uint32_t indices[] = {0, 1, 2, 2, 1, 3};

/* Two triangles; with `flags` 1 their normals follow. */
static plain two_triangles(uint32_t flags) {
    plain p = {.count = 0};
    add_word(&p, 4);
    add_word(&p, 6);
    add_word(&p, flags);
    add_floats(&p, corners, 12);
    if (flags & 1) add_floats(&p, fronts, 12);
    for (int i = 0; i < 6; i++) add_word(&p, indices[i]);
    return p;
}

typedef struct mesh_reading {
    shd_arena *arena;
    shd_report report;
    const shd_mesh *mesh;
} mesh_reading;

static mesh_reading read_mesh(const void *data, size_t size, bool binary,
                              const shd_limits *limits) {
    mesh_reading out = {.arena = shd_arena_new(limits->memory)};
    assert_non_null(out.arena);
    shd_report_init(&out.report, out.arena);
    /* Not a byte beyond it may be read. */
    void *copy = malloc(size ? size : 1);
    assert_non_null(copy);
    if (size) memcpy(copy, data, size);
    const shd_status status =
        shd_mesh_read(copy, size, binary, limits, NULL, out.arena, &out.mesh, &out.report);
    free(copy);
    assert_int_equal(status, out.report.status);
    assert_int_equal(status == SHD_OK, out.mesh != NULL);
    return out;
}

static mesh_reading read_plain(const plain *p, size_t bytes) {
    return read_mesh(p->words, bytes, true, &scene_limits);
}

static mesh_reading read_text(const char *text) {
    char quoted[4096];
    assert_true(strlen(text) < sizeof quoted);
    strcpy(quoted, text);
    for (char *c = quoted; *c; c++)
        if (*c == '\'') *c = '"';
    return read_mesh(quoted, strlen(quoted), false, &scene_limits);
}

static void assert_wrong(mesh_reading r, shd_status status, const char *pointer,
                         const char *words) {
    assert_int_equal(r.report.status, status);
    if (!has_problem(r.report.errors, shd_report_errors_kept(&r.report), pointer, words))
        fail_msg("no '%s' at '%s', but '%s' at '%s'", words, pointer, r.report.errors[0].detail,
                 r.report.errors[0].pointer);
    shd_arena_drop(r.arena);
}

static void plain_numbers_are_the_same_mesh_as_json(void **state) {
    (void)state;
    const plain p = two_triangles(1);
    mesh_reading a = read_plain(&p, 4 * p.count);
    mesh_reading b =
        read_text("{'positions': [0,0,0, 1,0,0, 0,1,0, 1,1,0.100000001490116119384765625],"
                  "'normals': [0,0,1, 0,0,1, 0,0,1, 0.5,0,2], 'indices': [0,1,2, 2,1,3]}");
    assert_non_null(a.mesh);
    assert_non_null(b.mesh);
    assert_int_equal(a.mesh->vertex_count, 4);
    assert_int_equal(a.mesh->triangle_count, 2);
    assert_memory_equal(a.mesh->positions, b.mesh->positions, 12 * sizeof(double));
    assert_memory_equal(a.mesh->normals, b.mesh->normals, 12 * sizeof(double));
    assert_memory_equal(a.mesh->indices, b.mesh->indices, 6 * sizeof(uint32_t));
    assert_memory_equal(a.mesh->indices, indices, sizeof indices);
    assert_vec(a.mesh->high, 1, 1, (double)0.1f);
    assert_null(a.mesh->kept);
    shd_arena_drop(a.arena);
    shd_arena_drop(b.arena);
}

static void without_indices_three_vertices_are_a_triangle(void **state) {
    (void)state;
    plain p = {.count = 0};
    add_word(&p, 3);
    add_word(&p, 0);
    add_word(&p, 0);
    add_floats(&p, corners, 9);
    mesh_reading r = read_plain(&p, 4 * p.count);
    assert_non_null(r.mesh);
    assert_int_equal(r.mesh->triangle_count, 1);
    assert_null(r.mesh->normals);
    shd_arena_drop(r.arena);
}

/* Every length but the right one, of every prefix. */
static void a_body_is_as_long_as_its_counts_say(void **state) {
    (void)state;
    for (uint32_t flags = 0; flags < 2; flags++) {
        plain p = two_triangles(flags);
        const size_t right = 4 * p.count;
        add_word(&p, 0);
        for (size_t bytes = 0; bytes <= right + 4; bytes++) {
            mesh_reading r = read_plain(&p, bytes);
            if (bytes == right) {
                assert_non_null(r.mesh);
                shd_arena_drop(r.arena);
            } else {
                assert_wrong(r, SHD_SCENE, "", bytes < 12 ? "begins with 12 bytes" : "there are");
            }
        }
    }
}

/* Nothing is taken for what counts only promise, and no product of them overflows. */
static void counts_may_promise_anything(void **state) {
    (void)state;
    static const uint32_t counts[] = {0,          1,          3,          0x15555555, 0x15555556,
                                      0x40000000, 0x55555556, 0x7fffffff, 0x80000000, 0xffffffff};
    for (size_t i = 0; i < 10; i++)
        for (size_t k = 0; k < 10; k++) {
            if (counts[i] == 3 && counts[k] == 0) continue; /* one triangle */
            plain p = {.count = 0};
            add_word(&p, counts[i]);
            add_word(&p, counts[k]);
            add_word(&p, 0);
            add_floats(&p, corners, 9);
            mesh_reading r = read_plain(&p, 4 * p.count);
            assert_wrong(r, SHD_SCENE, "", "there are 48");
        }
    plain none = {.count = 3};
    assert_wrong(read_plain(&none, 12), SHD_SCENE, "/positions", "in threes, got 0");
}

static void flags_are_known_ones(void **state) {
    (void)state;
    plain p = two_triangles(0);
    p.words[2] = 2;
    assert_wrong(read_plain(&p, 4 * p.count), SHD_SCENE, "", "4 vertices with uvs and 6 indices");
    p.words[2] = 3;
    assert_wrong(read_plain(&p, 4 * p.count), SHD_SCENE, "", "with normals and uvs and");
    p.words[2] = 4;
    assert_wrong(read_plain(&p, 4 * p.count), SHD_SCENE, "", "the flags are 4");
    p.words[2] = 0x80000000;
    assert_wrong(read_plain(&p, 4 * p.count), SHD_SCENE, "", "flags are 2147483648");
}

static void uvs_come_between_normals_and_indices(void **state) {
    (void)state;
    static const float uvs[8] = {0, 0, 1, 0, 1, 1, 0, 1};
    for (uint32_t normals = 0; normals < 2; normals++) {
        plain p = two_triangles(normals);
        const size_t at = p.count - 6;
        uint32_t last[6];
        memcpy(last, p.words + at, sizeof last);
        p.count = at;
        p.words[2] |= 2;
        add_floats(&p, uvs, 8);
        for (int i = 0; i < 6; i++) add_word(&p, last[i]);
        mesh_reading r = read_plain(&p, 4 * p.count);
        assert_int_equal(r.report.status, SHD_OK);
        assert_non_null(r.mesh->uvs);
        for (int i = 0; i < 8; i++) assert_true(r.mesh->uvs[i] == (double)uvs[i]);
        assert_true((r.mesh->normals != NULL) == (normals != 0));
        for (int i = 0; i < 6; i++) assert_int_equal(r.mesh->indices[i], last[i]);
        shd_arena_drop(r.arena);
        p.words[at + 3] = 0x7fc00000;
        assert_wrong(read_plain(&p, 4 * p.count), SHD_SCENE, "/uvs/3", "not finite");
    }
}

static void numbers_are_pointed_to(void **state) {
    (void)state;
    static const uint32_t not_finite[] = {0x7fc00000, 0x7f800000, 0xff800000, 0x7f800001};
    for (int i = 0; i < 4; i++) {
        plain p = two_triangles(1);
        p.words[3 + 5] = not_finite[i];
        assert_wrong(read_plain(&p, 4 * p.count), SHD_SCENE, "/positions/5", "byte 32");
        p = two_triangles(1);
        p.words[3 + 12 + 7] = not_finite[i];
        assert_wrong(read_plain(&p, 4 * p.count), SHD_SCENE, "/normals/7", "byte 88");
    }
    plain p = two_triangles(1);
    for (int i = 0; i < 24; i++) p.words[3 + i] = 0x7fc00000;
    mesh_reading all = read_plain(&p, 4 * p.count);
    assert_int_equal(all.report.error_count, 8);
    assert_wrong(all, SHD_SCENE, "/normals", "9 more");
    p = two_triangles(1);
    p.words[3 + 24 + 4] = 4;
    assert_wrong(read_plain(&p, 4 * p.count), SHD_SCENE, "/indices/4", "from 0 to 3, got 4");
    p.words[3 + 24 + 4] = 0xffffffff;
    assert_wrong(read_plain(&p, 4 * p.count), SHD_SCENE, "/indices/4", "got 4.29496");
    p = two_triangles(1);
    p.words[3 + 12 + 2] = 0x80000000; /* the first normal is 0, 0, -0 */
    assert_wrong(read_plain(&p, 4 * p.count), SHD_SCENE, "/normals/0", "is zero");
    p = two_triangles(0);
    p.words[1] = 5;
    assert_wrong(read_plain(&p, 4 * p.count - 4), SHD_SCENE, "/indices", "in threes, got 5");
}

static void meshes_have_limits(void **state) {
    (void)state;
    shd_limits limits = scene_limits;
    const plain p = two_triangles(0);
    limits.triangles = 1;
    assert_wrong(read_mesh(p.words, 4 * p.count, true, &limits), SHD_LIMIT, "",
                 "2 triangles; the limit `triangles` is 1");
    limits = scene_limits;
    limits.memory = 128;
    mesh_reading r = read_mesh(p.words, 4 * p.count, true, &limits);
    assert_int_equal(r.report.status, SHD_MEMORY);
    shd_arena_drop(r.arena);
}

static void meshes_in_json_are_told_what_is_wrong(void **state) {
    (void)state;
    assert_wrong(read_text(""), SHD_SYNTAX, "", "empty");
    assert_wrong(read_text("{'positions': [0,0,0}"), SHD_SYNTAX, "", "line 1");
    assert_wrong(read_text("[1, 2]"), SHD_SCENE, "", "expected an object");
    assert_wrong(read_text("{}"), SHD_SCENE, "", "\"positions\" is missing");
    assert_wrong(read_text("{'indices': [0, 1, 2]}"), SHD_SCENE, "", "\"positions\" is missing");
    assert_wrong(read_text("{'positions': [0,0,0, 1,0,0, 0,1,0], 'uvs': [0,0, 1,0, 0]}"), SHD_SCENE,
                 "/uvs", "in twos, got 5");
    assert_wrong(read_text("{'positions': [0,0,0, 1,0,0, 0,1,0], 'uvs': [0,0, 1,0]}"), SHD_SCENE,
                 "/uvs", "two uvs a vertex, 6 numbers, got 4");
    assert_wrong(read_text("{'positions': [0,0,0, 1,0,0, 0,1,0], 'uvs': [0,0, 1,0, 0,null]}"),
                 SHD_SCENE, "/uvs/5", "a number");
    assert_wrong(read_text("{'positions': [0,0,0, 1,0,0, 0,1,0], 'indices': [0,1,3]}"), SHD_SCENE,
                 "/indices/2", "got 3");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(plain_numbers_are_the_same_mesh_as_json),
        cmocka_unit_test(without_indices_three_vertices_are_a_triangle),
        cmocka_unit_test(a_body_is_as_long_as_its_counts_say),
        cmocka_unit_test(counts_may_promise_anything),
        cmocka_unit_test(flags_are_known_ones),
        cmocka_unit_test(uvs_come_between_normals_and_indices),
        cmocka_unit_test(numbers_are_pointed_to),
        cmocka_unit_test(meshes_have_limits),
        cmocka_unit_test(meshes_in_json_are_told_what_is_wrong),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
