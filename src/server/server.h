/* What the parts of the daemon share, and one request on its way through them.
 *
 *     main.c    starts and stops everything
 *     http.c    libmicrohttpd: connections, bodies, sending; the only thread is its I/O thread
 *     head.c    what the head of a request says; body.c  its body while it comes
 *     framing.c what it lets pass, though others read it differently
 *     routes.c  which paths and methods there are, and what can be answered at once
 *     jobs.c    which exchange waits for which work, and for how long; turns.c  what is next
 *     job.c     how the engine's workers do it; stuck.c  which of them do not end
 *     render_job.c, json_job.c, mesh_job.c  what a worker does for a kind of work
 *     inflate.c bodies in gzip and zstd
 *     cache.c   finished pictures, for who asks for the same ones
 *     preview.c  links as documents; signatures
 *     negotiate.c  what Accept and If-None-Match mean
 *     reply.c, problem.c  answers before they become HTTP, refusals among them
 *     memory.c  what the process may have, and who gets how much of it
 *     settings.c  what SIGHUP changes, from config.c
 *     tokens.c, quota.c, access.c  tokens and their rates; keys and origins
 *     admin.c, metrics.c, process.c, log.c, request_log.c, trace.c  the operators' port, and what
 *                they are told
 *     descriptors.c  what is left of them for that port
 *     client.c  who a request is from; private.c  who may keep its answer
 *     doors.c, address.c, systemd.c  sockets, opened here or handed over
 *
 * An exchange belongs to the I/O thread, but to jobs.c between shd_exchange_suspend and
 * shd_exchange_resume. */
#ifndef SHD_SERVER_SERVER_H
#define SHD_SERVER_SERVER_H

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "server/access/client.h"
#include "server/answer/cache.h"
#include "server/answer/reply.h"
#include "server/conn/linger.h"
#include "server/conn/reaper.h"
#include "server/conn/trace.h"
#include "server/jobs/jobs.h"
#include "server/ops/config.h"
#include "server/ops/memory.h"
#include "server/ops/metrics.h"
#include "server/ops/settings.h"
#include "shaded.h"

struct MHD_Response;

typedef struct shd_server {
    shd_config config;  /* as it was at the start: for what cannot change */
    shd_budget *budget; /* all memory of the process */
    shd_engine *engine; /* the first one, whose workers all others use */
    pthread_mutex_t settings_mutex;
    shd_settings *settings; /* for new requests; see shd_server_settings */
    shd_quotas *quotas;     /* of tokens, whatever settings these are in */
    shd_jobs *jobs;
    struct shd_stuck *stuck; /* workers that do not leave what was cancelled */
    shd_cache *cache;
    shd_linger *linger;
    shd_reaper *reaper;
    struct MHD_Response *last_words; /* http.c's, for want of memory for any other */
    shd_metrics metrics;
    uint32_t run; /* random, so that request ids differ between runs */
    atomic_uint next_id;
    atomic_bool draining;
    atomic_uint in_flight;        /* exchanges whose head was read, until they are completed */
    atomic_uint accepted;         /* those of them whose body was read too */
    atomic_uint suspended;        /* those of them that wait for a job */
    uint64_t places;              /* requests that may wait or be worked on */
    _Atomic(uint64_t) unsent;     /* bytes of answers that are on their way */
    atomic_bool worked;           /* there were requests since shd_memory_rest */
    _Atomic(uint64_t) body_bytes; /* memory of bodies: that are coming, or that jobs have */
} shd_server;

typedef enum shd_method {
    SHD_GET = 1,
    SHD_HEAD = 2,
    SHD_POST = 4,
    SHD_OPTIONS = 8,
    SHD_PUT = 16,
    SHD_NO_METHOD = 0 /* any other */
} shd_method;

enum { SHD_ID_SIZE = 65, SHD_PATH_SIZE = 512 };

struct shd_route;
struct MHD_Connection;

struct shd_exchange {
    shd_server *server;
    shd_settings *settings;
    const struct shd_route *route; /* NULL: there is no such path */
    char id[SHD_ID_SIZE];
    shd_method method;
    char method_name[16], path[SHD_PATH_SIZE]; /* for the log; cut where longer */
    bool path_cut;
    char client[SHD_CLIENT_SIZE]; /* "": its head was not read */
    const char *token; /* name of the token that let it in, "" without one; NULL: none did */
    long long expires; /* of the link that let it in, seconds since 1970; 0: never */
    char *target;      /* path and query as they were sent; owned */

    /* The head's fields; NULL where there are none. Strings live as long as the exchange. */
    char *accept, *accept_encoding, *content_encoding, *if_none_match, *forwarded_for;
    const char *content_type, *origin;
    const char *authorization; /* a secret; NULL too where there is more than one */
    bool is_preflight;
    shd_trace trace;

    shd_digest digest; /* of a path that ends in one */
    bool is_binary;    /* the body is application/octet-stream */
    shd_coding coding; /* of the body */
    unsigned char *body;
    size_t size, capacity; /* capacity: of what the server's body_bytes counts */

    double started, submitted; /* on shd_now()'s clock */
    shd_waiter waiter;
    shd_reply reply;
    const char *limit; /* that it was over; NULL: none */

    /* http.c's own. */
    struct MHD_Connection *connection;
    size_t unsent;          /* bytes of its answer, of those that the server counts */
    const char *target_end; /* in libmicrohttpd's memory, until the head is read */
    bool path_hides;        /* the path has a "/" or a 0 byte, percent-encoded */
    int state;
    bool refused, counted, was_accepted, is_suspended;
};

/* The settings of now, of which the caller becomes a holder; and others from now on. */
shd_settings *shd_server_settings(shd_server *server);
void shd_server_replace(shd_server *server, shd_settings *settings);

/* Takes the connection from the I/O thread's loop, before the exchange waits for a job. */
void shd_exchange_suspend(shd_exchange *exchange);

/* Gives it back once the reply is there, or its client has gone: then the reply is empty. The
 * exchange may not exist any more when this returns. */
void shd_exchange_resume(shd_exchange *exchange);

#endif
