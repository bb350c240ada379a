#include "metrics.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "process.h"

static const char *const stage_names[SHD_STAGE_COUNT] = {"queue", "parse", "plan",  "visibility",
                                                         "shade", "color", "encode"};

static const char *const phase_names[SHD_PHASES] = {"rest", "head", "body", "work", "answer"};
static const char *const ending_names[SHD_ENDINGS] = {"time", "left", "room", "memory"};

/* The last one, 0, takes every other status. */
static const unsigned statuses[SHD_STATUSES] = {200, 201, 204, 304, 400, 401, 403, 404,
                                                405, 406, 409, 413, 414, 415, 422, 429,
                                                431, 500, 501, 503, 504, 505, 0};

static const double bounds[SHD_BUCKETS] = {0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1,
                                           0.25,   0.5,   1,      2.5,   5,    10,    30};

const char *shd_stage_name(shd_stage stage) {
    return stage_names[stage];
}

static void count_by(atomic_uint_least64_t *counter, uint64_t by) {
    atomic_fetch_add_explicit(counter, by, memory_order_relaxed);
}

static uint64_t value_of(atomic_uint_least64_t *counter) {
    return atomic_load_explicit(counter, memory_order_relaxed);
}

static void observe_time(shd_histogram *histogram, double seconds) {
    size_t bucket = 0;
    while (bucket < SHD_BUCKETS && seconds > bounds[bucket]) bucket++;
    count_by(&histogram->buckets[bucket], 1);
    if (seconds > 0) count_by(&histogram->nanoseconds, (uint64_t)(seconds * 1e9));
}

enum { LABEL_SIZE = 32 };

static size_t index_of(unsigned status) {
    size_t index = 0;
    while (index < SHD_STATUSES - 1 && statuses[index] != status) index++;
    return index;
}

void shd_metrics_request(shd_metrics *metrics, shd_route route, unsigned status, double seconds,
                         size_t bytes) {
    count_by(&metrics->requests[route][index_of(status)], 1);
    count_by(&metrics->response_bytes, bytes);
    observe_time(&metrics->durations[route], seconds);
}

void shd_metrics_refused(shd_metrics *metrics, shd_limit limit) {
    if (limit) count_by(&metrics->refused[limit], 1);
}

void shd_metrics_unreadable(shd_metrics *metrics, unsigned status) {
    count_by(&metrics->unreadable[index_of(status)], 1);
}

void shd_metrics_memory(shd_metrics *metrics, size_t bytes) {
    size_t most = atomic_load_explicit(&metrics->memory, memory_order_relaxed);
    while (bytes > most && !atomic_compare_exchange_weak(&metrics->memory, &most, bytes)) continue;
}

void shd_metrics_cached(shd_metrics *metrics, shd_cached cached) {
    if (cached != SHD_CACHE_OFF) count_by(&metrics->cached[cached == SHD_CACHE_HIT], 1);
}

void shd_metrics_stage(shd_metrics *metrics, shd_stage stage, double seconds) {
    observe_time(&metrics->stages[stage], seconds);
}

static void print_head(FILE *out, const char *name, const char *type, const char *help) {
    fprintf(out, "# HELP shaded_%s %s\n# TYPE shaded_%s %s\n", name, help, name, type);
}

static void print_number(FILE *out, const char *name, const char *type, const char *help,
                         uint64_t number) {
    print_head(out, name, type, help);
    fprintf(out, "shaded_%s %" PRIu64 "\n", name, number);
}

/* The count is the sum of the buckets as they were read, so that the lines of one histogram
 * agree while others count on. Whole and fraction apart: %f would follow the locale. */
