/* Times whole requests, JSON to PNG: tiers by number of lights, one sphere in 512x512.
 *
 * Machines are noisy, so each figure is the median of several runs, and what to compare are the
 * ratios. Usage: bench [RUNS [THREADS]] */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "shaded.h"

static const char *const tiers[] = {"draft", "standard", "exact"};
static const int lights[] = {1, 4, 16, 64};
enum { TIERS = sizeof tiers / sizeof tiers[0], LIGHTS = sizeof lights / sizeof lights[0] };
enum { MAX_RUNS = 1000 };

typedef struct figures {
    double total;    /* milliseconds from JSON to PNG */
    shd_times times; /* seconds of processor time by stage */
} figures;

static void quit(const char *what, const char *path, const char *text) {
    fprintf(stderr, "bench: %s: %s %s\n", what, path, text);
    exit(1);
}

static double milliseconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return 1e3 * (double)now.tv_sec + 1e-6 * (double)now.tv_nsec;
}

/* Lights on a spiral around the viewer; the caller frees the text. */
static char *make_scene(const char *tier, int light_count) {
    char *text;
    size_t length;
    FILE *out = open_memstream(&text, &length);
    if (!out) quit("scene", "", "out of memory");
    fprintf(out,
            "{\"image\": {\"width\": 512, \"height\": 512, \"samples\": 1},"
            " \"accuracy\": {\"tier\": \"%s\"},"
            " \"objects\": [{\"type\": \"sphere\", \"material\":"
            " {\"diffuse\": [0.5, 0.3, 0.1], \"specular\": 0.5, \"shininess\": 50}}],"
            " \"lights\": [",
            tier);
    for (int i = 0; i < light_count; i++)
        fprintf(out, "%s{\"type\": \"point\", \"position\": [%d, %d, %d], \"intensity\": %g}",
                i ? ", " : "", i % 7 - 3, i % 5 - 2, 3 + i % 3, 1.0 / light_count);
    fputs("]}", out);
    fclose(out);
    return text;
}

static figures run_once(shd_engine *engine, const char *scene) {
    shd_request *request;
    shd_error error;
    double start = milliseconds();
    if (shd_request_new(engine, &request, &error)) quit("request", error.path, error.text);
    if (shd_request_read(request, scene, strlen(scene), SHD_PNG)) {
        const shd_problem *problem = &shd_request_report(request)->errors[0];
        quit("scene", problem->pointer, problem->detail);
    }
    if (shd_request_render(request, NULL, &error)) quit("render", error.path, error.text);
    figures result = {milliseconds() - start, *shd_request_times(request)};
    shd_request_drop(request);
    return result;
}

static int by_total(const void *a, const void *b) {
    double x = ((const figures *)a)->total, y = ((const figures *)b)->total;
    return (x > y) - (x < y);
}

static figures median(shd_engine *engine, const char *scene, int runs) {
    static figures all[MAX_RUNS];
    run_once(engine, scene); /* caches and processors warm up */
    for (int i = 0; i < runs; i++) all[i] = run_once(engine, scene);
    qsort(all, (size_t)runs, sizeof all[0], by_total);
    return all[runs / 2];
}

int main(int argc, char **argv) {
    int runs = argc > 1 ? atoi(argv[1]) : 21;
    int threads = argc > 2 ? atoi(argv[2]) : 1;
    if (runs < 1 || runs > MAX_RUNS || threads < 1 || threads > 1024) {
        fprintf(stderr, "usage: bench [RUNS [THREADS]]\n");
        return 2;
    }
    shd_engine_options options = shd_engine_defaults();
    options.threads = (unsigned)threads;
    shd_engine *engine;
    shd_error error;
    if (shd_engine_new(&options, &engine, &error)) quit("engine", error.path, error.text);

    printf("512x512 sphere, samples 1, %d thread%s, median of %d\n\n", threads,
           threads > 1 ? "s" : "", runs);
    printf("%-9s %6s %9s %7s |%7s %7s %7s %7s %7s\n", "tier", "lights", "ms", "ratio", "parse",
           "see", "shade", "color", "encode");
    double unit = 0;
    for (int t = 0; t < TIERS; t++) {
        for (int l = 0; l < LIGHTS; l++) {
            char *scene = make_scene(tiers[t], lights[l]);
            figures f = median(engine, scene, runs);
            free(scene);
            if (unit == 0) unit = f.total;
            printf("%-9s %6d %9.2f %7.2f |%7.2f %7.2f %7.2f %7.2f %7.2f\n", tiers[t], lights[l],
                   f.total, f.total / unit, 1e3 * f.times.parse, 1e3 * f.times.visibility,
                   1e3 * f.times.shade, 1e3 * f.times.color, 1e3 * f.times.encode);
        }
    }
    shd_engine_drop(engine);
    return 0;
}
