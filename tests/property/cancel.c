/* Whoever is cancelled leaves soon, at whatever moment: documents that keep one stage busy, each
 * cancelled at the first look at its flag, at the second, and later and later, until a run is
 * over before.
 *
 * deadlines.py runs it otherwise: as `property_cancel gaps STAGE` beneath callgrind it cancels
 * nothing and has callgrind tell the instructions so far at each look; as `property_cancel late
 * STAGE` another thread cancels, and what is done afterwards is told. A third word names a kernel.
 * Without a stage it lists them. */
#include "base/cancel.h"

#include <inttypes.h>
#include <pthread.h>
#include <time.h>
#include <unistd.h>

#include "image/image.h"
#include "property/pieces.h"

#if __has_include(<valgrind/callgrind.h>)
#include <valgrind/callgrind.h>
#else /* another machine's, which is emulated */
#define CALLGRIND_START_INSTRUMENTATION
#define VALGRIND_MONITOR_COMMAND(command) (void)(command)
#endif

/* ---- Looks at the flag, which the linker sends here. ---- */

static atomic_uint_fast64_t looks;
static uint64_t raise_at; /* 0: never */
static uint64_t told_at;  /* callgrind tells at every so many looks; 0: never */
static _Atomic(atomic_bool *) last_flag;

bool __wrap_shd_is_cancelled(const atomic_bool *flag);
bool __real_shd_is_cancelled(const atomic_bool *flag);

bool __wrap_shd_is_cancelled(const atomic_bool *flag) {
    if (!flag) return false;
    const uint64_t now = atomic_fetch_add(&looks, 1) + 1;
    atomic_store_explicit(&last_flag, (atomic_bool *)(uintptr_t)flag, memory_order_relaxed);
    if (now == raise_at) atomic_store((atomic_bool *)(uintptr_t)flag, true);
    if (told_at && now % told_at == 0) VALGRIND_MONITOR_COMMAND("status internal");
    return __real_shd_is_cancelled(flag);
}

/* ---- Documents. ---- */

static void write_lights(FILE *out, int count, const char *more) {
    fputs("\"lights\": [", out);
    for (int i = 0; i < count; i++)
        fprintf(out,
                "%s{\"type\": \"point\", \"position\": [%.9g, %.9g, 3], \"color\": "
                "[0.1, 0.2, 0.%d]%s}",
                i ? "," : "", cos(i), sin(i), 1 + i % 9, more);
    fputs("]", out);
}

static void write_shiny(FILE *out, int lobes) {
    fputs("\"material\": {\"specular\": 0.1, \"lobes\": [", out);
    for (int i = 0; i < lobes; i++)
        fprintf(out, "%s{\"specular\": 0.01, \"shininess\": %d}", i ? "," : "", 2 + 3 * i);
    fputs("]}", out);
}

static void write_head(FILE *out, int side, int samples, const char *tier) {
    fprintf(out, "{\"image\": {\"width\": %d, \"height\": %d, \"samples\": %d}, \"accuracy\": %s, ",
            side, side, samples, tier);
}

static void write_lit(FILE *out, int lights, const char *light, const char *tier) {
    write_head(out, 32, 64, tier);
    write_lights(out, lights, light);
    fputs(", \"objects\": [{\"type\": \"sphere\", ", out);
    write_shiny(out, 64);
    fputs("}]}", out);
}

#define STANDARD "{\"tier\": \"standard\"}"
#define EXACT    "{\"tier\": \"exact\"}"
#define BUDGET   "{\"maxError\": 0.5, \"metric\": \"deltaE2000\"}"

static void write_standard_light(FILE *out, int size) {
    write_lit(out, size, "", STANDARD);
}

static void write_exact_light(FILE *out, int size) {
    write_lit(out, size, "", EXACT);
}

/* Beyond what kernels hold in f64. */
static void write_bright_light(FILE *out, int size) {
    write_lit(out, size, ", \"intensity\": 1e40", STANDARD);
}

