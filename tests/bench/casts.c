/* Times sight alone: the survey, and casting one ray a pixel, of 512 x 512 frames on one thread,
 * by shape and instruction set.
 *
 * Machines are noisy, so each figure is the median of several runs. Usage:
 * casts [RUNS [SCENE [KERNEL]]], SCENE the beginning of a name. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "render/planning.h"
#include "render/request.h"
#include "sight/sight.h"

enum { SIDE = 512, TILE = 32, MAX_RUNS = 1000 };

static void quit(const char *what, const char *path, const char *text) {
    fprintf(stderr, "casts: %s: %s %s\n", what, path, text);
    exit(1);
}

static double milliseconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

typedef struct stage {
    const char *name, *before, *object; /* what is written before the objects, and one of them */
    int count; /* of objects, spread over the picture where there are many */
} stage;

#define PERSPECTIVE "\"camera\": {\"position\": [0.6, 0.9, 3.8]}"
#define ORTHOGRAPHIC                                                                               \
    "\"camera\": {\"type\": \"orthographic\", \"height\": 3, \"position\": [0.6, 0.9, 3.8]}"
#define TURNED  ", \"transform\": {\"rotate\": [20, 30, 40]}"
#define THIN    ", \"transform\": {\"rotate\": [20, 30, 40], \"scale\": [1, 0.4, 0.8]}"
#define LAYERED ", \"output\": {\"format\": \"exr\", \"layers\": [\"position\"]}"

static const stage scenes[] = {
    {"sphere", "", "\"sphere\"", 1},
    {"exact sphere", "\"accuracy\": {\"tier\": \"exact\"}", "\"sphere\"", 1},
    {"orthographic sphere", ORTHOGRAPHIC, "\"sphere\"", 1},
    {"ellipsoid", PERSPECTIVE, "\"sphere\"" THIN, 1},
    {"plane", PERSPECTIVE, "\"plane\"", 1},
    {"disc", PERSPECTIVE, "\"disc\"" TURNED, 1},
    {"box", PERSPECTIVE, "\"box\", \"size\": [1.4, 1.4, 1.4]" TURNED, 1},
    {"thin box", PERSPECTIVE, "\"box\", \"size\": [1.4, 1.4, 1.4]" THIN, 1},
    {"cylinder", PERSPECTIVE, "\"cylinder\"" TURNED, 1},
    {"cone", PERSPECTIVE, "\"cone\"" TURNED, 1},
    {"torus", PERSPECTIVE, "\"torus\"" TURNED, 1},
    {"exact torus", PERSPECTIVE ", \"accuracy\": {\"tier\": \"exact\"}", "\"torus\"" TURNED, 1},
    {"mesh (a flat sphere)", PERSPECTIVE, "\"sphere\", \"interpolation\": \"flat\"", 1},
    {"1000 spheres", "", "\"sphere\"", 1000},
    {"1000 cylinders", "", "\"cylinder\"", 1000},
    {"10000 spheres", "", "\"sphere\"", 10000},
};
enum { SCENES = sizeof scenes / sizeof scenes[0] };

/* Many objects fill a cube; the caller frees the text. */
static char *write_scene(const stage *s) {
    char *text;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    if (!out) quit("scene", "", "out of memory");
    fprintf(out, "{%s%s\"image\": {\"width\": %d, \"height\": %d, \"samples\": 1}, \"objects\": [",
            s->before, *s->before ? ", " : "", SIDE, SIDE);
    uint64_t random = 1;
    for (int i = 0; i < s->count; i++) {
        fprintf(out, "%s{\"type\": %s", i ? ", " : "", s->object);
        if (s->count > 1) {
            fputs(", \"transform\": {\"scale\": ", out);
            fprintf(out, "%g, \"translate\": [", s->count > 1000 ? 0.03 : 0.07);
            for (int c = 0; c < 3; c++) {
                random = random * 6364136223846793005u + 1442695040888963407u;
                fprintf(out, "%s%g", c ? ", " : "", (double)(random >> 40) * 0x1p-23 - 1);
            }
            fputs("]}", out);
        }
        fputs("}", out);
    }
    fputs("]}", out);
    fclose(out);
    return text;
}

/* One thread's memory for a tile. */
typedef struct scratch {
    int32_t x[TILE * TILE], y[TILE * TILE];
    uint8_t sample[TILE * TILE]; /* 0 all of it: the pattern's first ray */
    size_t count;
    shd_survey survey;
    shd_hits hits;
} scratch;

typedef struct figures {
    double survey, cast; /* milliseconds */
    size_t rays, hits;
} figures;

/* A tile's rays, block by block, of the blocks where something may be seen. */
static void list_shots(scratch *s, int x, int y) {
    size_t n = 0;
    for (int i = 0; i < s->survey.across * s->survey.down; i++) {
        if (!s->survey.blocks[i].count) continue;
        int left = x + i % s->survey.across * SHD_BLOCK_SIDE,
            top = y + i / s->survey.across * SHD_BLOCK_SIDE;
        for (int row = 0; row < SHD_BLOCK_SIDE; row++)
            for (int column = 0; column < SHD_BLOCK_SIDE; column++) {
                s->x[n] = left + column;
                s->y[n++] = top + row;
            }
    }
    s->count = n;
}

