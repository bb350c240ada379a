/* A request's memory has a cap: under it a picture, over it an answer that says so, and between
 * them nothing else. */
#include "property/pieces.h"
#include "render/planning.h"
#include "render/tell/estimate.h"
#include "render/tiles/film.h"
#include "render/tiles/tile_scratch.h"

/* What is asked of arenas, in their alignment: the linker puts these before the library's own. */
static uint64_t asked;

void *__real_shd_arena_alloc(shd_arena *arena, size_t count, size_t size);
void *__real_shd_arena_zalloc(shd_arena *arena, size_t count, size_t size);
void *__wrap_shd_arena_alloc(shd_arena *arena, size_t count, size_t size);
void *__wrap_shd_arena_zalloc(shd_arena *arena, size_t count, size_t size);

static void count_bytes(size_t bytes) {
    asked += bytes ? (bytes + 63) / 64 * 64 : 64;
}

void *__wrap_shd_arena_alloc(shd_arena *arena, size_t count, size_t size) {
    count_bytes(count * size);
    return __real_shd_arena_alloc(arena, count, size);
}

void *__wrap_shd_arena_zalloc(shd_arena *arena, size_t count, size_t size) {
    count_bytes(count * size);
    return __real_shd_arena_zalloc(arena, count, size);
}

/* Everything that allocates: meshes, tessellation, layers, two outputs, names. */
static char *scene(int kind) {
    writing w;
    start(&w);
    fprintf(w.out,
            "{\"image\": {\"width\": 40, \"height\": 30, \"samples\": 4}, \"interpolation\": "
            "\"%s\", \"accuracy\": {\"tier\": \"%s\"}, \"lights\": [",
            kind == 1 ? "gouraud" : "phong", kind == 2 ? "exact" : "standard");
    for (int i = 0; i < 20; i++)
        fprintf(w.out, "%s{\"type\": \"point\", \"position\": [%d, 3, 3]}", i ? ", " : "", i - 10);
    fputs("], \"materials\": {\"m\": {\"specular\": 0.5, \"lobes\": [{}, {}]}}, \"objects\": [",
          w.out);
    fputs("{\"type\": \"sphere\", \"material\": \"m\"}, {\"type\": \"torus\", \"segments\": 24}, "
          "{\"type\": \"mesh\", ",
          w.out);
    write_ball(w.out, 24, 12, true);
    fputs("}], ", w.out);
    if (kind == 0)
        fputs("\"output\": {\"format\": \"png\"}}", w.out);
    else if (kind == 3)
        fputs("\"output\": {\"format\": \"exr\", \"layers\": [\"beauty\", \"diffuse\", "
              "\"specular\", \"light.0\", \"normal\", \"position\", \"depth\", \"object\"]}}",
              w.out);
    else
        fputs("\"outputs\": [{\"name\": \"a\", \"format\": \"png\"}, {\"name\": \"b\", \"format\": "
              "\"jpeg\"}]}",
              w.out);
    return finish(&w);
}

static void every_cap_gives_a_picture_or_says_memory(void **state) {
    (void)state;
    shd_engine *engine = new_engine(1);
    const size_t all = (size_t)engine->limits.memory;
    for (int kind = 0; kind < 3; kind++) {
        char *json = scene(kind);
        engine->limits.memory = all;
        file wanted = png_of(engine, json);
        int good = 0, refused_early = 0, refused_read = 0, refused_render = 0;
        size_t fits = 0; /* the first cap that was enough */
        for (double cap = 1024; cap < 64e6; cap *= 1.2) {
            engine->limits.memory = (uint64_t)cap;
            shd_request *request = NULL;
            shd_error error = {.status = SHD_OK};
            assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
            shd_status status = shd_request_read(request, json, strlen(json), SHD_PNG);
            const shd_report *report = shd_request_report(request);
            assert_int_equal(status, report->status);
            if (status != SHD_OK) {
                /* SHD_LIMIT: refused by its estimate, before any work */
                assert_true(status == SHD_MEMORY || status == SHD_LIMIT);
                assert_true(report->error_count > 0);
                assert_non_null(strstr(report->errors[0].detail, "memory"));
                refused_early += status == SHD_LIMIT;
                refused_read++;
                shd_request_drop(request);
                continue;
            }
            status = shd_request_render(request, NULL, &error);
            size_t count;
            const shd_picture *pictures = shd_request_pictures(request, &count);
            assert_true(shd_arena_used(request->rendering.arena) <= (size_t)cap);
            if (status != SHD_OK) {
                assert_true(status == SHD_MEMORY || status == SHD_LIMIT);
                assert_int_equal(error.status, status);
                assert_non_null(strstr(error.text, "memory"));
                refused_render++;
            } else {
                assert_int_equal(count, kind ? 2 : 1);
                assert_true(same_file((file){pictures[0].data, pictures[0].size}, wanted));
                if (!fits) fits = (size_t)cap;
                good++;
            }
            shd_request_drop(request);
        }
        if (getenv("SHADED_MEASURE"))
            printf("read refused %d (%d early), render refused %d, good %d from %zu bytes\n",
                   refused_read, refused_early, refused_render, good, fits);
        assert_true(refused_read > 5 && refused_render > 2 && good > 5);
        free(wanted.data);
        free(json);
    }
    shd_engine_drop(engine);
}

