#include "base/pool.h"

#include "base/clock.h"
#include "base/denormals.h"

#include <assert.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>

typedef struct job {
    void (*run)(void *context);
    void *context;
} job;

/* A loop that is being spread. It lives on its caller's stack, and is in the pool's list until its
 * caller finds no index left. */
typedef struct loop {
    struct loop *next;
    void (*run)(void *context, size_t index, unsigned slot);
    void *context;
    size_t count;
    atomic_size_t taken; /* the next index to hand out */
    unsigned helpers;    /* workers inside; guarded by the pool's mutex */
} loop;

/* Jobs in order, in a ring. */
typedef struct line {
    job *ring;
    size_t room, first;
    atomic_size_t count; /* may be read without the mutex */
} line;

/* Only the worker itself reads and writes what changes. */
typedef struct worker {
    shd_pool *pool;
    pthread_t thread;
    bool large;   /* it runs a deferred job */
    bool lending; /* and within that a new one */
} worker;

/* The worker that the calling thread is, of any pool, or NULL. */
static _Thread_local worker *this_worker;

/* The mutex guards all that changes but the atomics. */
struct shd_pool {
    pthread_mutex_t mutex;
    pthread_cond_t work;     /* there is a job, a loop or the end */
    pthread_cond_t loop_end; /* a helper left a loop */
    line fresh, deferred;
    bool deferred_next; /* whose turn it is */
    size_t capacity;
    loop *loops;
    bool (*idle)(void *context); /* or NULL */
    void *idle_context;
    void (*between)(void *context); /* or NULL */
    void *between_context;
    uint64_t lent;
    unsigned threads, busy;
    bool stopping;
    worker workers[]; /* [threads] */
};

/* ---- Lines: the pool's mutex is held. ---- */

static void push_job(line *l, job j) {
    assert(l->count < l->room);
    l->ring[(l->first + l->count++) % l->room] = j;
}

static job pop_job(line *l) {
    assert(l->count > 0);
    job j = l->ring[l->first];
    l->first = (l->first + 1) % l->room;
    l->count--;
    return j;
}

static bool withdraw_job(line *l, const void *context) {
    for (size_t i = 0; i < l->count; i++) {
        if (l->ring[(l->first + i) % l->room].context != context) continue;
        for (size_t k = i; k + 1 < l->count; k++)
            l->ring[(l->first + k) % l->room] = l->ring[(l->first + k + 1) % l->room];
        l->count--;
        return true;
    }
    return false;
}

static size_t count_waiting(const shd_pool *pool) {
    return pool->fresh.count + pool->deferred.count;
}

/* ---- Lending ---- */

/* The worker of the pool that the calling thread is, or NULL. */
static worker *find_self(const shd_pool *pool) {
    return this_worker && this_worker->pool == pool ? this_worker : NULL;
}

/* The same, or NULL if it may not run new jobs between the pieces of its own. */
static worker *find_lender(const shd_pool *pool) {
    worker *self = find_self(pool);
    return self && self->large && !self->lending ? self : NULL;
}

/* Runs a new job, if one waits. Takes the mutex. Returns the seconds that it took. */
static double lend_once(shd_pool *pool, worker *self) {
    if (!pool->fresh.count) return 0;
    pthread_mutex_lock(&pool->mutex);
    const bool some = pool->fresh.count;
    const job next = some ? pop_job(&pool->fresh) : (job){NULL, NULL};
    pool->lent += some; /* before it runs: whoever has its answer finds it counted */
    pthread_mutex_unlock(&pool->mutex);
    if (!some) return 0;

    double began = shd_thread_seconds();
    const shd_denormals before = shd_denormals_set(0); /* a loop's body may be the lender */
    self->lending = true;
    next.run(next.context);
    self->lending = false;
    shd_denormals_set(before);
    return shd_thread_seconds() - began;
}

double shd_pool_lend(shd_pool *pool) {
    worker *self = find_lender(pool);
    return self ? lend_once(pool, self) : 0;
}

/* ---- Loops ---- */

/* Takes an index and runs it. False: none is left. */
static bool run_index(loop *l, unsigned slot) {
    size_t index = atomic_fetch_add_explicit(&l->taken, 1, memory_order_relaxed);
    if (index >= l->count) return false;
    const shd_denormals before = shd_denormals_set(SHD_NO_DENORMALS);
    l->run(l->context, index, slot);
    shd_denormals_set(before);
    return true;
}