static void write_mesh(FILE *out, int triangles, double (*corner)(int triangle, int k, int c)) {
    fputs("{\"type\": \"mesh\", \"positions\": [", out);
    for (int i = 0; i < triangles; i++)
        for (int k = 0; k < 9; k++)
            fprintf(out, "%s%.9g", i + k ? "," : "", corner(i, k / 3, k % 3));
    fputs("]}", out);
}

static double equal_corner(int triangle, int k, int c) {
    (void)triangle;
    return k == c ? 1 : 0;
}

/* Of which each has the same middle, and is in front of those before. */
static double stacked_corner(int triangle, int k, int c) {
    return c == 2 ? 1e-6 * triangle : cos(2 * SHD_PI / 3 * k - SHD_PI / 2 * c + 1e-5 * triangle);
}

static double needle_corner(int triangle, int k, int c) {
    return c == 2 ? 0.01 * sin(triangle) : k < 2 ? 3 * cos(triangle + 3 * k + 1.57 * c) : 1e-4;
}

static void write_triangles(FILE *out, int count, double (*corner)(int triangle, int k, int c)) {
    write_head(out, 32, 16, STANDARD);
    fputs("\"objects\": [", out);
    write_mesh(out, count, corner);
    fputs("]}", out);
}

static void write_equal(FILE *out, int size) {
    write_triangles(out, size, equal_corner);
}

static void write_stacked(FILE *out, int size) {
    write_triangles(out, size, stacked_corner);
}

static void write_needles(FILE *out, int size) {
    write_triangles(out, size, needle_corner);
}

static void write_objects(FILE *out, int count, const char *shape, const char *more) {
    fputs("\"objects\": [", out);
    for (int i = 0; i < count; i++)
        fprintf(out,
                "%s{\"type\": \"%s\", \"transform\": {\"rotate\": [%d, %d, 0], \"scale\": [1, "
                "1.2, 1.%d]}, %s}",
                i ? "," : "", shape, i, 3 * i, 1 + i % 9, more);
    fputs("]", out);
}

static void write_pairs(FILE *out, int size) {
    write_head(out, 32, 4, STANDARD);
    write_lights(out, size, "");
    fputs(", ", out);
    write_objects(out, size, "box", "\"material\": {\"specular\": 0.5}");
    fputs("}", out);
}

static void write_tori(FILE *out, int size) {
    write_head(out, 32, 16, STANDARD);
    write_objects(out, size, "torus", "\"tube\": 0.1");
    fputs("}", out);
}

static void write_facets(FILE *out, int size) {
    char more[80];
    snprintf(more, sizeof more, "\"interpolation\": \"%s\", \"segments\": %d",
             size % 2 ? "flat" : "gouraud", size);
    write_head(out, 32, 1, STANDARD);
    write_lights(out, 100, "");
    fputs(", ", out);
    write_objects(out, 2, "torus", more);
    fputs("}", out);
}

static void write_budget(FILE *out, int size) {
    write_head(out, 32, 4, BUDGET);
    write_lights(out, size, "");
    fputs(", ", out);
    write_objects(out, size, "box", "\"material\": {\"specular\": 0.5}");
    fputs("}", out);
}

/* Numbers that no mesh has, each a thing of its own in the tree. */
static void write_values(FILE *out, int size) {
    fputs("{\"objects\": [], \"colour\": [0", out);
    for (int i = 0; i < size; i++) fprintf(out, ",%d", i);
    fputs("]}", out);
}

static void write_members(FILE *out, int size) {
    fputs("{\"objects\": []", out);
    for (int i = 0; i < size; i++) fprintf(out, ",\"member %d\": {}", i);
    fputs("}", out);
}

static void write_string(FILE *out, int size) {
    fputs("{\"objects\": [], \"$schema\": \"", out);
    for (int i = 0; i < size; i++) fputs("\\u00e4", out);
    fputs("\"}", out);
}

static void write_ball_of(FILE *out, int size) {
    write_head(out, 32, 1, STANDARD);
    fputs("\"objects\": [{\"type\": \"mesh\", ", out);
    write_ball(out, 2 * size, size, true);
    fputs("}]}", out);
}

