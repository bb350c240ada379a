#include "metrics.h"

#include <inttypes.h>
#include <stdlib.h>
#include <string.h>

#include "process.h"

const char *const shd_stage_names[SHD_STAGE_COUNT] = {
    "queue", "parse", "plan", "build", "visibility", "shade", "shadow", "trace", "color", "encode"};
static const char *const phase_names[SHD_PHASES] = {"rest", "head", "body", "work", "answer"};
static const char *const filed_names[SHD_FILED_COUNT] = {
    "written", "known", "read", "missing", "damaged", "unreadable", "unwritable"};
static const char *const ending_names[SHD_ENDINGS] = {"time", "left", "room", "memory"};

/* The last one, 0, takes every other status. */
static const unsigned statuses[SHD_STATUSES] = {200, 201, 204, 304, 400, 401, 403, 404,
                                                405, 406, 409, 413, 414, 415, 422, 429,
                                                431, 500, 501, 503, 504, 505, 507, 0};

static const double bounds[SHD_BUCKETS] = {0.0005, 0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1,
                                           0.25,   0.5,   1,      2.5,   5,    10,    30};

static void observe_time(shd_histogram *histogram, double seconds) {
    size_t bucket = 0;
    while (bucket < SHD_BUCKETS && seconds > bounds[bucket]) bucket++;
    atomic_fetch_add(&histogram->buckets[bucket], 1);
    if (seconds > 0) atomic_fetch_add(&histogram->nanoseconds, (uint64_t)(seconds * 1e9));
}

enum { LABEL_SIZE = 32 };

static size_t index_of(unsigned status) {
    size_t index = 0;
    while (index < SHD_STATUSES - 1 && statuses[index] != status) index++;
    return index;
}

void shd_metrics_request(shd_metrics *metrics, shd_route route, unsigned status, double seconds,
                         size_t bytes) {
    atomic_fetch_add(&metrics->requests[route][index_of(status)], 1);
    atomic_fetch_add(&metrics->response_bytes, bytes);
    observe_time(&metrics->durations[route], seconds);
}

void shd_metrics_refused(shd_metrics *metrics, shd_limit limit) {
    if (limit) atomic_fetch_add(&metrics->refused[limit], 1);
}

void shd_metrics_unreadable(shd_metrics *metrics, unsigned status) {
    atomic_fetch_add(&metrics->unreadable[index_of(status)], 1);
}

void shd_metrics_memory(shd_metrics *metrics, size_t bytes) {
    size_t most = atomic_load(&metrics->memory);
    while (bytes > most && !atomic_compare_exchange_weak(&metrics->memory, &most, bytes)) continue;
}

void shd_metrics_cached(shd_metrics *metrics, shd_cached cached) {
    if (cached != SHD_CACHE_OFF) atomic_fetch_add(&metrics->cached[cached == SHD_CACHE_HIT], 1);
}

void shd_metrics_stage(shd_metrics *metrics, shd_stage stage, double seconds) {
    observe_time(&metrics->stages[stage], seconds);
}

static void print_head(FILE *out, const char *prefix, const char *name, const char *type,
                       const char *help) {
    fprintf(out, "# HELP %s%s %s\n# TYPE %s%s %s\n", prefix, name, help, prefix, name, type);
}

static void print_metrics(FILE *out, const char *prefix, const shd_metric *metrics, size_t count) {
    for (const shd_metric *m = metrics; m < metrics + count; m++) {
        if (*m->help)
            print_head(out, prefix, m->name, strstr(m->name, "_total") ? "counter" : "gauge",
                       m->help);
        fprintf(out, "%s%s%s ", prefix, m->name, m->labels);
        if (strstr(m->name, "_seconds")) /* whole and fraction apart: %f would follow the locale */
            fprintf(out, "%" PRIu64 ".%03u\n", m->value / 1000, (unsigned)(m->value % 1000));
        else
            fprintf(out, "%" PRIu64 "\n", m->value);
    }
}

