/* Workers that are held: jobs that were cancelled while a worker had them, and that it still has a
 * second later. Work looks at its flag far more often, so that this is a mistake of the program's
 * or a library's; readiness, metrics and the log tell it. No locks: one thread at a time. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/* A job's place in the ring of those that are watched, the first one cancelled first; zero at
 * first. The ring begins with one that is no job's. */
typedef struct shd_watched {
    struct shd_watched *previous, *next; /* NULL: it is not watched */
    const char *id;                      /* of a request, for the log; lives as long as the job */
    double since;                        /* on shd_now()'s clock */
    bool told;
} shd_watched;

/* The job was cancelled while a worker has it; and the worker has done with it, if it is watched.
 */
void shd_stuck_watch(shd_watched *ring, shd_watched *watched, const char *id);
void shd_stuck_forget(shd_watched *watched);

/* Tells the log of each worker that is held, once; returns how many are. *next is when to look
 * again: infinity as long as none is watched. */
size_t shd_stuck_tell(shd_watched *ring, double *next);