static void write_output(FILE *out, int size, const char *output) {
    write_head(out, size, 1, STANDARD);
    fprintf(out, "\"output\": {%s}, ", output);
    write_objects(out, 20, "torus", "\"tube\": 0.03, \"material\": {\"specular\": 0.5}");
    fputs("}", out);
}

static void write_jpeg(FILE *out, int size) {
    write_output(out, size, "\"format\": \"jpeg\"");
}

static void write_webp(FILE *out, int size) {
    write_output(out, size, "\"format\": \"webp\"");
}

static void write_lossless(FILE *out, int size) {
    write_output(out, size, "\"format\": \"webp\", \"quality\": 100");
}

static void write_tiff(FILE *out, int size) {
    write_output(out, size, "\"format\": \"tiff\", \"bitDepth\": 16");
}

static void write_exr(FILE *out, int size) {
    write_output(out, size,
                 "\"format\": \"exr\", \"colorSpace\": \"lin_rec709\", \"layers\": "
                 "[\"beauty\", \"diffuse\", \"normal\", \"position\", \"specular\"]");
}

static void write_hdr(FILE *out, int size) {
    write_output(out, size, "\"format\": \"hdr\"");
}

static void write_png(FILE *out, int size) {
    write_output(out, size, "\"format\": \"png\", \"colorSpace\": \"HSV\"");
}

static void write_deep_png(FILE *out, int size) {
    write_output(out, size, "\"format\": \"png\", \"colorSpace\": \"YIQ\", \"bitDepth\": 16");
}

/* Scenes in one document, that are compared. */
static void write_two(FILE *out, int size) {
    fputs("{\"a\": ", out);
    write_png(out, size);
    fputs(", \"b\": ", out);
    write_deep_png(out, size);
    fputs("}", out);
}

/* Whose encoders' lines are long. */
static void write_wide(FILE *out, int size) {
    fprintf(out,
            "{\"image\": {\"width\": %d, \"height\": 20, \"samples\": 1}, \"output\": {\"format\": "
            "\"exr\", \"colorSpace\": \"lin_rec709\", \"layers\": [\"beauty\", \"normal\", "
            "\"position\"]}, ",
            size);
    write_objects(out, 20, "torus", "\"tube\": 0.03, \"material\": {\"specular\": 0.5}");
    fputs("}", out);
}

static void write_weaves(FILE *out, int size) {
    write_head(out, 32, 1, STANDARD);
    fputs("\"objects\": [", out);
    for (int i = 0; i < size; i++)
        fprintf(out,
                "%s{\"type\": \"sphere\", \"material\": {\"model\": \"westin\", \"microgeometry\": "
                "{\"type\": \"weave\", \"warp\": 0.3%d}}}",
                i ? "," : "", i);
    fputs("]}", out);
}

static void write_shiny_photo(FILE *out, int size) {
    fprintf(out,
            "{\"image\": {\"width\": %d, \"height\": %d}, \"objects\": [{\"type\": \"sphere\", "
            "\"material\": {\"specular\": 0.4}}], \"output\": {\"format\": \"webp\", \"quality\": "
            "100}}",
            size, size);
}

typedef enum call { RENDER, COMPARE, ANALYZE, DIFF, FIT, EXPLAIN } call;

enum { FITTED = 64 }; /* pixels on a side */

static char photo[] = "/tmp/shaded-photo-XXXXXX.webp";

typedef struct stage {
    const char *name;
    void (*write)(FILE *out, int size);
    int size; /* as large as it takes to look at the flag often */
    call call;
    uint64_t enough; /* looks, of as many alike, that callgrind counts between; 0: all */
} stage;

