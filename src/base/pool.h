/* One pool of threads for pictures and for the tiles of pictures.
 *
 * Pictures are jobs in a bounded queue. A running job may spread a loop over the pool: the caller
 * works on its own loop, and idle workers join until a job waits. So a lone large picture uses
 * every core, and many small ones run side by side.
 *
 * Small work does not wait for large work: a job that finds itself large defers the rest of itself.
 * Deferred jobs have a line of their own, which takes turns with the new ones. After each index of
 * a deferred job's loops, its worker runs new jobs, if some wait, for about as long as the index
 * took. All functions may be called from any thread. */
#pragma once

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

typedef struct shd_pool shd_pool;

/* `threads` >= 1 workers; at most `queue` jobs wait (0: none, only loops are spread). */
shd_status shd_pool_new(unsigned threads, size_t queue, shd_pool **out, shd_error *error);

/* Finishes every accepted job, then ends the threads. NULL is fine. */
void shd_pool_drop(shd_pool *pool);

/* Queues run(context). False: the queue is full, and nothing is queued. */
bool shd_pool_submit(shd_pool *pool, void (*run)(void *context), void *context);

/* From a running job: queues run(context), the large rest of that job. Always accepted: the queue
 * has room for what was accepted before. */
void shd_pool_defer(shd_pool *pool, void (*run)(void *context), void *context);

/* Takes the job with this context out of the queue. False: it does not wait, or not any more. */
bool shd_pool_withdraw(shd_pool *pool, const void *context);

/* Runs a new job if one waits: a deferred job calls this now and then, outside of loops. Returns
 * the processor seconds that it took. */
double shd_pool_lend(shd_pool *pool);

/* Calls run(context, index, slot) for every index in [0, count), in no particular order, on the
 * calling thread and on idle workers. Returns when all are done: the processor seconds that the
 * calling thread lent to other jobs meanwhile. `slot` < shd_pool_slots() selects scratch memory: no
 * two threads that work on this loop have the same, and the caller's is 0. Denormal numbers count
 * as zero within run (base/denormals.h), and nowhere else. */
double shd_pool_for(shd_pool *pool, size_t count,
                    void (*run)(void *context, size_t index, unsigned slot), void *context);

/* Sets, once, what workers do before they sleep: short steps, as long as step(context) is true and
 * there is neither a job nor a loop. */
void shd_pool_when_idle(shd_pool *pool, bool (*step)(void *context), void *context);

/* Sets, before any job, what the worker of a deferred job does after each index of its loops and
 * the new jobs after it: step(context) may take its time, for other work. */
void shd_pool_between(shd_pool *pool, void (*step)(void *context), void *context);

unsigned shd_pool_hands(const shd_pool *pool); /* threads that a loop of the caller's may have */
unsigned shd_pool_slots(const shd_pool *pool); /* workers + 1 */

typedef struct shd_pool_load {
    size_t queued; /* jobs that wait, new and deferred */
    unsigned busy; /* workers that run a job */
    uint64_t lent; /* jobs that were run between other ones' tiles */
} shd_pool_load;

shd_pool_load shd_pool_load_of(shd_pool *pool);