static void print_labelled(FILE *out, const char *name, const char *label, const char *text,
                           uint64_t number) {
    fprintf(out, "shaded_%s{%s=\"%s\"} %" PRIu64 "\n", name, label, text, number);
}

/* The count is the sum of the buckets as they were read, so that the lines of one histogram
 * agree while others count on. */
static void print_histogram(FILE *out, const char *name, const char *label, const char *text,
                            shd_histogram *histogram) {
    uint64_t sum = 0;
    for (size_t i = 0; i <= SHD_BUCKETS; i++) {
        sum += atomic_load(&histogram->buckets[i]);
        fprintf(out, "shaded_%s_bucket{%s=\"%s\",le=\"", name, label, text);
        if (i < SHD_BUCKETS)
            fprintf(out, "%g\"} %" PRIu64 "\n", bounds[i], sum);
        else
            fprintf(out, "+Inf\"} %" PRIu64 "\n", sum);
    }
    uint64_t nanoseconds = atomic_load(&histogram->nanoseconds);
    fprintf(out, "shaded_%s_sum{%s=\"%s\"} %" PRIu64 ".%09" PRIu64 "\n", name, label, text,
            nanoseconds / 1000000000, nanoseconds % 1000000000);
    fprintf(out, "shaded_%s_count{%s=\"%s\"} %" PRIu64 "\n", name, label, text, sum);
}

/* What is there at the moment, and what is kept. */
static void print_present(FILE *out, shd_metrics *metrics, const shd_gauges *now) {
    print_head(out, "shaded_", "build_info", "gauge", "Constant 1, labelled with the version.");
    print_labelled(out, "build_info", "version", shd_version(), 1);
    const shd_metric present[] = {
        {"draining", "", "1 while the daemon is stopping.", now->draining},
        {"requests_in_flight", "", "Requests begun and not yet answered.", now->in_flight},
        {"unsent_bytes", "", "Bytes of answers that their clients are taking.", now->unsent},
        {"oldest_request_seconds", "",
         "Time that the request has waited which has waited longest for its work.",
         (uint64_t)(now->reaped.oldest * 1e3)},
        {"queue_depth", "", "Requests that wait for a thread.", now->jobs.waiting},
        {"queue_large", "",
         "Those of them that wait for the rest of their work, or as a large document.",
         now->jobs.large_waiting},
        {"large_begun", "", "Such requests that were begun and are not done.",
         now->jobs.large_begun},
        {"workers", "", "Rendering threads.", now->load.threads},
        {"workers_busy", "", "Rendering threads at work on a request.", now->load.busy},
        {"abandoned_encodings", "",
         "Threads of libwebp whose request has left them, until they next ask.",
         now->load.abandoned},
        {"stuck_workers", "",
         "Rendering threads that go on a second after their work was cancelled.", now->jobs.stuck},
        {"reuse_bytes", "", "Memory of what later pictures may share.", now->reuse.bytes},
        {"reuse_lookups_total", "{kind=\"light\",result=\"hit\"}",
         "Pictures whose light, and else geometry, was looked for among earlier ones'.",
         now->reuse.light_hits},
        {"reuse_lookups_total", "{kind=\"light\",result=\"miss\"}", "", now->reuse.light_misses},
        {"reuse_lookups_total", "{kind=\"geometry\",result=\"hit\"}", "", now->reuse.geometry_hits},
        {"reuse_lookups_total", "{kind=\"geometry\",result=\"miss\"}", "",
         now->reuse.geometry_misses},
        {"response_cache_bytes", "", "Memory of finished pictures that are kept.",
         now->cache.bytes},
        {"response_cache_entries", "", "Finished pictures that are kept.", now->cache.entries},
        {"response_cache_evictions_total", "",
         "Finished pictures that were forgotten for lack of room.", now->cache.evictions},
        {"response_cache_answers_total", "{result=\"miss\"}",
         "Pictures answered, by whether they were kept from an earlier request.",
         atomic_load(&metrics->cached[0])},
        {"response_cache_answers_total", "{result=\"hit\"}", "", atomic_load(&metrics->cached[1])},
        {"mesh_store_bytes", "", "Memory of meshes, scenes and pictures kept.", now->meshes.bytes},
        {"mesh_store_held_bytes", "",
         "Memory of those that are forgotten and that pictures still need.", now->meshes.held},
        {"mesh_store_meshes", "", "Meshes, scenes and pictures kept.", now->meshes.meshes},
        {"mesh_store_evictions_total", "", "Kept things that were forgotten for lack of room.",
         now->meshes.evictions},
        {"mesh_store_lookups_total", "{result=\"miss\"}",
         "Meshes that scenes, and those who bring them, asked for, by whether they are kept.",
         now->meshes.misses},
        {"mesh_store_lookups_total", "{result=\"hit\"}", "", now->meshes.hits}};
    print_metrics(out, "shaded_", present, sizeof present / sizeof present[0]);
}

