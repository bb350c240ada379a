/* Who waits for which job. All functions may be called from any thread. */
#ifndef SHD_SERVER_JOBS_H
#define SHD_SERVER_JOBS_H

#include <stdbool.h>

#include "base/status.h"

typedef struct shd_jobs shd_jobs;
typedef struct shd_job shd_job;
typedef struct shd_exchange shd_exchange;
typedef struct shd_server shd_server;

/* An exchange's place among those that wait. */
typedef struct shd_waiter {
    struct shd_waiter *previous, *next; /* by deadline */
    struct shd_waiter *other;           /* another one that waits for the same job */
    shd_exchange *exchange;
    shd_job *job;    /* NULL: it does not wait */
    double deadline; /* on shd_now()'s clock */
} shd_waiter;

shd_status shd_jobs_new(shd_server *server, shd_jobs **out, shd_error *error);
void shd_jobs_drop(shd_jobs *jobs); /* nobody waits; NULL is fine */

/* The suspended exchange waits for an equal job that is there already, where `job` may be shared,
 * or is sent on at once where that one's having been read is its answer: then true. Else it waits
 * for `job` itself, which others find from now on. */
bool shd_jobs_join(shd_jobs *jobs, shd_job *job, shd_exchange *exchange);

/* The job was refused by the queue: its only exchange, if it still waits, does not any more. */
bool shd_jobs_refuse(shd_jobs *jobs, shd_job *job, shd_exchange *exchange);

/* A worker begins with the job. False: nobody waits for it any more. */
bool shd_jobs_begin(shd_jobs *jobs, shd_job *job);

/* The job was read. Those who have their answer without its being run are sent on; the others join
 * an equal job that is there already. False: nobody waits for this one any more. */
bool shd_jobs_settle(shd_jobs *jobs, shd_job *job);

/* The job is done: sends its reply to all that wait. Its request may be dropped afterwards. */
void shd_jobs_finish(shd_jobs *jobs, shd_job *job);

/* The exchange's client has gone. True: it still waited, and is the caller's now, to be resumed
 * without a reply. */
bool shd_jobs_leave(shd_jobs *jobs, shd_exchange *exchange);

/* Answers everybody who waits, and every later one at once, that the server stops. */
void shd_jobs_stop(shd_jobs *jobs);

/* Seconds until a queue as long as it is now has passed, by what jobs took of late: 1 to 300. */
unsigned shd_jobs_retry_after(shd_jobs *jobs);

#endif
