/* Times requests inside the library: library ROUNDS < JOBS (see jobs.h). A job may say
 *
 *   "kernel", "threads", "keep": of its engine; jobs with the same ones share it. keep: false is
 *              without memory of earlier pictures
 *   "format":  of the picture, default "png"
 *   "compare": true: the comparison of tiers instead of a picture
 *   "save":    a file for the last picture
 *
 * Samples are seconds: "wall" and "cpu" (of the process) for everything from JSON to bytes, "tiles"
 * (wall) until the last news of tiles, and what the library says of its stages. */
#include <dirent.h>
#include <sched.h>
#include <semaphore.h>

#include "jobs.h"
#include "shaded.h"

enum { ENGINES = 16 };

static struct {
    char kernel[16];
    unsigned threads;
    bool keep;
    shd_engine *engine;
} known[ENGINES];

/* Gives each worker a core of its own, as on a machine that does nothing else: on a busy one, two
 * threads may stay on the same core for long. `before` is the newest thread that is no worker. */
static void spread_workers(pid_t before) {
    cpu_set_t cores;
    if (sched_getaffinity(0, sizeof cores, &cores) || CPU_COUNT(&cores) < 2) return;
    DIR *threads = opendir("/proc/self/task");
    struct dirent *entry;
    for (int core = -1; threads && (entry = readdir(threads));) {
        pid_t thread = (pid_t)atoi(entry->d_name);
        if (thread <= before) continue;
        do core = (core + 1) % CPU_SETSIZE;
        while (!CPU_ISSET(core, &cores));
        cpu_set_t one;
        CPU_ZERO(&one);
        CPU_SET(core, &one);
        sched_setaffinity(thread, sizeof one, &one);
    }
    if (threads) closedir(threads);
}

static pid_t newest_thread(void) {
    pid_t newest = 0;
    DIR *threads = opendir("/proc/self/task");
    struct dirent *entry;
    while (threads && (entry = readdir(threads)))
        if (atoi(entry->d_name) > newest) newest = (pid_t)atoi(entry->d_name);
    if (threads) closedir(threads);
    return newest;
}

static shd_engine *engine_of(const json_t *job) {
    const char *kernel = text_of(job, "kernel", "auto");
    const json_t *number = json_object_get(job, "threads");
    unsigned threads = number ? (unsigned)json_integer_value(number) : 1;
    const bool keep = !json_is_false(json_object_get(job, "keep"));
    int i = 0;
    for (; i < ENGINES && known[i].engine; i++)
        if (!strcmp(known[i].kernel, kernel) && known[i].threads == threads &&
            known[i].keep == keep)
            return known[i].engine;
    if (i == ENGINES) quit("too many engines", "");

    shd_engine_options options = shd_engine_defaults();
    options.threads = threads;
    options.limits.object_lights = UINT64_C(1) << 27; /* 10,000 lamps among 10,000 spheres */
    options.kernel = kernel;
    if (!keep) options.reuse = 0;
    pid_t before = newest_thread();
    shd_error error;
    if (shd_engine_new(&options, &known[i].engine, &error)) quit("engine:", error.text);
    spread_workers(before);
    snprintf(known[i].kernel, sizeof known[i].kernel, "%s", kernel);
    known[i].threads = threads;
    known[i].keep = keep;
    return known[i].engine;
}

static void note_progress(void *context, double share) {
    (void)share;
    *(double *)context = wall_seconds();
}

static shd_request *read_request(const json_t *job, const char *text) {
    shd_format format;
    if (!shd_format_find(text_of(job, "format", "png"), &format)) quit("no such format", "");
    shd_request *request;
    shd_error error;
    if (shd_request_new(engine_of(job), &request, &error)) quit("request:", error.text);
    if (shd_request_read(request, text, strlen(text), format)) {
        const shd_problem *problem = &shd_request_report(request)->errors[0];
        quit(problem->pointer, problem->detail);
    }
    return request;
}

static void compare(const json_t *job, const char *text, json_t *samples) {
    shd_request *request = read_request(job, text);
    shd_error error;
    char *answer;
    if (shd_request_compare(request, NULL, &answer, &error)) quit("compare:", error.text);
    json_object_set_new(samples, "compare", json_loads(answer, 0, NULL));
    free(answer);
    shd_request_drop(request);
}

static void save(const json_t *job, const shd_picture *picture) {
    const char *path = text_of(job, "save", NULL);
    if (!path) return;
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(picture->data, 1, picture->size, file) != picture->size || fclose(file))
        quit("cannot write", path);
}

static void render(const json_t *job, const char *text, json_t *samples) {
    double began = wall_seconds(), used = seconds_of(CLOCK_PROCESS_CPUTIME_ID), tiled = began;
    shd_request *request = read_request(job, text);
    shd_render_options options = {note_progress, &tiled};
    shd_error error;
    if (shd_request_render(request, &options, &error)) quit("render:", error.text);
    add_sample(samples, "wall", wall_seconds() - began);
    add_sample(samples, "cpu", seconds_of(CLOCK_PROCESS_CPUTIME_ID) - used);
    add_sample(samples, "tiles", tiled - began);

    const shd_times *times = shd_request_times(request);
    add_sample(samples, "parse", times->parse);
    add_sample(samples, "plan", times->plan);
    add_sample(samples, "build", times->build);
    add_sample(samples, "visibility", times->visibility);
    add_sample(samples, "shade", times->shade);
    add_sample(samples, "shadow", times->shadow);
    add_sample(samples, "trace", times->trace);
    add_sample(samples, "color", times->color);
    add_sample(samples, "encode", times->encode);
    size_t count;
    const shd_picture *picture = shd_request_pictures(request, &count);
    json_object_set_new(samples, "plan_line", json_string(shd_request_plan(request)));
    json_object_set_new(samples, "bytes", json_integer((json_int_t)picture->size));
    save(job, picture);
    shd_request_drop(request);
}

typedef struct task {
    const json_t *job;
    unsigned serial;
    json_t *samples;
    sem_t done;
} task;

static void run_task(void *context) {
    task *t = context;
    char *text = numbered(t->job, t->serial);
    if (json_is_true(json_object_get(t->job, "compare")))
        compare(t->job, text, t->samples);
    else
        render(t->job, text, t->samples);
    free(text);
    sem_post(&t->done);
}

/* On a worker, as the daemon does it: this thread would be one more than was asked for. */
static void run(const json_t *job, unsigned serial, json_t *samples) {
    task t = {.job = job, .serial = serial, .samples = samples};
    sem_init(&t.done, 0, 0);
    if (!shd_engine_submit(engine_of(job), run_task, &t)) quit("the queue is full", "");
    while (sem_wait(&t.done)) continue;
    sem_destroy(&t.done);
}

int main(int argc, char **argv) {
    int rounds = argc == 2 ? atoi(argv[1]) : 0;
    if (rounds < 1) {
        fputs("usage: library ROUNDS < JOBS\n", stderr);
        return 2;
    }
    json_t *jobs = read_jobs();
    run_rounds(jobs, rounds, run);
    json_decref(jobs);
    for (int i = 0; i < ENGINES; i++) shd_engine_drop(known[i].engine);
    return 0;
}