/* Any of them is one. */
static void a_channel_by_itself_is_estimated_alike(void **state) {
    (void)state;
    static const char *const channels[] = {"R", "G", "B"};
    uint64_t estimate[3], all = 0;
    shd_engine *engine = new_engine(1);
    for (int c = 0; c < 4; c++) {
        char json[500];
        snprintf(json, sizeof json, "{\"objects\": [], \"output\": {\"bitDepth\": 16%s%s%s}}",
                 c < 3 ? ", \"channel\": \"" : "", c < 3 ? channels[c] : "", c < 3 ? "\"" : "");
        shd_request *request = NULL;
        shd_error error;
        assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
        assert_int_equal(shd_request_read(request, json, strlen(json), SHD_PNG), SHD_OK);
        *(c < 3 ? &estimate[c] : &all) = shd_estimate_memory(request->scene);
        shd_request_drop(request);
    }
    shd_engine_drop(engine);
    assert_true(estimate[0] == estimate[1] && estimate[1] == estimate[2]);
    assert_int_equal(all - estimate[0], (uint64_t)512 * 512 * 2 * sizeof(uint16_t));
}

/* What is refused before any work would not have fitted; and of a large picture little is left for
 * the cap to find out. The rest is one more copy of the pixels in most encoders, and tiles. */
static void the_estimate_is_below_what_is_taken(void **state) {
    (void)state;
    static const char *const outputs[] = {
        "\"output\": {\"format\": \"png\"}",
        "\"output\": {\"format\": \"png\", \"bitDepth\": 16}",
        "\"output\": {\"format\": \"jpeg\", \"channel\": \"R\"}",
        "\"output\": {\"format\": \"webp\"}",
        "\"output\": {\"format\": \"hdr\"}",
        "\"output\": {\"format\": \"tiff\", \"bitDepth\": \"float\"}",
        "\"output\": {\"format\": \"exr\", \"layers\": [\"beauty\", \"diffuse\", \"light.0\", "
        "\"normal\", \"depth\", \"object\"]}",
        "\"outputs\": [{\"name\": \"a\", \"format\": \"png\"}, {\"name\": \"b\", \"format\": "
        "\"jpeg\"}]"};
    shd_engine *engine = new_engine(1);
    for (size_t i = 0; i < sizeof outputs / sizeof outputs[0]; i++) {
        char json[1000];
        snprintf(
            json, sizeof json,
            "{\"objects\": [], \"lights\": [{\"type\": \"point\"}], \"image\": {\"width\": 1500, "
            "\"height\": 1000, \"samples\": 1}, %s}",
            outputs[i]);
        shd_request *request = NULL;
        shd_error error;
        assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
        assert_int_equal(shd_request_read(request, json, strlen(json), SHD_PNG), SHD_OK);
        double estimate = (double)shd_estimate_memory(request->scene);
        assert_int_equal(shd_request_render(request, NULL, &error), SHD_OK);
        double used = (double)shd_arena_peak(request->rendering.arena);
        assert_below(estimate, used);
        /* Small integers may come from floats, or from the tiles at once. */
        assert_below(used, 3 * (estimate + 1500 * 1000 * 4 * sizeof(float)));
        shd_request_drop(request);
    }
    shd_engine_drop(engine);
}

/* Whether the scene's pictures are made within the cap; or refused, but not by what is known. */
static bool makes_within(shd_engine *engine, const char *json, uint64_t cap, bool *began) {
    engine->limits.memory = cap;
    shd_request *request = NULL;
    shd_error error;
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    shd_status status = shd_request_read(request, json, strlen(json), SHD_PNG);
    *began = status == SHD_OK;
    if (status == SHD_OK) status = shd_request_render(request, NULL, &error);
    *began = *began && status != SHD_LIMIT;
    shd_request_drop(request);
    return status == SHD_OK;
}