static void print_histogram(FILE *out, const char *name, const char *label, const char *text,
                            shd_histogram *histogram) {
    uint64_t sum = 0;
    for (size_t i = 0; i <= SHD_BUCKETS; i++) {
        sum += value_of(&histogram->buckets[i]);
        fprintf(out, "shaded_%s_bucket{%s=\"%s\",le=\"", name, label, text);
        if (i < SHD_BUCKETS)
            fprintf(out, "%g\"} %" PRIu64 "\n", bounds[i], sum);
        else
            fprintf(out, "+Inf\"} %" PRIu64 "\n", sum);
    }
    uint64_t nanoseconds = value_of(&histogram->nanoseconds);
    fprintf(out, "shaded_%s_sum{%s=\"%s\"} %" PRIu64 ".%09" PRIu64 "\n", name, label, text,
            nanoseconds / 1000000000, nanoseconds % 1000000000);
    fprintf(out, "shaded_%s_count{%s=\"%s\"} %" PRIu64 "\n", name, label, text, sum);
}

/* ---- What is there at the moment ---- */

static void print_requests_now(FILE *out, const shd_gauges *gauges) {
    print_head(out, "build_info", "gauge", "Constant 1, labelled with the version.");
    fprintf(out, "shaded_build_info{version=\"%s\"} 1\n", shd_version());
    print_number(out, "draining", "gauge", "1 while the daemon is stopping.", gauges->draining);
    print_number(out, "requests_in_flight", "gauge", "Requests begun and not yet answered.",
                 gauges->in_flight);
    print_number(out, "unsent_bytes", "gauge", "Bytes of answers that their clients are taking.",
                 gauges->unsent);
    print_head(out, "oldest_request_seconds", "gauge",
               "Time that the request has waited which has waited longest for its work.");
    uint64_t oldest = (uint64_t)(gauges->reaped.oldest * 1e3);
    fprintf(out, "shaded_oldest_request_seconds %" PRIu64 ".%03u\n", oldest / 1000,
            (unsigned)(oldest % 1000));
}

static void print_workers(FILE *out, const shd_gauges *gauges) {
    print_number(out, "queue_depth", "gauge", "Requests that wait for a thread.",
                 gauges->jobs.waiting);
    print_number(out, "queue_large", "gauge",
                 "Those of them that wait for the rest of their work, or as a large document.",
                 gauges->jobs.large_waiting);
    print_number(out, "large_begun", "gauge", "Such requests that were begun and are not done.",
                 gauges->jobs.large_begun);
    print_number(out, "workers", "gauge", "Rendering threads.", gauges->load.threads);
    print_number(out, "workers_busy", "gauge", "Rendering threads at work on a request.",
                 gauges->load.busy);
    print_number(out, "abandoned_encodings", "gauge",
                 "Threads of libwebp whose request has left them, until they next ask.",
                 gauges->load.abandoned);
    print_number(out, "stuck_workers", "gauge",
                 "Rendering threads that go on a second after their work was cancelled.",
                 gauges->jobs.stuck);
}

/* ---- What is kept ---- */

static void print_reuse(FILE *out, const shd_gauges *gauges) {
    print_number(out, "reuse_bytes", "gauge", "Memory of what later pictures may share.",
                 gauges->reuse.bytes);
    print_head(out, "reuse_lookups_total", "counter",
               "Pictures whose light, and else geometry, was looked for among earlier ones'.");
    const shd_reuse_load *reuse = &gauges->reuse;
    const struct {
        const char *kind, *result;
        uint64_t count;
    } lookups[] = {{"light", "hit", reuse->light_hits},
                   {"light", "miss", reuse->light_misses},
                   {"geometry", "hit", reuse->geometry_hits},
                   {"geometry", "miss", reuse->geometry_misses}};
    for (size_t i = 0; i < sizeof lookups / sizeof lookups[0]; i++)
        fprintf(out, "shaded_reuse_lookups_total{kind=\"%s\",result=\"%s\"} %" PRIu64 "\n",
                lookups[i].kind, lookups[i].result, lookups[i].count);
}

