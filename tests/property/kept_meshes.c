/* A mesh that is kept, or that objects share, gives the bytes that the same arrays at each object
 * give, in all that is made of a scene, also when it is forgotten meanwhile. */
#include <pthread.h>

#include "assets/store.h"
#include "property/pieces.h"
#include "render/engine.h"

/* A ball with dents, of numbers that floats hold. */
typedef struct ball {
    size_t vertices, indices;
    float *positions, *normals;
    uint32_t *corners;
} ball;

static ball make_ball(int rows, int columns) {
    ball b = {.vertices = (size_t)(rows + 1) * (size_t)(columns + 1)};
    b.positions = malloc(3 * b.vertices * sizeof(float));
    b.normals = malloc(3 * b.vertices * sizeof(float));
    b.corners = malloc(6 * (size_t)rows * (size_t)columns * sizeof(uint32_t));
    assert_true(b.positions && b.normals && b.corners);
    for (size_t i = 0; i < b.vertices; i++) {
        const double down = 3.14159 * (double)(i / (size_t)(columns + 1)) / rows,
                     round = 6.28318 * (double)(i % (size_t)(columns + 1)) / columns,
                     r = 1 + 0.1 * sin(5 * round) * sin(down);
        const double n[3] = {sin(down) * sin(round), cos(down), sin(down) * cos(round)};
        for (int c = 0; c < 3; c++) {
            b.normals[3 * i + (size_t)c] = (float)n[c];
            b.positions[3 * i + (size_t)c] = (float)(r * n[c]);
        }
    }
    for (uint32_t r = 0; r < (uint32_t)rows; r++)
        for (uint32_t c = 0; c < (uint32_t)columns; c++) {
            const uint32_t i = r * (uint32_t)(columns + 1) + c, below = i + (uint32_t)columns + 1;
            const uint32_t two[6] = {i, below, below + 1, i, below + 1, i + 1};
            memcpy(b.corners + b.indices, two, sizeof two);
            b.indices += 6;
        }
    return b;
}

static void drop_ball(ball *b) {
    free(b->positions);
    free(b->normals);
    free(b->corners);
}

/* The members of an object. */
static char *arrays_of(const ball *b, bool normals) {
    char *text = NULL;
    size_t size;
    FILE *out = open_memstream(&text, &size);
    assert_non_null(out);
    for (int k = 0; k < (normals ? 2 : 1); k++) {
        fprintf(out, "%s\"%s\":[", k ? "," : "", k ? "normals" : "positions");
        for (size_t i = 0; i < 3 * b->vertices; i++)
            fprintf(out, "%s%.17g", i ? "," : "", (double)(k ? b->normals : b->positions)[i]);
        fputc(']', out);
    }
    fputs(",\"indices\":[", out);
    for (size_t i = 0; i < b->indices; i++) fprintf(out, "%s%u", i ? "," : "", b->corners[i]);
    fputc(']', out);
    fclose(out);
    return text;
}

static unsigned char *bytes_of(const ball *b, bool normals, size_t *size) {
    const uint32_t head[3] = {(uint32_t)b->vertices, (uint32_t)b->indices, normals};
    const size_t floats = 3 * b->vertices * sizeof(float), last = b->indices * sizeof(uint32_t);
    *size = sizeof head + floats * (normals ? 2 : 1) + last;
    unsigned char *bytes = malloc(*size), *end = bytes;
    assert_non_null(bytes);
    end = (unsigned char *)memcpy(end, head, sizeof head) + sizeof head;
    end = (unsigned char *)memcpy(end, b->positions, floats) + floats;
    if (normals) end = (unsigned char *)memcpy(end, b->normals, floats) + floats;
    memcpy(end, b->corners, last);
    return bytes;
}

static shd_engine *engine_with(size_t reuse, size_t store) {
    shd_engine_options options = shd_engine_defaults();
    options.threads = 2;
    options.reuse = reuse;
    options.mesh_store = store;
    shd_engine *engine = NULL;
    shd_error error;
    assert_int_equal(shd_engine_new(&options, &engine, &error), SHD_OK);
    return engine;
}

static shd_status keep(shd_engine *engine, const void *data, size_t size, bool binary,
                       const char *client, char name[96]) {
    const shd_digest digest = shd_digest_of(data, size);
    char digits[SHD_DIGEST_TEXT];
    shd_request *request;
    shd_error error;
    bool known;
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    const shd_status status =
        shd_request_keep_mesh(request, data, size, binary, &digest, client, &known);
    shd_request_drop(request);
    shd_digest_write(&digest, digits);
    snprintf(name, 96, "\"data\":\"sha256-%s\"", digits);
    return status;
}

