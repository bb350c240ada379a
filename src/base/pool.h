/* One pool of threads for pictures and for the tiles of pictures.
 *
 * Pictures are jobs in a bounded queue. A running job may spread a loop over the pool: the
 * caller always works on its own loop, and idle workers join, so that a lone large picture uses
 * every core and many small ones run side by side, without a thread more than was asked for. A
 * worker that helps leaves the loop when a job waits.
 * All functions may be called from any thread. */
#ifndef SHD_BASE_POOL_H
#define SHD_BASE_POOL_H

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"

typedef struct shd_pool shd_pool;

/* `threads` >= 1 workers; at most `queue` jobs wait (0: none, only loops are spread). */
shd_status shd_pool_new(unsigned threads, size_t queue, shd_pool **out, shd_error *error);

/* Finishes every accepted job, then ends the threads. NULL is fine. */
void shd_pool_drop(shd_pool *pool);

/* Queues run(context). False, and nothing is queued, where the queue is full. */
bool shd_pool_submit(shd_pool *pool, void (*run)(void *context), void *context);

/* Calls run(context, index, slot) for every index in [0, count), in no particular order, on the
 * calling thread and on idle workers; returns when all are done. `slot` < shd_pool_slots() is
 * unique among the threads that work on this loop: it selects scratch memory. The caller's slot
 * is 0. */
void shd_pool_for(shd_pool *pool, size_t count,
                  void (*run)(void *context, size_t index, unsigned slot), void *context);

unsigned shd_pool_slots(const shd_pool *pool); /* workers + 1 */
size_t shd_pool_queued(shd_pool *pool);        /* jobs that wait */
unsigned shd_pool_busy(shd_pool *pool);        /* workers that run a job */

#endif
