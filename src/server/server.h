/* What the parts of the daemon share, and one request on its way through them.
 *
 *     main.c    starts and stops everything
 *     http.c    libmicrohttpd: connections, bodies, sending; the only thread is its I/O thread
 *     routes.c  which paths and methods there are, and what can be answered at once
 *     job.c     how work gets to the engine's workers and how it ends
 *     render_job.c, compare_job.c  what a worker does for POST /v1/render and /v1/compare
 *     admin.c   the operators' port
 *
 * An exchange belongs to the I/O thread, but to one worker between shd_exchange_suspend and
 * shd_exchange_resume. */
#ifndef SHD_SERVER_SERVER_H
#define SHD_SERVER_SERVER_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "config.h"
#include "linger.h"
#include "metrics.h"
#include "reaper.h"
#include "reply.h"
#include "shaded.h"
#include "watch.h"

/* A text that never changes while the daemon runs. */
typedef struct shd_document {
    const char *media_type;
    const void *data;
    size_t size;
    bool owned;
    char etag[20];
} shd_document;

typedef struct shd_server {
    shd_config config;
    shd_engine *engine;
    shd_watch *watch;
    shd_linger *linger;
    shd_reaper *reaper;
    shd_metrics metrics;
    shd_document documents[SHD_ROUTE_COUNT]; /* size 0: the route has none */
    uint32_t run;                            /* random, so that request ids differ between runs */
    atomic_uint next_id;
    atomic_bool draining;
    atomic_uint in_flight; /* exchanges whose head was read, until they are completed */
    atomic_uint accepted;  /* those of them whose body was read too */
    atomic_uint suspended; /* those of them that a worker has */
} shd_server;

typedef enum shd_method {
    SHD_GET = 1,
    SHD_HEAD = 2,
    SHD_POST = 4,
    SHD_OPTIONS = 8,
    SHD_NO_METHOD = 0 /* any other */
} shd_method;

enum { SHD_ID_SIZE = 65, SHD_PATH_SIZE = 512 };

struct shd_route;
struct shd_exchange;
struct MHD_Connection;

/* Reads the body and fills the reply, on a worker; leaves it empty where the request was
 * cancelled, for job.c knows why. `queued`: seconds waited. */
typedef void shd_work(struct shd_exchange *exchange, shd_request *request, double queued);

typedef struct shd_exchange {
    shd_server *server;
    const struct shd_route *route; /* NULL: there is no such path */
    char id[SHD_ID_SIZE];
    shd_method method;
    char method_name[16], path[SHD_PATH_SIZE]; /* for the log; cut where longer */
    bool path_cut;

    /* The head's fields; NULL where there are none. Strings live as long as the exchange. */
    char *accept, *if_none_match;
    const char *content_type, *content_encoding;

    unsigned char *body;
    size_t size, capacity;

    double started, submitted; /* on shd_now()'s clock */
    shd_work *work;
    shd_watched watched;
    shd_reply reply;

    /* http.c's own. */
    struct MHD_Connection *connection;
    int state;
    bool refused, counted, was_accepted, is_suspended;
} shd_exchange;

/* Takes the connection from the I/O thread's loop, before the exchange is given to a worker. */
void shd_exchange_suspend(shd_exchange *exchange);

/* Gives it back once the reply is there; the exchange may be gone when this returns. */
void shd_exchange_resume(shd_exchange *exchange);

#endif