/* The smallest cap, to 64 KB, at which the pictures are made, or else not refused by what is known
 * of them. */
static uint64_t least_cap(shd_engine *engine, const char *json, bool made) {
    uint64_t low = 0, high = UINT64_C(1) << 30;
    while (high - low > 64 << 10) {
        const uint64_t cap = low + (high - low) / 2;
        bool began;
        const bool whole = makes_within(engine, json, cap, &began);
        if (made ? whole : began)
            high = cap;
        else
            low = cap;
    }
    return high;
}

#define OF_EIGHT(format)                                                                                         \
    "\"outputs\": [" OUTPUT("a", format) ", " OUTPUT("b", format) ", " OUTPUT(                                   \
        "c",                                                                                                     \
        format) ", " OUTPUT("d",                                                                                 \
                            format) ", " OUTPUT("e",                                                             \
                                                format) ", " OUTPUT("f",                                         \
                                                                    format) ", " OUTPUT("g",                     \
                                                                                        format) ", " OUTPUT("h", \
                                                                                                            format) "]"
#define OUTPUT(name, format) "{\"name\": \"" name "\", \"format\": \"" format "\"}"

/* What is refused for want of memory is refused before a tile is rendered; what is left to be found
 * out later are files, which are small here, and blocks of the arena. */
static void memory_is_known_before_rendering(void **state) {
    (void)state;
    static const char *const outputs[] = {
        OF_EIGHT("hdr"),
        OF_EIGHT("png"),
        OF_EIGHT("jpeg"),
        "\"output\": {\"format\": \"png\", \"bitDepth\": 16}",
        "\"output\": {\"format\": \"webp\"}",
        "\"output\": {\"format\": \"tiff\", \"bitDepth\": \"float\"}",
        "\"background\": null, \"output\": {\"format\": \"png\", \"view\": \"Standard\"}",
        "\"output\": {\"format\": \"exr\", \"layers\": [\"beauty\", \"emissive\", \"ambient\", "
        "\"diffuse\", \"specular\", \"normal\", \"position\", \"depth\", \"object\", \"light.0\", "
        "\"light.1\", \"light.2\", \"light.3\", \"light.4\", \"light.5\", \"light.6\", "
        "\"light.7\", "
        "\"light.8\", \"light.9\", \"light.10\"]}"};
    shd_engine *engine = new_engine(1);
    for (size_t i = 0; i < sizeof outputs / sizeof outputs[0]; i++) {
        writing w;
        start(&w);
        fputs("{\"objects\": [], \"image\": {\"width\": 700, \"height\": 500, \"samples\": 1}, "
              "\"lights\": [",
              w.out);
        for (int l = 0; l < 11; l++) fprintf(w.out, "%s{\"type\": \"point\"}", l ? ", " : "");
        fprintf(w.out, "], %s}", outputs[i]);
        char *json = finish(&w);
        const double begins = (double)least_cap(engine, json, false),
                     makes = (double)least_cap(engine, json, true);
        if (getenv("SHADED_MEASURE"))
            printf("known %zu: begins with %.0f, makes with %.0f bytes\n", i, begins, makes);
        assert_below(makes, 1.05 * begins + (4 << 20));
        free(json);
    }
    shd_engine_drop(engine);
}

/* Objects that are lit by three lights, with what makes threads' working memory large. */
static char *many(int materials, int lobes, int samples, const char *more) {
    writing w;
    start(&w);
    fprintf(w.out, "{\"image\": {\"width\": 100, \"height\": 70, \"samples\": %d}, ", samples);
    fputs("\"lights\": [{\"position\": [1, 2, 3, 1]}, {\"position\": [3, 2, 1, 1]}, {\"position\": "
          "[-1, 2, 3, 1], \"color\": [1, 0.5, 0]}], \"objects\": [",
          w.out);
    for (int m = 0; m < materials; m++) {
        fprintf(w.out,
                "%s{\"type\": \"sphere\", \"transform\": {\"translate\": [%d, %d, 0]}, "
                "\"material\": {\"diffuse\": 0.%d, \"specular\": 0.5, \"lobes\": [",
                m ? ", " : "", m % 10 - 5, m / 10 - 5, m + 10);
        for (int l = 1; l < lobes; l++)
            fprintf(w.out, "%s{\"specular\": 0.1, \"shininess\": %d}", l > 1 ? ", " : "", l);
        fputs("]}}", w.out);
    }
    fprintf(w.out, "], %s}", more);
    return finish(&w);
}