static void cast_tile(const shd_sight *sight, scratch *s) {
    enum { RAYS = SHD_BLOCK_SIDE * SHD_BLOCK_SIDE };
    size_t first = 0;
    for (int i = 0; i < s->survey.across * s->survey.down; i++) {
        const shd_block *block = &s->survey.blocks[i];
        if (!block->count) continue;
        const shd_shots shots = {RAYS, s->x + first, s->y + first, s->sample + first};
        shd_sight_shoot(sight, s->survey.candidates + block->first, block->count, &shots, &s->hits);
        first += RAYS;
    }
}

static figures run_once(const shd_sight *sight, scratch *s) {
    figures f = {0};
    double start = milliseconds();
    for (int y = 0; y < SIDE; y += TILE)
        for (int x = 0; x < SIDE; x += TILE)
            shd_sight_survey(sight, (shd_tile){x, y, TILE, TILE}, &s->survey);
    f.survey = milliseconds() - start;

    start = milliseconds();
    for (int y = 0; y < SIDE; y += TILE)
        for (int x = 0; x < SIDE; x += TILE) {
            shd_sight_survey(sight, (shd_tile){x, y, TILE, TILE}, &s->survey);
            s->hits.count = 0;
            list_shots(s, x, y);
            cast_tile(sight, s);
            f.rays += s->count;
            f.hits += s->hits.count;
        }
    f.cast = milliseconds() - start;
    return f;
}

static int by_value(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void report(const stage *scene, shd_engine *engine, shd_isa isa, int runs) {
    static double survey[MAX_RUNS], cast[MAX_RUNS];
    char *text = write_scene(scene);
    shd_request *request;
    shd_error error;
    if (shd_request_new(engine, &request, &error)) quit("request", error.path, error.text);
    if (shd_request_read(request, text, strlen(text), SHD_PNG)) {
        const shd_problem *problem = &shd_request_report(request)->errors[0];
        quit(scene->name, problem->pointer, problem->detail);
    }
    const shd_plan *plan;
    shd_sight *sight;
    if (shd_plan_make(request->scene, isa, NULL, NULL, request->rendering.arena, &plan, &error) ||
        shd_sight_new(plan, NULL, request->rendering.arena, &sight, &error))
        quit(scene->name, error.path, error.text);
    static scratch s;
    shd_scratch memory = {.arena = request->rendering.arena};
    shd_survey_lay_out(plan->scene->object_count, TILE, TILE, &memory, &s.survey);
    shd_hits_lay_out(plan, TILE * TILE, &memory, &s.hits);
    if (memory.full) quit(scene->name, "", "out of memory");
    figures f = run_once(sight, &s);
    for (int i = 0; i < runs; i++) {
        f = run_once(sight, &s);
        survey[i] = f.survey;
        cast[i] = f.cast;
    }
    qsort(survey, (size_t)runs, sizeof *survey, by_value);
    qsort(cast, (size_t)runs, sizeof *cast, by_value);
    printf("%-22s %-9s %8.3f %8.3f %8zu %8zu %7.2f\n", scene->name, shd_isa_name(isa),
           survey[runs / 2], cast[runs / 2], f.rays, f.hits,
           f.rays ? 1e6 * cast[runs / 2] / (double)f.rays : 0);
    shd_request_drop(request);
    free(text);
}

int main(int argc, char **argv) {
    int runs = argc > 1 ? atoi(argv[1]) : 15;
    const char *only = argc > 2 ? argv[2] : "";
    const char *kernel = argc > 3 ? argv[3] : "";
    if (runs < 1 || runs > MAX_RUNS) {
        fprintf(stderr, "usage: casts [RUNS [SCENE [KERNEL]]]\n");
        return 2;
    }
    shd_engine_options options = shd_engine_defaults();
    options.threads = 1;
    shd_engine *engine;
    shd_error error;
    if (shd_engine_new(&options, &engine, &error)) quit("engine", error.path, error.text);
    printf("512x512, one ray a pixel, one thread, milliseconds of processor time a frame, median "
           "of %d\n\n",
           runs);
    printf("%-22s %-9s %8s %8s %8s %8s %7s\n", "scene", "kernel", "survey", "+ cast", "rays",
           "hits", "ns/ray");
    for (size_t i = 0; i < SCENES; i++) {
        if (strncmp(scenes[i].name, only, strlen(only)) != 0) continue;
        for (shd_isa isa = SHD_PORTABLE; isa < SHD_ISA_COUNT; isa++)
            if (shd_cpu_has(isa) && (!*kernel || !strcmp(kernel, shd_isa_name(isa))))
                report(&scenes[i], engine, isa, runs);
    }
    shd_engine_drop(engine);
    return 0;
}
