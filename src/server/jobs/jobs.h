/* Who waits for which job, whose turn it is, and until when.
 *
 * Waiters are the requests of clients: they come, wait for a job of their own or for an equal one
 * that is there, and get their answer by a call, each exactly once. Jobs wait in a fair queue
 * (queue.h) until a worker of the engine has time for them.
 *
 * A deadline is the job's, from when it was first asked for. Who comes in its first half joins it,
 * and shares its end; later ones begin it anew, so that nobody waits for work that has no time
 * left, and no crowd keeps any work alive.
 *
 * There are only so many waiters at a time, since each holds a connection: if they are too many,
 * the newest of the client that has most is sent away.
 *
 * All functions may be called from any thread. None of them calls a function of its options or
 * shd_waiter.answer with a lock held. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"
#include "queue.h"
#include "server/answer/reply.h"
#include "server/ops/metrics.h"
#include "shaded.h"

typedef struct shd_jobs shd_jobs;
typedef struct shd_job shd_job;
typedef struct shd_exchange shd_exchange;

/* A request that waits: a part of its exchange, filled by it up to `answer`, the rest zero. */
typedef struct shd_waiter {
    const char *client;           /* client.h */
    const shd_exchange *exchange; /* for the functions of shd_work */
    double asked;                 /* on shd_now()'s clock */
    shd_reply *reply;             /* empty */
    /* The reply is there. The waiter, and what it is a part of, may go with this call. */
    void (*answer)(struct shd_waiter *waiter);

    shd_job *job;             /* NULL: it does not wait */
    struct shd_waiter *other; /* another one that waits for the same job */
    bool joined;              /* the job is another one's, too, and was there already */
    shd_turn turn;            /* its place among those who wait */
    /* Why it is sent away, and when it may come again. */
    enum shd_sent {
        SHD_SENT_NOT, /* it has its answer */
        SHD_SENT_LATE,
        SHD_SENT_FULL,
        SHD_SENT_DISPLACED,
        SHD_SENT_CROWD,
        SHD_SENT_NO_MEMORY,
        SHD_SENT_STOPPED
    } sent;
    unsigned retry_after;
    double waited, limit; /* seconds that its job was there, of how many */
} shd_waiter;

typedef struct shd_jobs_options {
    size_t queue;              /* jobs that may wait for a worker */
    size_t crowd;              /* requests that may wait for jobs */
    double small;              /* cost up to which work is done at once, as new */
    void (*run)(shd_job *job); /* a worker has time for it */
    void (*drop)(shd_job *job);
} shd_jobs_options;

/* Engine and metrics outlive it. */
shd_status shd_jobs_new(shd_engine *engine, shd_metrics *metrics, const shd_jobs_options *options,
                        shd_jobs **out, shd_error *error);
void shd_jobs_drop(shd_jobs *jobs); /* nobody waits; NULL is fine */

/* True: the waiter waits for this job. False: the job stays the caller's. Then the waiter waits for
 * an equal job that is there already, or it is answered at once, because that one was read and this
 * settles it, or because there is no place. */
bool shd_jobs_enter(shd_jobs *jobs, shd_job *job, shd_lane lane, shd_waiter *waiter);

/* A worker begins with the job. False: nobody waits for it any more. */
bool shd_jobs_begin(shd_jobs *jobs, shd_job *job);

/* The job, which a worker has, costs `cost` to read. */
void shd_jobs_correct(shd_jobs *jobs, shd_job *job, double cost);

/* The job was read, and costs `cost`; it is deferred next where `is_large`. Those who have their
 * answer without its being run are sent on; the others join an equal job that is there already.
 * False: nobody waits for this one any more. */
bool shd_jobs_settle(shd_jobs *jobs, shd_job *job, double cost, bool is_large);

/* Whether the job, a long document that was read when its turn came, costs so much that this was
 * not its turn. Then it loses its request, and is deferred. */
bool shd_jobs_is_early(shd_jobs *jobs, shd_job *job, double cost);

/* The rest of the job is large and costs `cost`, and waits for its turn among the others. False:
 * there was no place, or nobody waits for it any more. */
bool shd_jobs_defer(shd_jobs *jobs, shd_job *job, double cost);

/* The job is done: sends its reply to all that wait. Its request may be dropped afterwards. */
void shd_jobs_finish(shd_jobs *jobs, shd_job *job);

/* The waiter's client has gone. True: it still waited, and gets no answer any more. */
bool shd_jobs_leave(shd_jobs *jobs, shd_waiter *waiter);

/* Answers everybody who waits, and every later one at once, that the server stops. */
void shd_jobs_stop(shd_jobs *jobs);

shd_jobs_load shd_jobs_load_of(shd_jobs *jobs);

/* Seconds until what is ahead of something new of this client's is done, by what work took of late:
 * 1 to 300. */
unsigned shd_jobs_retry_after(shd_jobs *jobs, const char *client);