static void print_cache(FILE *out, shd_metrics *metrics, const shd_gauges *gauges) {
    const shd_cache_load *cache = &gauges->cache;
    print_number(out, "response_cache_bytes", "gauge", "Memory of finished pictures that are kept.",
                 cache->bytes);
    print_number(out, "response_cache_entries", "gauge", "Finished pictures that are kept.",
                 cache->entries);
    print_number(out, "response_cache_evictions_total", "counter",
                 "Finished pictures that were forgotten for lack of room.", cache->evictions);
    print_head(out, "response_cache_answers_total", "counter",
               "Pictures answered, by whether they were kept from an earlier request.");
    for (int hit = 0; hit < 2; hit++)
        fprintf(out, "shaded_response_cache_answers_total{result=\"%s\"} %" PRIu64 "\n",
                hit ? "hit" : "miss", value_of(&metrics->cached[hit]));
}

static void print_meshes(FILE *out, const shd_gauges *gauges) {
    const shd_mesh_load *meshes = &gauges->meshes;
    print_number(out, "mesh_store_bytes", "gauge", "Memory of meshes that are kept.",
                 meshes->bytes);
    print_number(out, "mesh_store_held_bytes", "gauge",
                 "Memory of meshes that are forgotten and that pictures still need.", meshes->held);
    print_number(out, "mesh_store_meshes", "gauge", "Meshes that are kept.", meshes->meshes);
    print_number(out, "mesh_store_evictions_total", "counter",
                 "Kept meshes that were forgotten for lack of room.", meshes->evictions);
    print_head(
        out, "mesh_store_lookups_total", "counter",
        "Meshes that scenes, and those who bring them, asked for, by whether they are kept.");
    for (int hit = 0; hit < 2; hit++)
        fprintf(out, "shaded_mesh_store_lookups_total{result=\"%s\"} %" PRIu64 "\n",
                hit ? "hit" : "miss", hit ? meshes->hits : meshes->misses);
}

/* ---- What came of requests ---- */

static void print_outcomes(FILE *out, shd_metrics *metrics, const shd_gauges *gauges) {
    print_number(out, "response_bytes_total", "counter", "Bytes of response bodies.",
                 value_of(&metrics->response_bytes));
    print_number(out, "saturated_samples_total", "counter",
                 "Samples that were not finite or beyond their output's range.",
                 value_of(&metrics->saturated));
    print_number(out, "joined_total", "counter", "Requests answered by the work for an equal one.",
                 value_of(&metrics->joined));
    print_number(out, "lent_total", "counter",
                 "Requests that ran between the tiles of a large picture.", gauges->load.lent);
    print_number(out, "left_total", "counter",
                 "Requests whose client left before the answer was there.",
                 value_of(&metrics->left));
    print_number(out, "aborted_total", "counter",
                 "Requests that got no answer, or whose client did not take it.",
                 value_of(&metrics->aborted));
}

static void print_memory(FILE *out, shd_metrics *metrics, const shd_gauges *gauges) {
    const shd_budget_load *memory = &gauges->memory;
    print_number(out, "memory_budget_bytes", "gauge", "Memory that the process may take.",
                 memory->cap);
    print_number(
        out, "memory_used_bytes", "gauge",
        "Memory that is taken or reserved of it, by the program, requests, answers and what "
        "is kept.",
        memory->used);
    print_number(out, "memory_refused_total", "counter",
                 "Times that other requests had the memory that one wanted.", memory->refused);
    print_number(out, "request_memory_high_water_bytes", "gauge",
                 "The most memory that one request has taken from its arena.",
                 atomic_load(&metrics->memory));
}

static void print_refusals(FILE *out, shd_metrics *metrics) {
    print_head(out, "refused_total", "counter", "Requests over a limit, by its name.");
    for (shd_limit i = SHD_LIMIT_NONE + 1; i < SHD_LIMIT_COUNT; i++)
        fprintf(out, "shaded_refused_total{limit=\"%s\"} %" PRIu64 "\n", shd_limit_names[i],
                value_of(&metrics->refused[i]));
    print_head(out, "unreadable_total", "counter",
               "Requests that could not be read, by the status of their refusal.");
    static const unsigned told[] = {400, 413, 414, 431, 500, 505};
    for (size_t i = 0; i < sizeof told / sizeof told[0]; i++)
        fprintf(out, "shaded_unreadable_total{status=\"%u\"} %" PRIu64 "\n", told[i],
                value_of(&metrics->unreadable[index_of(told[i])]));
}