/* Objects of one mesh, as `how` says. */
static char *scene_of(const char *mesh, const char *how) {
    return text_of("{\"image\": {\"width\": 90, \"height\": 70, \"samples\": 2}, \"lights\": "
                   "[{\"type\": \"point\", \"position\": [2, 3, 4]}, {\"type\": \"directional\", "
                   "\"direction\": [-1, 0, -1], \"color\": [0.2, 0.3, 0.4]}], %s \"objects\": "
                   "[{\"type\": \"mesh\", %s, \"material\": {\"diffuse\": [0.7, 0.4, 0.2], "
                   "\"specular\": 0.3}}, {\"type\": \"mesh\", %s, \"transform\": {\"rotate\": [20, "
                   "30, 40], \"scale\": [0.5, 0.7, -0.4], \"translate\": [1.2, 0.5, 0.5]}}]}",
                   how, mesh, mesh);
}

static const char *const ways[] = {
    "",
    "\"accuracy\": {\"tier\": \"exact\"},",
    "\"accuracy\": {\"maxError\": 0.5},",
    "\"interpolation\": \"flat\",",
    "\"interpolation\": \"gouraud\",",
    "\"camera\": {\"type\": \"orthographic\", \"height\": 3},",
    "\"camera\": {\"position\": [0.3, 0.2, 0.4], \"target\": [1, 1, 1]},",
    "\"output\": {\"format\": \"tiff\", \"bitDepth\": \"float\"},"};

/* Leaves out lines of times: there are trees over what is kept already. */
static void drop_times(char *text) {
    char *to = text;
    for (const char *line = text; *line;) {
        const size_t text_size = strcspn(line, "\n"), size = text_size + (line[text_size] != 0);
        const char *time = strstr(line, " ms ");
        if (!time || time >= line + size) {
            memmove(to, line, size);
            to += size;
        }
        line += size;
    }
    *to = 0;
}

/* What explain tells, but for times and what it is called by. */
static char *words_of(shd_engine *engine, const char *json) {
    shd_request *request = read_scene(engine, json);
    shd_error error;
    char *text = NULL;
    assert_int_equal(shd_request_explain(request, SHD_IN_WORDS, &text, &error), SHD_OK);
    shd_request_drop(request);
    drop_times(text);
    return text;
}

static void kept_meshes_look_the_same(void **state) {
    (void)state;
    ball b = make_ball(50, 60); /* many enough triangles for what plans find to be kept, too */
    for (int normals = 0; normals < 2; normals++) {
        shd_engine *keeps = engine_with((size_t)64 << 20, (size_t)64 << 20),
                   *plain = engine_with(0, 0);
        char *arrays = arrays_of(&b, normals), names[2][96];
        size_t size;
        unsigned char *bytes = bytes_of(&b, normals, &size);
        char *document = text_of("{%s}", arrays);
        assert_int_equal(keep(keeps, bytes, size, true, "a", names[0]), SHD_OK);
        assert_int_equal(keep(keeps, document, strlen(document), false, "a", names[1]), SHD_OK);
        for (size_t i = 0; i < sizeof ways / sizeof ways[0]; i++) {
            char *inlined = scene_of(arrays, ways[i]);
            file expected = png_of(plain, inlined);
            char *told = words_of(plain, inlined);
            for (int k = 0; k < 4; k++) { /* each twice: made, and found */
                char *named = scene_of(names[k / 2], ways[i]);
                file got = png_of(keeps, named);
                if (!same_file(expected, got)) fail_msg("way %zu, name %d", i, k);
                char *words = words_of(keeps, named);
                assert_string_equal(words, told);
                free(words);
                free(got.data);
                free(named);
            }
            char *entry = text_of("\"meshes\": {\"ball\": {%s}}, %s", arrays, ways[i]),
                 *shared = scene_of("\"mesh\": \"ball\"", entry);
            for (int k = 0; k < 2; k++) {
                file got = png_of(keeps, shared);
                if (!same_file(expected, got)) fail_msg("way %zu, shared", i);
                free(got.data);
            }
            char *words = words_of(keeps, shared);
            assert_string_equal(words, told);
            free(words);
            free(shared);
            free(entry);
            free(told);
            free(expected.data);
            free(inlined);
        }
        free(bytes);
        free(document);
        free(arrays);
        shd_engine_drop(keeps);
        shd_engine_drop(plain);
    }
    drop_ball(&b);
}

