#include "base/pool.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

typedef struct job {
    void (*run)(void *context);
    void *context;
} job;

/* A loop that is being spread. It lives on its caller's stack and is linked into the pool while
 * indices are left to hand out. */
typedef struct loop {
    struct loop *next;
    void (*run)(void *context, size_t index, unsigned slot);
    void *context;
    size_t count;
    atomic_size_t taken;
    unsigned helpers; /* workers inside; guarded by the pool's mutex */
} loop;

struct shd_pool {
    pthread_mutex_t mutex;
    pthread_cond_t work;     /* a job, a loop or the end */
    pthread_cond_t loop_end; /* a helper left a loop */
    job *queue;              /* ring */
    size_t capacity, first, waiting;
    loop *loops;
    unsigned threads, busy, started;
    bool stopping;
    pthread_t thread[];
};

/* Takes an index and runs it; false where none is left. */
static bool run_index(loop *l, unsigned slot) {
    size_t index = atomic_fetch_add_explicit(&l->taken, 1, memory_order_relaxed);
    if (index >= l->count) return false;
    l->run(l->context, index, slot);
    return true;
}

static void run_indices(loop *l, unsigned slot) {
    while (run_index(l, slot)) {
    }
}

static loop *find_open_loop(shd_pool *pool) {
    for (loop *l = pool->loops; l; l = l->next)
        if (atomic_load_explicit(&l->taken, memory_order_relaxed) < l->count) return l;
    return NULL;
}

/* Helps a loop until it is done or a job waits. Called and left with the mutex held. */
static void help(shd_pool *pool, loop *l, unsigned slot) {
    l->helpers++;
    bool more = true;
    while (more && !pool->waiting) {
        pthread_mutex_unlock(&pool->mutex);
        more = run_index(l, slot);
        pthread_mutex_lock(&pool->mutex);
    }
    if (--l->helpers == 0) pthread_cond_broadcast(&pool->loop_end);
}

/* New pictures come before help for running ones: a large picture goes on with the worker that
 * began it, and small ones do not wait for its end. */
static void *worker(void *argument) {
    shd_pool *pool = argument;
    pthread_mutex_lock(&pool->mutex);
    unsigned slot = ++pool->started; /* 0 is the caller's, in any loop */
    for (;;) {
        loop *l = pool->waiting ? NULL : find_open_loop(pool);
        if (l) {
            help(pool, l, slot);
        } else if (pool->waiting) {
            job next = pool->queue[pool->first];
            pool->first = (pool->first + 1) % pool->capacity;
            pool->waiting--;
            pool->busy++;
            pthread_mutex_unlock(&pool->mutex);
            next.run(next.context);
            pthread_mutex_lock(&pool->mutex);
            pool->busy--;
        } else if (pool->stopping) {
            break;
        } else {
            pthread_cond_wait(&pool->work, &pool->mutex);
        }
    }
    pthread_mutex_unlock(&pool->mutex);
    return NULL;
}

shd_status shd_pool_new(unsigned threads, size_t queue, shd_pool **out, shd_error *error) {
    if (threads < 1 || threads > 1024)
        return shd_fail(error, SHD_CONFIG, "", "%u threads: 1 to 1024 are possible", threads);
    shd_pool *pool = calloc(1, sizeof *pool + threads * sizeof pool->thread[0]);
    job *ring = calloc(queue ? queue : 1, sizeof *ring);
    if (!pool || !ring) {
        free(pool);
        free(ring);
        return shd_fail(error, SHD_MEMORY, "", "no memory for %zu queued jobs", queue);
    }
    pool->queue = ring;
    pool->capacity = queue;
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->work, NULL);
    pthread_cond_init(&pool->loop_end, NULL);
    for (; pool->threads < threads; pool->threads++) {
        if (pthread_create(&pool->thread[pool->threads], NULL, worker, pool)) {
            shd_pool_drop(pool);
            return shd_fail(error, SHD_MEMORY, "", "the system refused to start %u threads",
                            threads);
        }
    }
    *out = pool;
    return SHD_OK;
}

void shd_pool_drop(shd_pool *pool) {
    if (!pool) return;
    pthread_mutex_lock(&pool->mutex);
    pool->stopping = true;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->mutex);
    for (unsigned i = 0; i < pool->threads; i++) pthread_join(pool->thread[i], NULL);
    pthread_cond_destroy(&pool->work);
    pthread_cond_destroy(&pool->loop_end);
    pthread_mutex_destroy(&pool->mutex);
    free(pool->queue);
    free(pool);
}

bool shd_pool_submit(shd_pool *pool, void (*run)(void *context), void *context) {
    pthread_mutex_lock(&pool->mutex);
    bool accepted = pool->waiting < pool->capacity && !pool->stopping;
    if (accepted) {
        size_t last = (pool->first + pool->waiting) % pool->capacity;
        pool->queue[last] = (job){run, context};
        pool->waiting++;
        pthread_cond_signal(&pool->work);
    }
    pthread_mutex_unlock(&pool->mutex);
    return accepted;
}

void shd_pool_for(shd_pool *pool, size_t count,
                  void (*run)(void *context, size_t index, unsigned slot), void *context) {
    loop here = {.run = run, .context = context, .count = count};
    if (count < 2) {
        run_indices(&here, 0);
        return;
    }
    pthread_mutex_lock(&pool->mutex);
    here.next = pool->loops;
    pool->loops = &here;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->mutex);

    run_indices(&here, 0);

    pthread_mutex_lock(&pool->mutex);
    for (loop **at = &pool->loops; *at; at = &(*at)->next) {
        if (*at == &here) {
            *at = here.next;
            break;
        }
    }
    while (here.helpers) pthread_cond_wait(&pool->loop_end, &pool->mutex);
    pthread_mutex_unlock(&pool->mutex);
}

unsigned shd_pool_slots(const shd_pool *pool) {
    return pool->threads + 1;
}

size_t shd_pool_queued(shd_pool *pool) {
    pthread_mutex_lock(&pool->mutex);
    size_t waiting = pool->waiting;
    pthread_mutex_unlock(&pool->mutex);
    return waiting;
}

unsigned shd_pool_busy(shd_pool *pool) {
    pthread_mutex_lock(&pool->mutex);
    unsigned busy = pool->busy;
    pthread_mutex_unlock(&pool->mutex);
    return busy;
}