/* Runs new jobs for as long as the index before them took, so that a crowd of them and a large
 * picture share the worker evenly, however long an index takes. */
static void lend_for(shd_pool *pool, worker *self, double seconds) {
    double lent = 0;
    do lent += lend_once(pool, self);
    while (lent < seconds && pool->fresh.count);
}

static void run_between(shd_pool *pool) {
    if (!pool->between) return;
    const shd_denormals before = shd_denormals_set(0); /* this loop may be in a loop's body */
    pool->between(pool->between_context);
    shd_denormals_set(before);
}

/* The caller's own part of its loop. Returns the seconds that it lent. */
static double run_indices(shd_pool *pool, loop *l) {
    worker *lender = find_lender(pool);
    double lent = 0, began = lender ? shd_thread_seconds() : 0;
    while (run_index(l, 0)) {
        if (!lender) continue;
        const double done = shd_thread_seconds();
        lend_for(pool, lender, done - began);
        run_between(pool);
        began = shd_thread_seconds();
        lent += began - done;
    }
    return lent;
}

/* The mutex is held. */
static loop *find_open_loop(shd_pool *pool) {
    for (loop *l = pool->loops; l; l = l->next)
        if (atomic_load_explicit(&l->taken, memory_order_relaxed) < l->count) return l;
    return NULL;
}

/* Helps a loop until it is done or a job waits. The mutex is held, but not while an index runs. */
static void help_loop(shd_pool *pool, loop *l, unsigned slot) {
    l->helpers++;
    bool more = true;
    while (more && !count_waiting(pool)) {
        pthread_mutex_unlock(&pool->mutex);
        more = run_index(l, slot);
        pthread_mutex_lock(&pool->mutex);
    }
    assert(l->helpers > 0);
    if (--l->helpers == 0) pthread_cond_broadcast(&pool->loop_end);
}

/* ---- Workers ---- */

/* Runs the next job of the line whose turn it is. The mutex is held, but not while the job runs. */
static void run_job(shd_pool *pool, worker *self) {
    bool large = pool->deferred.count && (pool->deferred_next || !pool->fresh.count);
    job next = pop_job(large ? &pool->deferred : &pool->fresh);
    pool->deferred_next = !large;
    self->large = large;
    pool->busy++;
    pthread_mutex_unlock(&pool->mutex);
    next.run(next.context);
    pthread_mutex_lock(&pool->mutex);
    assert(pool->busy > 0 && !self->lending);
    pool->busy--;
    self->large = false;
}

/* Takes a step of what there is to do before sleep. False: nothing. Lets the mutex go meanwhile. */
static bool run_idle(shd_pool *pool) {
    if (!pool->idle) return false;
    pthread_mutex_unlock(&pool->mutex);
    const bool more = pool->idle(pool->idle_context);
    pthread_mutex_lock(&pool->mutex);
    return more;
}

/* New pictures come before help for running ones: a large picture goes on with the worker that
 * began it, and small ones do not wait for its end. */
static void *run_worker(void *argument) {
    worker *self = this_worker = argument;
    shd_pool *pool = self->pool;
    const unsigned slot = 1 + (unsigned)(self - pool->workers); /* 0 is a loop's caller's */
    bool rested = false; /* there is nothing to do while idle */
    pthread_mutex_lock(&pool->mutex);
    for (;;) {
        loop *l = count_waiting(pool) ? NULL : find_open_loop(pool);
        if (l) {
            help_loop(pool, l, slot);
        } else if (count_waiting(pool)) {
            run_job(pool, self);
        } else if (pool->stopping) {
            break;
        } else if (!rested) {
            rested = !run_idle(pool);
        } else {
            pthread_cond_wait(&pool->work, &pool->mutex);
            rested = false;
        }
    }
    pthread_mutex_unlock(&pool->mutex);
    return NULL;
}

/* ---- The pool ---- */

static void free_pool(shd_pool *pool) {
    free(pool->fresh.ring);
    free(pool->deferred.ring);
    free(pool);
}