#define LAYERS                                                                                     \
    "\"output\": {\"format\": \"exr\", \"layers\": [\"diffuse\", \"specular\", \"ambient\", "      \
    "\"light.0\", \"light.1\", \"light.2\", \"normal\", \"position\", \"depth\", \"object\"]}"

static const struct {
    int materials, lobes, samples;
    const char *more;
} workings[] = {
    {1, 1, 1, "\"output\": {\"format\": \"png\"}"},
    {1, 1, 4, "\"output\": {\"format\": \"png\"}"},
    {1, 1, 64, "\"output\": {\"format\": \"exr\"}"},
    {1, 16, 4, "\"output\": {\"format\": \"jpeg\"}"},
    {90, 1, 64, "\"output\": {\"format\": \"png\"}"},
    {90, 16, 64, LAYERS},
    {5, 3, 16, "\"accuracy\": {\"tier\": \"exact\"}, " LAYERS},
    {5, 3, 1, "\"accuracy\": {\"tier\": \"exact\"}"},
    {20, 2, 9, "\"interpolation\": \"gouraud\", " LAYERS},
    {20, 2, 16, "\"accuracy\": {\"maxError\": 1}"},
};

static void what_threads_work_in_is_known_before(void **state) {
    (void)state;
    shd_engine *engine = new_engine(1);
    engine->limits.memory = UINT64_C(4) << 30;
    for (size_t i = 0; i < sizeof workings / sizeof workings[0]; i++) {
        char *json =
            many(workings[i].materials, workings[i].lobes, workings[i].samples, workings[i].more);
        shd_request *request = NULL;
        shd_error error;
        assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
        assert_int_equal(shd_request_read(request, json, strlen(json), SHD_PNG), SHD_OK);
        assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error), SHD_OK);
        const shd_plan *plan = request->rendering.plan;
        shd_sight *sight;
        assert_int_equal(shd_sight_new(plan, NULL, request->rendering.arena, &sight, &error),
                         SHD_OK);
        shd_scratch counted = {.arena = NULL}, taken = {.arena = request->rendering.arena};
        assert_null(shd_tile_scratch_lay_out(plan, &counted));
        asked = 0;
        assert_non_null(shd_tile_scratch_lay_out(plan, &taken));
        if (getenv("SHADED_MEASURE")) printf("scratch %zu: %.0f bytes taken\n", i, (double)asked);
        assert_int_equal(asked, counted.bytes);
        assert_true(shd_film_scratch_size(plan) > counted.bytes);

        /* All that is taken while it is rendered, by the two threads that may, is known as well,
         * but for outputs, whose estimate is below it. */
        asked = 0;
        shd_film film = {0};
        assert_int_equal(shd_film_render(&request->rendering, sight, NULL, NULL, &film, &error),
                         SHD_OK);
        const double pixels = 100 * 70 * 4 * sizeof(float) * (double)(plan->plane_count + 3);
        assert_true((double)asked <= 2 * (double)shd_film_scratch_size(plan) + pixels + 1e6);
        shd_request_drop(request);
        free(json);
    }
    shd_engine_drop(engine);
}

/* However many threads come to help: that is decided before any of them does. */
static void threads_without_memory_are_refused_before_rendering(void **state) {
    (void)state;
    shd_engine *engine = new_engine(3);
    char *json = many(20, 16, 64, LAYERS);
    shd_request *request = NULL;
    shd_error error;
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    assert_int_equal(shd_request_read(request, json, strlen(json), SHD_PNG), SHD_OK);
    assert_int_equal(shd_rendering_plan(&request->rendering, request->scene, &error), SHD_OK);
    const uint64_t one = shd_film_scratch_size(request->rendering.plan);
    shd_request_drop(request);
    for (unsigned threads = 3; threads < 7; threads += 3) {
        engine->limits.memory = threads * one + (one / 2);
        assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
        assert_int_equal(shd_request_read(request, json, strlen(json), SHD_PNG), SHD_OK);
        asked = 0;
        const shd_status status = shd_request_render(request, NULL, &error);
        /* Three workers and this thread, of which a block of the arena may be lost to each. */
        if (threads < 4) {
            assert_int_equal(status, SHD_LIMIT);
            assert_string_equal(error.path, "/image");
            assert_non_null(strstr(error.text, "on 4 threads"));
            assert_true(asked < one / 4);
        } else {
            assert_int_equal(status, SHD_OK);
        }
        shd_request_drop(request);
    }
    free(json);
    shd_engine_drop(engine);
}

