/* The daemon as all of its parts see it.
 *
 *     main.c      starts and stops everything
 *     exchange.c  one request on its way: its state, and what waits for its answer
 *     paths.c     which paths and methods there are; routes.c  what is answered there
 *     conn/       sockets and connections, and what comes over them: heads, bodies
 *     access/     who asks, and what they may
 *     jobs/       what workers do, in which turn, and who waits for it
 *     answer/     answers before they become HTTP, and those that are kept
 *     ops/        what operators set, and what they are told */
#pragma once

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "server/ops/config.h"
#include "server/ops/metrics.h"
#include "shaded.h"

typedef struct shd_server {
    shd_config config;  /* as it was at the start, for what cannot change */
    shd_budget *budget; /* all memory of the process */
    shd_engine *engine; /* the first one, whose workers all others use */
    pthread_mutex_t settings_mutex;
    struct shd_settings *settings; /* for new requests; see shd_server_settings */
    struct shd_quotas *quotas;     /* of tokens, whatever settings these are in */
    struct shd_jobs *jobs;
    struct shd_cache *cache;
    struct shd_scene_folder *scenes; /* NULL: they are kept in memory alone */
    struct shd_linger *linger;
    struct shd_reaper *reaper;
    /* http.c's answer if there is no memory for any other. */
    struct MHD_Response *last_words;
    shd_metrics metrics;
    uint32_t run; /* random, so that request ids differ between runs */
    atomic_uint next_id;
    atomic_bool draining;
    atomic_bool stopping;     /* what is unfinished is cancelled */
    atomic_uint in_flight;    /* exchanges whose head was read, until they are completed */
    atomic_uint accepted;     /* those of them whose body was read too */
    atomic_uint suspended;    /* those of them that wait for a job */
    uint64_t places;          /* requests that may wait or be worked on */
    _Atomic(uint64_t) unsent; /* bytes of answers that are on their way */
    atomic_bool loose_told;   /* the log has that decoders have no filter */
    atomic_bool worked;       /* there were requests since shd_memory_rest */
    /* Memory of bodies that are coming, or that jobs have. */
    _Atomic(uint64_t) body_bytes;
} shd_server;

enum { SHD_ID_SIZE = 65 };
