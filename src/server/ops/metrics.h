/* Counters for operators, in Prometheus' text format. All of them are atomic: any thread. */
#pragma once

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "server/access/quota.h"
#include "server/answer/cache.h"
#include "server/conn/reaper.h"
#include "server/paths.h"
#include "shaded.h"

typedef enum shd_stage {
    SHD_STAGE_QUEUE, /* waiting for a thread; the others are as in shd_times */
    SHD_STAGE_PARSE,
    SHD_STAGE_PLAN,
    SHD_STAGE_BUILD,
    SHD_STAGE_VISIBILITY,
    SHD_STAGE_SHADE,
    SHD_STAGE_SHADOW,
    SHD_STAGE_TRACE,
    SHD_STAGE_COLOR,
    SHD_STAGE_ENCODE,
    SHD_STAGE_COUNT
} shd_stage;

extern const char *const shd_stage_names[SHD_STAGE_COUNT];

enum { SHD_BUCKETS = 15, SHD_STATUSES = 24 };

/* What was done with a file of a scene that is kept, or could not be. */
typedef enum shd_filed {
    SHD_FILED_WRITTEN,
    SHD_FILED_KNOWN, /* it was there already */
    SHD_FILED_READ,
    SHD_FILED_MISSING,
    SHD_FILED_DAMAGED,
    SHD_FILED_UNREADABLE,
    SHD_FILED_UNWRITABLE,
    SHD_FILED_COUNT
} shd_filed;

typedef struct shd_histogram {
    atomic_uint_least64_t buckets[SHD_BUCKETS + 1]; /* the last one has no upper bound */
    atomic_uint_least64_t nanoseconds;
} shd_histogram;

typedef struct shd_metrics {
    atomic_uint_least64_t requests[SHD_ROUTE_COUNT][SHD_STATUSES];
    atomic_uint_least64_t response_bytes, saturated, clipped;
    atomic_uint_least64_t joined;    /* requests that were answered by another one's job */
    atomic_uint_least64_t left;      /* requests whose client left before their job was done */
    atomic_uint_least64_t cached[2]; /* pictures that were made, that the response cache had */
    atomic_uint_least64_t aborted; /* requests without an answer, or whose client did not take it */
    atomic_uint_least64_t refused[SHD_LIMIT_COUNT]; /* by the limit that they were over */
    atomic_uint_least64_t unreadable[SHD_STATUSES];
    atomic_uint_least64_t scene_files[SHD_FILED_COUNT];
    atomic_size_t memory;             /* the most that one request has taken */
    atomic_uint_least64_t reloads[2]; /* that failed, that were done */
    shd_histogram durations[SHD_ROUTE_COUNT];
    shd_histogram stages[SHD_STAGE_COUNT];
} shd_metrics;

void shd_metrics_request(shd_metrics *metrics, shd_route route, unsigned status, double seconds,
                         size_t bytes);

void shd_metrics_refused(shd_metrics *metrics, shd_limit limit); /* SHD_LIMIT_NONE: was not */

/* A request that could not be read, and was refused without becoming an exchange, or ended one. */
void shd_metrics_unreadable(shd_metrics *metrics, unsigned status);

void shd_metrics_cached(shd_metrics *metrics, shd_cached cached); /* a picture that is answered */
void shd_metrics_memory(shd_metrics *metrics, size_t bytes);      /* of a request that is done */
void shd_metrics_stage(shd_metrics *metrics, shd_stage stage, double seconds);

/* Jobs, at one moment. */
typedef struct shd_jobs_load {
    size_t waiting;       /* that no worker has, large ones among them */
    size_t large_waiting; /* of that lane: read, or large by their document's size */
    size_t large_begun;   /* of that lane, and not done yet */
    size_t stuck;         /* cancelled, and held by their worker all the same */
} shd_jobs_load;

/* What is true just now, beside the counters. */
typedef struct shd_gauges {
    shd_load load;
    shd_jobs_load jobs;
    shd_reaped reaped;
    shd_reuse_load reuse;
    shd_cache_load cache;
    shd_budget_load memory;
    shd_mesh_load meshes;
    shd_quotas *quotas;
    unsigned in_flight;
    uint64_t unsent; /* bytes of answers that are on their way */
    bool draining;
} shd_gauges;

/* The text of /metrics; the caller frees it. NULL if memory is short. */
char *shd_metrics_text(shd_metrics *metrics, const shd_gauges *gauges);
