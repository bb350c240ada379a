/* Workers that are held: jobs that were cancelled while a worker had them, and that it still has a
 * second later. Work looks at its flag far more often, so that this is a mistake of the program's
 * or a library's; readiness, metrics and the log tell it. All functions may be called from any
 * thread. */
#pragma once

#include <stdbool.h>

#include "base/status.h"

typedef struct shd_stuck shd_stuck;

/* A job's place among those that are watched; zero at first. */
typedef struct shd_watched {
    struct shd_watched *previous, *next; /* NULL: it is not watched */
    const char *id;                      /* of a request, for the log; lives as long as the job */
    double since;                        /* on shd_now()'s clock */
    bool told;
} shd_watched;

shd_status shd_stuck_new(shd_stuck **out, shd_error *error);
void shd_stuck_drop(shd_stuck *stuck); /* nothing is watched; NULL is fine */

/* The job was cancelled while a worker has it. */
void shd_stuck_watch(shd_stuck *stuck, shd_watched *watched, const char *id);

/* The worker has done with the job, which need not be watched. */
void shd_stuck_forget(shd_stuck *stuck, shd_watched *watched);

/* Workers that are held now. */
unsigned shd_stuck_count(shd_stuck *stuck);
