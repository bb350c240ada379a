/* Deadlines of jobs: a thread that cancels those that take too long, as libmicrohttpd forgets
 * suspended connections and a worker cannot watch itself. All functions: any thread. */
#ifndef SHD_SERVER_WATCH_H
#define SHD_SERVER_WATCH_H

#include <stdbool.h>
#include <stddef.h>

#include "shaded.h"

typedef struct shd_watch shd_watch;

typedef enum shd_verdict { SHD_IN_TIME, SHD_EXPIRED, SHD_STOPPED } shd_verdict;

/* One job's entry; it lies in memory of the caller from add to remove. */
typedef struct shd_watched {
    struct shd_watched *previous, *next;
    double deadline;      /* on shd_now()'s clock */
    shd_request *request; /* while it may be cancelled */
    shd_verdict verdict;
} shd_watched;

shd_status shd_watch_new(shd_watch **out, shd_error *error);
void shd_watch_drop(shd_watch *watch); /* no entry is left; NULL is fine */

void shd_watch_add(shd_watch *watch, shd_watched *entry, double deadline);

/* From now on `request` is cancelled when the time comes. False: it has come already. The
 * request lives until shd_watch_remove. */
bool shd_watch_attach(shd_watch *watch, shd_watched *entry, shd_request *request);

/* Ends the watch and says how it went. */
shd_verdict shd_watch_remove(shd_watch *watch, shd_watched *entry);

/* Cancels every job there is, and every later one at once. */
void shd_watch_stop(shd_watch *watch);

#endif
