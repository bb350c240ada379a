/* What bench programs share: jobs to repeat, read from stdin, and samples, printed to stdout.
 *
 * A job is a line of JSON; what its members mean is the program's matter, but for
 *   "text": a document in which each run of `@` becomes a number that no other run has had, as many
 *           digits long, so that no cache knows the document; and
 *   "again": true: the number is that of the job before, whose results may be used again.
 * All jobs of a round run one after another, then the next round begins: a noisy moment of the
 * machine hits neighbors alike. One more round warms up and is not counted, unless one is all. */
#ifndef SHD_BENCH_JOBS_H
#define SHD_BENCH_JOBS_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

_Noreturn static inline void quit(const char *what, const char *more) {
    fprintf(stderr, "bench: %s %s\n", what, more);
    exit(1);
}

static inline double seconds_of(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline double wall_seconds(void) {
    return seconds_of(CLOCK_MONOTONIC);
}

/* An array of the lines of stdin. */
static inline json_t *read_jobs(void) {
    json_t *jobs = json_array();
    char *line = NULL;
    size_t size = 0;
    while (getline(&line, &size, stdin) > 0) {
        json_error_t error;
        json_t *job = json_loads(line, 0, &error);
        if (!job) quit("a job is no JSON:", error.text);
        json_array_append_new(jobs, job);
    }
    free(line);
    return jobs;
}

static inline const char *text_of(const json_t *job, const char *key, const char *otherwise) {
    const json_t *value = json_object_get(job, key);
    return value ? json_string_value(value) : otherwise;
}

/* The job's document with its number; the caller frees it. */
static inline char *numbered(const json_t *job, unsigned serial) {
    char *text = strdup(text_of(job, "text", "")), *at = text;
    if (!text) quit("out of memory", "");
    while ((at = strchr(at, '@'))) {
        size_t length = strspn(at, "@");
        unsigned left = serial;
        for (size_t i = length; i-- > 0; left /= 10) at[i] = (char)('0' + left % 10);
        at += length;
    }
    return text;
}

/* Appends a number to samples[key], which is made where it is missing. */
static inline void add_sample(json_t *samples, const char *key, double value) {
    json_t *list = json_object_get(samples, key);
    if (!list) {
        list = json_array();
        json_object_set_new(samples, key, list);
    }
    json_array_append_new(list, json_real(value));
}

/* Runs the rounds, and prints an array of the jobs' samples. */
static inline void run_rounds(json_t *jobs, int rounds,
                              void (*run)(const json_t *job, unsigned serial, json_t *samples)) {
    size_t count = json_array_size(jobs);
    json_t *all = json_array();
    /* Another process' numbers are others, too: a daemon outlives its clients. */
    unsigned serial = (unsigned)(1e3 * seconds_of(CLOCK_REALTIME)) % 1000000;
    for (size_t i = 0; i < count; i++) json_array_append_new(all, json_object());
    for (int round = rounds > 1 ? -1 : 0; round < rounds; round++) {
        for (size_t i = 0; i < count; i++) {
            const json_t *job = json_array_get(jobs, i);
            if (!json_is_true(json_object_get(job, "again"))) serial++;
            if (round == 0) json_array_set_new(all, i, json_object());
            run(job, serial, json_array_get(all, i));
        }
    }
    json_dumpf(all, stdout, JSON_COMPACT | JSON_REAL_PRECISION(7));
    json_decref(all);
}

#endif