static void a_scene_keeps_its_mesh_alive(void **state) {
    (void)state;
    ball b = make_ball(12, 16);
    shd_engine *engine = engine_with(0, (size_t)16 << 20);
    char *arrays = arrays_of(&b, true), name[96];
    size_t size;
    unsigned char *bytes = bytes_of(&b, true, &size);
    assert_int_equal(keep(engine, bytes, size, true, "a", name), SHD_OK);
    char *inlined = scene_of(arrays, ""), *named = scene_of(name, "");
    file expected = png_of(engine, inlined);
    shd_request *request = read_scene(engine, named);
    shd_store_shrink(engine->store, 0);
    assert_int_equal(shd_engine_meshes(engine).bytes, 0);
    assert_true(shd_engine_meshes(engine).held > 0);
    shd_error error;
    assert_int_equal(shd_request_render(request, NULL, &error), SHD_OK);
    size_t count;
    const shd_picture *picture = shd_request_pictures(request, &count);
    assert_true(same_file(expected, (file){picture->data, picture->size}));
    shd_request_drop(request);
    assert_int_equal(shd_engine_meshes(engine).held, 0);
    free(expected.data);
    free(inlined);
    free(named);
    free(bytes);
    free(arrays);
    shd_engine_drop(engine);
    drop_ball(&b);
}

/* What is held for a picture is part of its memory. */
static void held_meshes_count(void **state) {
    (void)state;
    ball b = make_ball(60, 60);
    shd_engine *engine = engine_with(0, (size_t)64 << 20);
    size_t size;
    unsigned char *bytes = bytes_of(&b, true, &size);
    char name[96];
    assert_int_equal(keep(engine, bytes, size, true, "a", name), SHD_OK);
    shd_engine_options options = shd_engine_defaults();
    options.limits.memory = shd_engine_meshes(engine).bytes;
    shd_engine *renewed = NULL;
    shd_error error;
    assert_int_equal(shd_engine_renew(engine, &options, &renewed, &error), SHD_OK);
    shd_request *request;
    assert_int_equal(shd_request_new(renewed, &request, &error), SHD_OK);
    char *named = scene_of(name, "");
    assert_int_equal(shd_request_read(request, named, strlen(named), SHD_PNG), SHD_LIMIT);
    assert_non_null(strstr(shd_request_report(request)->errors[0].detail, "kept meshes"));
    shd_request_drop(request);
    shd_engine_drop(renewed);
    free(named);
    free(bytes);
    shd_engine_drop(engine);
    drop_ball(&b);
}

/* ---- Threads ---- */

typedef struct worker {
    shd_engine *engine;
    const unsigned char *bytes;
    size_t size;
    file expected;
    int number;
    int same, missing;
} worker;

/* Puts a mesh, names it, and puts it again where it was forgotten in between. */
static void *work(void *context) {
    worker *w = context;
    char name[96], client[8];
    snprintf(client, sizeof client, "c%d", w->number);
    for (int i = 0; i < 12; i++) {
        if (keep(w->engine, w->bytes, w->size, true, client, name) != SHD_OK) break;
        if ((i + w->number) % 3 == 0) shd_store_shrink(w->engine->store, 0);
        char *named = scene_of(name, i % 2 ? "" : "\"ambient\": 0.125,");
        shd_request *request;
        shd_error error;
        if (shd_request_new(w->engine, &request, &error) != SHD_OK) break;
        const shd_status status = shd_request_read(request, named, strlen(named), SHD_PNG);
        if (status == SHD_MISSING) {
            w->missing++;
        } else if (status == SHD_OK && !shd_request_render(request, NULL, &error)) {
            size_t count;
            const shd_picture *p = shd_request_pictures(request, &count);
            w->same += i % 2 == 0 || same_file(w->expected, (file){p->data, p->size});
        }
        shd_request_drop(request);
        free(named);
    }
    return NULL;
}

static void meshes_come_and_go_amid_pictures(void **state) {
    (void)state;
    ball b = make_ball(10, 12);
    shd_engine *engine = engine_with((size_t)8 << 20, (size_t)4 << 20);
    char *arrays = arrays_of(&b, true), *inlined = scene_of(arrays, "");
    size_t size;
    unsigned char *bytes = bytes_of(&b, true, &size);
    file expected = png_of(engine, inlined);
    worker workers[4];
    pthread_t threads[4];
    for (int i = 0; i < 4; i++) {
        workers[i] = (worker){engine, bytes, size, expected, i, 0, 0};
        assert_int_equal(pthread_create(&threads[i], NULL, work, &workers[i]), 0);
    }
    for (int i = 0; i < 4; i++) {
        pthread_join(threads[i], NULL);
        assert_int_equal(workers[i].same + workers[i].missing, 12);
    }
    assert_int_equal(shd_engine_meshes(engine).held, 0);
    free(expected.data);
    free(inlined);
    free(arrays);
    free(bytes);
    shd_engine_drop(engine);
    drop_ball(&b);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(kept_meshes_look_the_same),
        cmocka_unit_test(a_scene_keeps_its_mesh_alive),
        cmocka_unit_test(held_meshes_count),
        cmocka_unit_test(meshes_come_and_go_amid_pictures),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