static void print_connections(FILE *out, shd_metrics *metrics, const shd_gauges *gauges) {
    print_head(out, "reloads_total", "counter", "Configurations read again.");
    for (int good = 0; good < 2; good++)
        fprintf(out, "shaded_reloads_total{result=\"%s\"} %" PRIu64 "\n", good ? "done" : "failed",
                value_of(&metrics->reloads[good]));
    print_head(out, "connections", "gauge", "Connections by what they are at.");
    for (size_t phase = 0; phase < SHD_PHASES; phase++)
        fprintf(out, "shaded_connections{at=\"%s\"} %zu\n", phase_names[phase],
                gauges->reaped.connections[phase]);
    print_head(
        out, "connections_ended_total", "counter",
        "Connections that were ended: over a time, left by their client, for room, for memory.");
    for (size_t ending = 0; ending < SHD_ENDINGS; ending++)
        fprintf(out, "shaded_connections_ended_total{reason=\"%s\"} %" PRIu64 "\n",
                ending_names[ending], gauges->reaped.ended[ending]);
}

/* A route's path, without the segment that stands for any and its slash. */
static const char *label_of(shd_route route, char out[LABEL_SIZE]) {
    size_t length = shd_path_fixed(route);
    if (shd_paths[route].path[length]) length--;
    snprintf(out, LABEL_SIZE, "%.*s", (int)length, shd_paths[route].path);
    return out;
}

static void print_requests(FILE *out, shd_metrics *metrics) {
    /* Those that have not come, too: Prometheus sees no increase in what begins with 1. */
    print_head(out, "requests_total", "counter", "Requests by route and status.");
    for (shd_route route = 0; route < SHD_ROUTE_COUNT; route++)
        for (size_t i = 0; i < SHD_STATUSES; i++) {
            char name[LABEL_SIZE];
            uint64_t number = value_of(&metrics->requests[route][i]);
            fprintf(out, "shaded_requests_total{route=\"%s\",status=\"", label_of(route, name));
            if (statuses[i])
                fprintf(out, "%u\"} %" PRIu64 "\n", statuses[i], number);
            else
                fprintf(out, "other\"} %" PRIu64 "\n", number);
        }
}

static void print_durations(FILE *out, shd_metrics *metrics) {
    print_head(out, "request_duration_seconds", "histogram",
               "Time from a request's first line to the end of its answer.");
    for (shd_route route = 0; route < SHD_ROUTE_COUNT; route++) {
        char name[LABEL_SIZE];
        print_histogram(out, "request_duration_seconds", "route", label_of(route, name),
                        &metrics->durations[route]);
    }

    print_head(out, "stage_duration_seconds", "histogram",
               "Time of threads that a picture took by stage; of queue: time waited.");
    for (size_t stage = 0; stage < SHD_STAGE_COUNT; stage++)
        print_histogram(out, "stage_duration_seconds", "stage", stage_names[stage],
                        &metrics->stages[stage]);
}

char *shd_metrics_text(shd_metrics *metrics, const shd_gauges *gauges, size_t *length) {
    char *text = NULL;
    FILE *out = open_memstream(&text, length);
    if (!out) return NULL;
    print_requests_now(out, gauges);
    print_workers(out, gauges);
    print_reuse(out, gauges);
    print_cache(out, metrics, gauges);
    print_meshes(out, gauges);
    print_outcomes(out, metrics, gauges);
    print_memory(out, metrics, gauges);
    print_refusals(out, metrics);
    print_connections(out, metrics, gauges);
    print_requests(out, metrics);
    print_durations(out, metrics);
    shd_quotas_print(gauges->quotas, out);
    shd_process_print(out);
    if (!fclose(out)) return text;
    free(text);
    return NULL;
}