static const stage stages[] = {
    {"values", write_values, 200000, RENDER, 0},
    {"members", write_members, 50000, RENDER, 0},
    {"string", write_string, 150000, RENDER, 0},
    {"ball", write_ball_of, 120, RENDER, 0},
    {"pairs", write_pairs, 700, RENDER, 0},
    {"budget", write_budget, 12, RENDER, 0},
    {"equal triangles", write_equal, 60000, RENDER, 0},
    {"stacked triangles", write_stacked, 20000, RENDER, 0},
    {"needles", write_needles, 20000, RENDER, 0},
    {"tori", write_tori, 1000, RENDER, 0},
    {"facets", write_facets, 301, RENDER, 0},
    {"smooth facets", write_facets, 300, RENDER, 0},
    {"standard light", write_standard_light, 3000, RENDER, 1000},
    {"exact light", write_exact_light, 3000, RENDER, 1000},
    {"bright light", write_bright_light, 300, RENDER, 1000},
    {"weaves", write_weaves, 2, RENDER, 0},
    {"png", write_png, 1000, RENDER, 0},
    {"deep png", write_deep_png, 1000, RENDER, 0},
    {"jpeg", write_jpeg, 1500, RENDER, 0},
    {"webp", write_webp, 500, RENDER, 0},
    {"lossless", write_lossless, 300, RENDER, 0},
    {"tiff", write_tiff, 1000, RENDER, 0},
    {"exr", write_exr, 500, RENDER, 0},
    {"wide exr", write_wide, 20000, RENDER, 0},
    {"hdr", write_hdr, 1000, RENDER, 0},
    {"comparison", write_png, 600, COMPARE, 0},
    {"analysis", write_png, 600, ANALYZE, 0},
    {"difference", write_two, 300, DIFF, 0},
    {"fit", write_shiny_photo, FITTED, FIT, 0},
    {"explanation", write_pairs, 500, EXPLAIN, 0},
};

enum { STAGES = sizeof stages / sizeof stages[0] };

/* What is fitted, before anybody looks. */
static void take_photo(shd_engine *engine) {
    writing w;
    start(&w);
    write_shiny_photo(w.out, FITTED);
    char *json = finish(&w);
    raise_at = 0;
    shd_request *request = read_scene(engine, json);
    shd_error error;
    size_t count;
    assert_int_equal(shd_request_render(request, NULL, &error), SHD_OK);
    const shd_picture *picture = shd_request_pictures(request, &count);
    const int made = mkstemps(photo, (int)strlen(".webp"));
    assert_true(made >= 0);
    assert_int_equal(write(made, picture->data, picture->size), picture->size);
    assert_int_equal(close(made), 0);
    shd_request_drop(request);
    free(json);
}

static char *document_of(shd_engine *engine, const stage *of) {
    writing w;
    if (of->call == FIT) take_photo(engine);
    start(&w);
    of->write(w.out, of->size);
    return finish(&w);
}

/* ---- The claim. ---- */

static shd_status ask(shd_engine *engine, call which, const char *json) {
    shd_error error = {.status = SHD_OK};
    shd_request *request = NULL;
    char *text = NULL;
    assert_int_equal(shd_request_new(engine, &request, &error), SHD_OK);
    unsigned char *data = NULL;
    size_t size;
    shd_status status = which == DIFF ? shd_request_read_pair(request, json, strlen(json))
                                      : shd_request_read(request, json, strlen(json), SHD_PNG);
    if (status == SHD_OK && which == DIFF)
        status = shd_request_diff_pair(request, true, &data, &size, &error);
    if (status == SHD_OK && which == RENDER) status = shd_request_render(request, NULL, &error);
    if (status == SHD_OK && which == COMPARE)
        status = shd_request_compare(request, NULL, &text, &error);
    if (status == SHD_OK && which == ANALYZE)
        status = shd_request_analyze(request, NULL, &text, &error);
    if (status == SHD_OK && which == FIT)
        status = shd_request_fit(request, photo, SHD_WEBP, NULL, NULL, &text, &error);
    if (status == SHD_OK && which == EXPLAIN)
        status = shd_request_explain(request, SHD_IN_JSON, &text, &error);
    free(text);
    free(data);
    shd_request_drop(request);
    return status;
}