static void memory_is_refused_before_rendering(void **state) {
    (void)state;
    shd_engine *engine = new_engine(1);
    engine->limits.memory = 10 << 20;
    const char *json = "{\"objects\": [], \"image\": {\"width\": 1000, \"height\": 1000}, "
                       "\"output\": {\"format\": \"exr\"}}";
    shd_request *request = NULL;
    shd_error error;
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    assert_int_equal(shd_request_read(request, json, strlen(json), SHD_PNG), SHD_LIMIT);
    const shd_problem *problem = &shd_request_report(request)->errors[0];
    assert_string_equal(problem->pointer, "/image");
    assert_non_null(strstr(problem->detail, "the limit `memory` is 10485760"));
    shd_request_drop(request);
    shd_engine_drop(engine);
}

static void a_refused_picture_gives_no_file(void **state) {
    (void)state;
    shd_engine *engine = new_engine(1);
    shd_error error = {.status = SHD_OK};
    for (int kind = 0; kind < 4; kind += 3) {
        char *json = scene(kind);
        int refused = 0;
        /* Steps finer than the arena's smallest block: each place that can fail does so. */
        for (uint64_t cap = 200 * 1024; cap < 4096 * 1024; cap += 24 * 1024) {
            engine->limits.memory = cap;
            shd_request *request = NULL;
            assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
            if (shd_request_read(request, json, strlen(json), SHD_PNG) == SHD_OK &&
                shd_request_render(request, NULL, &error) != SHD_OK) {
                assert_true(error.status == SHD_MEMORY || error.status == SHD_LIMIT);
                size_t count;
                const shd_picture *pictures = shd_request_pictures(request, &count);
                for (size_t i = 0; i < count; i++) assert_null(pictures[i].data);
                refused++;
            }
            shd_request_drop(request);
        }
        assert_true(refused > 5);
        free(json);
    }
    shd_engine_drop(engine);
}

static void one_request_out_of_memory_does_not_harm_the_next(void **state) {
    (void)state;
    shd_engine *engine = new_engine(2);
    const uint64_t all = engine->limits.memory;
    char *json = scene(1);
    file before = png_of(engine, json), none;
    engine->limits.memory = 300 * 1024;
    for (int i = 0; i < 20; i++) assert_int_equal(try_png_of(engine, json, &none), SHD_LIMIT);
    engine->limits.memory = all;
    file after = png_of(engine, json);
    assert_true(same_file(before, after));
    free(before.data);
    free(after.data);
    free(json);
    shd_engine_drop(engine);
}

static void *take_spare(shd_spares *spares, size_t size) {
    void *kept = shd_spares_find(spares, size);
    return kept ? kept : shd_spares_make(size);
}

/* Fills whatever earlier requests left with bytes that are NaN, true and out of range. */
static void paint_spares(shd_spares *spares) {
    enum { MOST = 4096 };
    static struct {
        void *at;
        size_t size;
    } taken[MOST];
    size_t count = 0;
    for (size_t size = 64 * 1024; size < 64u << 20; size += size / 16) {
        size_t before;
        do {
            before = shd_spares_kept(spares);
            assert_true(count < MOST);
            taken[count].at = take_spare(spares, size);
            taken[count].size = size;
            assert_non_null(taken[count].at);
            memset(taken[count++].at, 255, size);
        } while (shd_spares_kept(spares) < before);
    }
    assert_int_equal(shd_spares_kept(spares), 0);
    while (count--) shd_spares_give(spares, taken[count].at, taken[count].size);
}

static void used_memory_gives_the_pictures_of_new_memory(void **state) {
    (void)state;
    for (unsigned threads = 1; threads < 3; threads++)
        for (int kind = 0; kind < 3; kind++) {
            shd_engine *engine = new_engine(threads);
            char *json = scene(kind);
            file before = png_of(engine, json);
            assert_true(shd_spares_kept(engine->spares) > 0);
            paint_spares(engine->spares);
            file after = png_of(engine, json);
            assert_true(same_file(before, after));
            free(before.data);
            free(after.data);
            free(json);
            shd_engine_drop(engine);
        }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(every_cap_gives_a_picture_or_says_memory),
        cmocka_unit_test(a_channel_by_itself_is_estimated_alike),
        cmocka_unit_test(the_estimate_is_below_what_is_taken),
        cmocka_unit_test(what_threads_work_in_is_known_before),
        cmocka_unit_test(threads_without_memory_are_refused_before_rendering),
        cmocka_unit_test(memory_is_refused_before_rendering),
        cmocka_unit_test(memory_is_known_before_rendering),
        cmocka_unit_test(a_refused_picture_gives_no_file),
        cmocka_unit_test(one_request_out_of_memory_does_not_harm_the_next),
        cmocka_unit_test(used_memory_gives_the_pictures_of_new_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