static void print_outcomes(FILE *out, shd_metrics *metrics, const shd_gauges *now) {
    const shd_metric outcomes[] = {
        {"response_bytes_total", "", "Bytes of response bodies.",
         atomic_load(&metrics->response_bytes)},
        {"saturated_samples_total", "",
         "Samples that were not finite or beyond their output's range.",
         atomic_load(&metrics->saturated)},
        {"clipped_samples_total", "",
         "Color samples of 8 and 16 bits whose value was beyond what these hold.",
         atomic_load(&metrics->clipped)},
        {"joined_total", "", "Requests answered by the work for an equal one.",
         atomic_load(&metrics->joined)},
        {"lent_total", "", "Requests that ran between the tiles of a large picture.",
         now->load.lent},
        {"tiles_total", "{result=\"made\"}",
         "Tiles of 32 by 32 pixels that were lit, by whether their picture was still wanted then.",
         now->load.tiles},
        {"tiles_total", "{result=\"unwanted\"}", "", now->load.unwanted},
        {"left_total", "", "Requests whose client left before the answer was there.",
         atomic_load(&metrics->left)},
        {"aborted_total", "", "Requests that got no answer, or whose client did not take it.",
         atomic_load(&metrics->aborted)},
        {"memory_budget_bytes", "", "Memory that the process may take.", now->memory.cap},
        {"memory_used_bytes", "",
         "Memory that is taken or reserved of it, by the program, requests, answers and what "
         "is kept.",
         now->memory.used},
        {"memory_refused_total", "", "Times that other requests had the memory that one wanted.",
         now->memory.refused},
        {"request_memory_high_water_bytes", "",
         "The most memory that one request has taken from its arena.",
         atomic_load(&metrics->memory)}};
    print_metrics(out, "shaded_", outcomes, sizeof outcomes / sizeof outcomes[0]);
}

static void print_files(FILE *out, shd_metrics *metrics) {
    print_head(out, "shaded_", "scene_files_total", "counter",
               "Files of scenes, by what was done with them or could not be.");
    for (size_t i = 0; i < SHD_FILED_COUNT; i++)
        print_labelled(out, "scene_files_total", "result", filed_names[i],
                       atomic_load(&metrics->scene_files[i]));
}

/* Requests over a limit, and those that could not be read. */
static void print_refusals(FILE *out, shd_metrics *metrics) {
    print_head(out, "shaded_", "refused_total", "counter", "Requests over a limit, by its name.");
    for (shd_limit i = SHD_LIMIT_NONE + 1; i < SHD_LIMIT_COUNT; i++)
        print_labelled(out, "refused_total", "limit", shd_limit_names[i],
                       atomic_load(&metrics->refused[i]));
    print_head(out, "shaded_", "unreadable_total", "counter",
               "Requests that could not be read, by the status of their refusal.");
    static const unsigned told[] = {400, 413, 414, 431, 500, 505};
    for (size_t i = 0; i < sizeof told / sizeof told[0]; i++)
        fprintf(out, "shaded_unreadable_total{status=\"%u\"} %" PRIu64 "\n", told[i],
                atomic_load(&metrics->unreadable[index_of(told[i])]));
}