static void a_cancelled_request_leaves_at_once(void **state) {
    enum { PATIENCE = 1000, LATEST = 3000 }; /* looks: each loop on the way out has its own */
    for (size_t i = 0; i < STAGES; i++) {
        char *json = document_of(*state, &stages[i]);
        uint64_t last = 0, most = 0;
        for (uint64_t at = 1; at < LATEST; at += 1 + at / 3) {
            atomic_store(&looks, 0);
            raise_at = at;
            const shd_status status = ask(*state, stages[i].call, json);
            const uint64_t all = atomic_load(&looks);
            if (all < at) { /* it was over before, also with what is no scene */
                assert_true(status == SHD_OK || status == SHD_SCENE);
                break;
            }
            assert_int_equal(status, SHD_CANCELLED);
            last = at;
            most = all - at > most ? all - at : most;
        }
        print_message("%s: cancelled at look %" PRIu64 " at the latest, %" PRIu64
                      " looks later at most\n",
                      stages[i].name, last, most);
        assert_true(last > 10);
        assert_true(most < PATIENCE);
        free(json);
    }
    raise_at = 0;
    unlink(photo);
}

/* ---- For deadlines.py. ---- */

static int tell_gaps(const stage *of, const char *kernel) {
    shd_engine *engine = new_engine_of(1, kernel);
    char *json = document_of(engine, of);
    shd_error error;
    shd_image_prepare(SHD_EXR, NULL, NULL, &error); /* on a thread of its own, which is not meant */
    told_at = 1;
    raise_at = of->enough;
    CALLGRIND_START_INSTRUMENTATION;
    VALGRIND_MONITOR_COMMAND("status internal");
    const shd_status status = ask(engine, of->call, json);
    unlink(photo);
    VALGRIND_MONITOR_COMMAND("status internal");
    free(json);
    shd_engine_drop(engine);
    return status != SHD_OK && status != SHD_SCENE && !(of->enough && status == SHD_CANCELLED);
}

typedef struct asking {
    shd_engine *engine;
    const stage *of;
    const char *json;
    atomic_bool done;
} asking;

static void *ask_in_thread(void *context) {
    asking *a = context;
    ask(a->engine, a->of->call, a->json);
    atomic_store(&a->done, true);
    return NULL;
}

static double processor_seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Cancels later and later, until it is over before; tells the most processor milliseconds, of all
 * threads, that followed. */
static int tell_late(const stage *of, const char *kernel) {
    enum { STEP = 50, ROUNDS = 20 }; /* milliseconds of processor time */
    shd_engine *engine = new_engine_of(1, kernel);
    char *json = document_of(engine, of);
    double most = 0;
    ask(engine, of->call, json); /* libraries are loaded once */
    bool over = false;
    for (int round = 1; !over && round <= ROUNDS; round++) {
        asking a = {engine, of, json, false};
        pthread_t thread;
        atomic_store(&last_flag, NULL);
        const double begin = processor_seconds();
        assert_int_equal(pthread_create(&thread, NULL, ask_in_thread, &a), 0);
        while (!atomic_load(&a.done) && processor_seconds() < begin + 1e-3 * STEP * round)
            usleep(500);
        over = atomic_load(&a.done);
        const double raised = processor_seconds();
        if (!over && atomic_load(&last_flag)) atomic_store(atomic_load(&last_flag), true);
        pthread_join(thread, NULL);
        const double late = 1e3 * (processor_seconds() - raised);
        if (!over && late > most) most = late;
    }
    printf("%.1f\n", most);
    unlink(photo);
    free(json);
    shd_engine_drop(engine);
    return 0;
}

int main(int argc, char **argv) {
    for (size_t i = 0; argc > 2 && i < STAGES; i++)
        if (!strcmp(stages[i].name, argv[2]))
            return (strcmp(argv[1], "late") ? tell_gaps : tell_late)(&stages[i], argv[3]);
    for (size_t i = 0; argc > 1 && i < STAGES; i++) puts(stages[i].name);
    if (argc > 1) return 2;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_cancelled_request_leaves_at_once),
    };
    return cmocka_run_group_tests(tests, make_engine, drop_engine);
}