shd_status shd_pool_new(unsigned threads, size_t queue, shd_pool **out, shd_error *error) {
    if (threads < 1 || threads > 1024)
        return shd_fail(error, SHD_CONFIG, "", "%u threads: 1 to 1024 are possible", threads);
    shd_pool *pool = calloc(1, sizeof *pool + threads * sizeof pool->workers[0]);
    if (!pool) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for %u threads", threads);
    /* Each worker may hold a job that was accepted, and defer it when its place is taken again. */
    pool->fresh.room = queue ? queue : 1;
    pool->deferred.room = queue + threads;
    pool->fresh.ring = calloc(pool->fresh.room, sizeof(job));
    pool->deferred.ring = calloc(pool->deferred.room, sizeof(job));
    if (!pool->fresh.ring || !pool->deferred.ring) {
        free_pool(pool);
        return shd_fail(error, SHD_EXHAUSTED, "", "no memory for %zu queued jobs", queue);
    }
    pool->capacity = queue;
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->work, NULL);
    pthread_cond_init(&pool->loop_end, NULL);
    for (; pool->threads < threads; pool->threads++) {
        worker *next = &pool->workers[pool->threads];
        next->pool = pool;
        if (!pthread_create(&next->thread, NULL, run_worker, next)) continue;
        shd_pool_drop(pool);
        return shd_fail(error, SHD_EXHAUSTED, "", "the system refused to start %u threads",
                        threads);
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
    for (unsigned i = 0; i < pool->threads; i++) pthread_join(pool->workers[i].thread, NULL);
    assert(!pool->loops && !pool->busy && !count_waiting(pool));
    pthread_cond_destroy(&pool->work);
    pthread_cond_destroy(&pool->loop_end);
    pthread_mutex_destroy(&pool->mutex);
    free_pool(pool);
}

void shd_pool_when_idle(shd_pool *pool, bool (*step)(void *context), void *context) {
    pthread_mutex_lock(&pool->mutex);
    pool->idle = step;
    pool->idle_context = context;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->mutex);
}

void shd_pool_between(shd_pool *pool, void (*step)(void *context), void *context) {
    pthread_mutex_lock(&pool->mutex);
    pool->between = step;
    pool->between_context = context;
    pthread_mutex_unlock(&pool->mutex);
}

bool shd_pool_submit(shd_pool *pool, void (*run)(void *context), void *context) {
    pthread_mutex_lock(&pool->mutex);
    bool accepted = count_waiting(pool) < pool->capacity && !pool->stopping;
    if (accepted) {
        push_job(&pool->fresh, (job){run, context});
        pthread_cond_signal(&pool->work);
    }
    pthread_mutex_unlock(&pool->mutex);
    return accepted;
}

void shd_pool_defer(shd_pool *pool, void (*run)(void *context), void *context) {
    pthread_mutex_lock(&pool->mutex);
    push_job(&pool->deferred, (job){run, context});
    pthread_cond_signal(&pool->work);
    pthread_mutex_unlock(&pool->mutex);
}

bool shd_pool_withdraw(shd_pool *pool, const void *context) {
    pthread_mutex_lock(&pool->mutex);
    bool found = withdraw_job(&pool->fresh, context) || withdraw_job(&pool->deferred, context);
    pthread_mutex_unlock(&pool->mutex);
    return found;
}

double shd_pool_for(shd_pool *pool, size_t count,
                    void (*run)(void *context, size_t index, unsigned slot), void *context) {
    loop here = {.run = run, .context = context, .count = count};
    if (count < 2) {
        run_index(&here, 0);
        return 0;
    }
    pthread_mutex_lock(&pool->mutex);
    here.next = pool->loops;
    pool->loops = &here;
    pthread_cond_broadcast(&pool->work);
    pthread_mutex_unlock(&pool->mutex);

    double lent = run_indices(pool, &here);

    pthread_mutex_lock(&pool->mutex);
    loop **at = &pool->loops;
    for (; *at != &here; at = &(*at)->next) assert(*at);
    *at = here.next;
    while (here.helpers > 0) pthread_cond_wait(&pool->loop_end, &pool->mutex);
    pthread_mutex_unlock(&pool->mutex);
    return lent;
}

unsigned shd_pool_slots(const shd_pool *pool) {
    return pool->threads + 1;
}

unsigned shd_pool_hands(const shd_pool *pool) {
    return pool->threads + (find_self(pool) ? 0 : 1);
}

shd_pool_load shd_pool_load_of(shd_pool *pool) {
    pthread_mutex_lock(&pool->mutex);
    const shd_pool_load load = {count_waiting(pool), pool->busy, pool->lent};
    pthread_mutex_unlock(&pool->mutex);
    return load;
}