static void print_connections(FILE *out, shd_metrics *metrics, const shd_gauges *now) {
    print_head(out, "shaded_", "reloads_total", "counter", "Configurations read again.");
    print_labelled(out, "reloads_total", "result", "failed", atomic_load(&metrics->reloads[false]));
    print_labelled(out, "reloads_total", "result", "done", atomic_load(&metrics->reloads[true]));
    print_head(out, "shaded_", "connections", "gauge", "Connections by what they are at.");
    for (size_t i = 0; i < SHD_PHASES; i++)
        print_labelled(out, "connections", "at", phase_names[i], now->reaped.connections[i]);
    print_head(
        out, "shaded_", "connections_ended_total", "counter",
        "Connections that were ended: over a time, left by their client, for room, for memory.");
    for (size_t i = 0; i < SHD_ENDINGS; i++)
        print_labelled(out, "connections_ended_total", "reason", ending_names[i],
                       now->reaped.ended[i]);
}

/* A route's path, without the segment that stands for any and, unless that leaves another route's,
 * without its slash. */
static const char *label_of(shd_route route, char out[LABEL_SIZE]) {
    size_t length = shd_path_fixed(route);
    snprintf(out, LABEL_SIZE, "%.*s", (int)length, shd_paths[route].path);
    if (!shd_paths[route].path[length]) return out;
    out[length - 1] = 0;
    if (shd_path_find(out) != SHD_ROUTE_OTHER) out[length - 1] = '/';
    return out;
}

static void print_requests(FILE *out, shd_metrics *metrics) {
    /* Those that have not come, too: Prometheus sees no increase in what begins with 1. */
    print_head(out, "shaded_", "requests_total", "counter", "Requests by route and status.");
    for (shd_route route = 0; route < SHD_ROUTE_COUNT; route++)
        for (size_t i = 0; i < SHD_STATUSES; i++) {
            char name[LABEL_SIZE], status[LABEL_SIZE] = "other";
            if (statuses[i]) snprintf(status, sizeof status, "%u", statuses[i]);
            fprintf(out, "shaded_requests_total{route=\"%s\",status=\"%s\"} %" PRIu64 "\n",
                    label_of(route, name), status, atomic_load(&metrics->requests[route][i]));
        }
}

static void print_durations(FILE *out, shd_metrics *metrics) {
    print_head(out, "shaded_", "request_duration_seconds", "histogram",
               "Time from a request's first line to the end of its answer.");
    for (shd_route route = 0; route < SHD_ROUTE_COUNT; route++) {
        char name[LABEL_SIZE];
        print_histogram(out, "request_duration_seconds", "route", label_of(route, name),
                        &metrics->durations[route]);
    }
    print_head(out, "shaded_", "stage_duration_seconds", "histogram",
               "Time of threads that a picture took by stage; of queue: time waited.");
    for (size_t stage = 0; stage < SHD_STAGE_COUNT; stage++)
        print_histogram(out, "stage_duration_seconds", "stage", shd_stage_names[stage],
                        &metrics->stages[stage]);
}

char *shd_metrics_text(shd_metrics *metrics, const shd_gauges *gauges) {
    char *text = NULL;
    size_t length;
    shd_metric process[SHD_PROCESS_METRICS];
    FILE *out = open_memstream(&text, &length);
    if (!out) return NULL;
    print_present(out, metrics, gauges);
    print_outcomes(out, metrics, gauges);
    print_refusals(out, metrics);
    print_files(out, metrics);
    print_connections(out, metrics, gauges);
    print_requests(out, metrics);
    print_durations(out, metrics);
    shd_quotas_print(gauges->quotas, out);
    print_metrics(out, "process_", process, shd_process_metrics(process));
    if (!fclose(out)) return text;
    free(text);
    return NULL;
}
