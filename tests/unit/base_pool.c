/* The pool: every index once, slots that do not collide, jobs that are not lost. */
#include <limits.h>
#include <pthread.h>
#include <sched.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <cmocka.h>

#include "base/denormals.h"
#include "base/pool.h"

enum { MOST = 5000, SLOTS = 64 };

/* What a loop's body sees of itself. */
typedef struct tally {
    unsigned slots;
    atomic_uint times[MOST];   /* how often an index was run */
    atomic_bool inside[SLOTS]; /* whether a thread is in the slot now */
    atomic_uint wrong;         /* slots out of range, or used by two at once */
    pthread_t caller;
    atomic_uint strangers_in_zero; /* slot 0 belongs to the caller */
} tally;

static void count(void *context, size_t index, unsigned slot) {
    tally *t = context;
    if (slot >= t->slots || atomic_exchange(&t->inside[slot % SLOTS], true))
        atomic_fetch_add(&t->wrong, 1);
    if (slot == 0 && !pthread_equal(pthread_self(), t->caller))
        atomic_fetch_add(&t->strangers_in_zero, 1);
    atomic_fetch_add(&t->times[index], 1);
    if (index % 16 == 0) sched_yield();
    atomic_store(&t->inside[slot % SLOTS], false);
}

static shd_pool *new_pool(unsigned threads, size_t queue) {
    shd_pool *pool = NULL;
    shd_error error;
    assert_int_equal(shd_pool_new(threads, queue, &pool, &error), SHD_OK);
    return pool;
}

/* Runs a loop and says whether each index below `n` was run once, and none beyond. */
static bool spread(shd_pool *pool, size_t n) {
    tally *t = calloc(1, sizeof *t);
    t->slots = shd_pool_slots(pool);
    t->caller = pthread_self();
    shd_pool_for(pool, n, count, t);
    bool good = atomic_load(&t->wrong) == 0 && atomic_load(&t->strangers_in_zero) == 0;
    for (size_t i = 0; i < MOST; i++) good = good && atomic_load(&t->times[i]) == (i < n);
    free(t);
    return good;
}

static void loops_run_every_index_once_in_slots_of_their_own(void **state) {
    (void)state;
    static const unsigned threads[] = {1, 2, 7};
    static const size_t counts[] = {0, 1, 2, 3, 63, MOST};
    for (size_t k = 0; k < 3; k++) {
        shd_pool *pool = new_pool(threads[k], 4);
        assert_int_equal(shd_pool_slots(pool), threads[k] + 1);
        for (size_t i = 0; i < sizeof counts / sizeof counts[0]; i++)
            for (int again = 0; again < 5; again++) assert_true(spread(pool, counts[i]));
        shd_pool_drop(pool);
    }
}

typedef struct outer {
    shd_pool *pool;
    atomic_uint good;
} outer;

static void spread_within(void *context) {
    outer *o = context;
    for (int i = 0; i < 10; i++) atomic_fetch_add(&o->good, spread(o->pool, 300));
}

static void spread_within_loop(void *context, size_t index, unsigned slot) {
    (void)slot;
    outer *o = context;
    atomic_fetch_add(&o->good, spread(o->pool, 10 + index));
}

static void loops_within_jobs_and_loops_end(void **state) {
    (void)state;
    for (unsigned threads = 1; threads <= 4; threads += 3) {
        shd_pool *pool = new_pool(threads, 16);
        outer o = {.pool = pool};
        for (int i = 0; i < 16; i++) assert_true(shd_pool_submit(pool, spread_within, &o));
        shd_pool_drop(pool);
        assert_int_equal(atomic_load(&o.good), 160);

        o = (outer){.pool = pool = new_pool(threads, 0)};
        shd_pool_for(pool, 20, spread_within_loop, &o);
        shd_pool_drop(pool);
        assert_int_equal(atomic_load(&o.good), 20);
    }
}

static void *spread_from_thread(void *context) {
    spread_within(context);
    return NULL;
}

static void loops_of_many_threads_share_one_pool(void **state) {
    (void)state;
    enum { CALLERS = 6 };
    shd_pool *pool = new_pool(3, 0);
    outer o = {.pool = pool};
    pthread_t callers[CALLERS];
    for (int i = 0; i < CALLERS; i++)
        assert_int_equal(pthread_create(&callers[i], NULL, spread_from_thread, &o), 0);
    for (int i = 0; i < CALLERS; i++) pthread_join(callers[i], NULL);
    assert_int_equal(atomic_load(&o.good), 10 * CALLERS);
    shd_pool_drop(pool);
}

/* A job that holds its worker until it is let go. */
typedef struct gate {
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    unsigned entered;
    bool open;
    atomic_uint passed;
} gate;

static void wait_at_gate(void *context) {
    gate *g = context;
    pthread_mutex_lock(&g->mutex);
    g->entered++;
    pthread_cond_broadcast(&g->changed);
    while (!g->open) pthread_cond_wait(&g->changed, &g->mutex);
    pthread_mutex_unlock(&g->mutex);
    atomic_fetch_add(&g->passed, 1);
}

static void wait_for_entered(gate *g, unsigned count_wanted) {
    pthread_mutex_lock(&g->mutex);
    while (g->entered < count_wanted) pthread_cond_wait(&g->changed, &g->mutex);
    pthread_mutex_unlock(&g->mutex);
}

static void open_gate(gate *g) {
    pthread_mutex_lock(&g->mutex);
    g->open = true;
    pthread_cond_broadcast(&g->changed);
    pthread_mutex_unlock(&g->mutex);
}

static void a_full_queue_refuses_and_accepts_again(void **state) {
    (void)state;
    enum { THREADS = 2, QUEUE = 3 };
    gate g = {PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER, 0, false, 0};
    shd_pool *pool = new_pool(THREADS, QUEUE);
    for (unsigned i = 0; i < THREADS; i++) {
        assert_true(shd_pool_submit(pool, wait_at_gate, &g));
        wait_for_entered(&g, i + 1);
    }
    assert_int_equal(shd_pool_load_of(pool).busy, THREADS);
    for (size_t i = 0; i < QUEUE; i++) {
        assert_int_equal(shd_pool_load_of(pool).queued, i);
        assert_true(shd_pool_submit(pool, wait_at_gate, &g));
    }
    for (int i = 0; i < 3; i++) assert_false(shd_pool_submit(pool, wait_at_gate, &g));
    assert_int_equal(shd_pool_load_of(pool).queued, QUEUE);
    assert_true(spread(pool, 100)); /* a loop needs no place in the queue: its caller works */

    open_gate(&g);
    while (shd_pool_load_of(pool).queued) sched_yield();
    assert_true(shd_pool_submit(pool, wait_at_gate, &g));
    shd_pool_drop(pool);
    assert_int_equal(atomic_load(&g.passed), THREADS + QUEUE + 1);
}

static void a_queue_of_none_takes_no_jobs(void **state) {
    (void)state;
    gate g = {PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER, 0, true, 0};
    shd_pool *pool = new_pool(2, 0);
    assert_false(shd_pool_submit(pool, wait_at_gate, &g));
    assert_true(spread(pool, 100));
    shd_pool_drop(pool);
    assert_int_equal(atomic_load(&g.passed), 0);
}

static void *drop_from_thread(void *context) {
    shd_pool_drop(context);
    return NULL;
}

static void dropping_finishes_every_accepted_job(void **state) {
    (void)state;
    gate g = {PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER, 0, false, 0};
    shd_pool *pool = new_pool(2, 50);
    for (int i = 0; i < 40; i++) assert_true(shd_pool_submit(pool, wait_at_gate, &g));
    pthread_t dropper;
    assert_int_equal(pthread_create(&dropper, NULL, drop_from_thread, pool), 0);
    wait_for_entered(&g, 2);
    open_gate(&g);
    pthread_join(dropper, NULL);
    assert_int_equal(atomic_load(&g.passed), 40);
    shd_pool_drop(NULL);
}

/* A job that comes in the middle of a long loop, and the loop's indices that wait for it. */
typedef struct late {
    shd_pool *pool;
    atomic_bool submitted, looped, ran;
    atomic_uint waited_in_vain;
} late;

static void run_late(void *context) {
    late *l = context;
    atomic_store(&l->ran, true);
}

static void submit_or_wait(void *context, size_t index, unsigned slot) {
    (void)index;
    late *l = context;
    if (slot && !atomic_exchange(&l->submitted, true)) {
        if (!shd_pool_submit(l->pool, run_late, l)) atomic_fetch_add(&l->waited_in_vain, 1);
        return; /* the helper is free to leave; the caller is not */
    }
    while (!atomic_load(&l->ran)) usleep(1000); /* for ever, if the job waits for the loop's end */
}

static void loop_with_late_job(void *context) {
    late *l = context;
    shd_pool_for(l->pool, 4, submit_or_wait, l);
    atomic_store(&l->looped, true);
}

static void a_job_does_not_wait_for_the_end_of_a_loop(void **state) {
    (void)state;
    late l = {.pool = new_pool(2, 4)};
    assert_true(shd_pool_submit(l.pool, loop_with_late_job, &l));
    while (!atomic_load(&l.looped)) usleep(1000);
    shd_pool_drop(l.pool);
    assert_int_equal(atomic_load(&l.waited_in_vain), 0);
}

/* A large job whose tiles wait for a small one that comes while they run. */
typedef struct large {
    late l;
    atomic_uint nested;
    double lent;
} large;

static void run_small(void *context) {
    large *job = context;
    atomic_fetch_add(&job->nested, 1);
    /* With a loop of its own, in which nothing is lent again. */
    if (!spread(job->l.pool, 64)) atomic_fetch_add(&job->l.waited_in_vain, 1);
    atomic_store(&job->l.ran, true);
}

static void tile_of_large(void *context, size_t index, unsigned slot) {
    (void)slot;
    large *job = context;
    if (index == 0) {
        for (int i = 0; i < 3; i++)
            if (!shd_pool_submit(job->l.pool, run_small, job))
                atomic_fetch_add(&job->l.waited_in_vain, 1);
    } else if (index >= 2 && !atomic_load(&job->l.ran)) {
        atomic_fetch_add(&job->l.waited_in_vain, 1); /* the tile before was left for it */
    }
}

static void rest_of_large(void *context) {
    large *job = context;
    job->lent = shd_pool_for(job->l.pool, 8, tile_of_large, job);
    atomic_store(&job->l.looped, true);
}

static void begin_large(void *context) {
    large *job = context;
    shd_pool_defer(job->l.pool, rest_of_large, job);
}

static void a_small_job_waits_for_a_tile_of_a_large_one(void **state) {
    (void)state;
    large job = {.l = {.pool = new_pool(1, 4)}};
    assert_true(shd_pool_submit(job.l.pool, begin_large, &job));
    while (!atomic_load(&job.l.looped)) usleep(1000);
    assert_int_equal(atomic_load(&job.l.waited_in_vain), 0);
    assert_int_equal(atomic_load(&job.nested), 3);
    assert_int_equal(shd_pool_load_of(job.l.pool).lent, 3);
    assert_true(job.lent >= 0);
    shd_pool_drop(job.l.pool);
}

/* A large job between whose tiles its worker does another one, which has tiles of its own. */
typedef struct divided {
    shd_pool *pool;
    unsigned tiles, steps, inner_tiles;
    bool is_inner;
    atomic_bool ended;
} divided;

static void count_inner(void *context, size_t index, unsigned slot) {
    (void)index, (void)slot;
    ((divided *)context)->inner_tiles++;
}

static void step_between(void *context) {
    divided *d = context;
    d->steps++;
    if (d->is_inner) return;
    d->is_inner = true;
    shd_pool_for(d->pool, 3, count_inner, d);
    d->is_inner = false;
}

static void count_tile(void *context, size_t index, unsigned slot) {
    (void)index;
    divided *d = context;
    if (slot == 0 && !d->is_inner) d->tiles++;
}

static void rest_of_divided(void *context) {
    divided *d = context;
    shd_pool_for(d->pool, 5, count_tile, d);
    atomic_store(&d->ended, true);
}

static void begin_divided(void *context) {
    divided *d = context;
    shd_pool_for(d->pool, 7, count_tile, d); /* new jobs are not divided */
    shd_pool_defer(d->pool, rest_of_divided, d);
}

static void a_large_job_gives_way_between_its_tiles(void **state) {
    (void)state;
    divided d = {.pool = new_pool(1, 4)};
    shd_pool_between(d.pool, step_between, &d);
    assert_true(shd_pool_submit(d.pool, begin_divided, &d));
    while (!atomic_load(&d.ended)) usleep(1000);
    shd_pool_drop(d.pool);
    assert_int_equal(d.tiles, 7 + 5);
    assert_int_equal(d.inner_tiles, 5 * 3);
    assert_int_equal(d.steps, 5 + 5 * 3);
}

/* Large jobs are not starved by small ones either. */
typedef struct flood {
    shd_pool *pool;
    atomic_bool large_ran;
    atomic_uint small_ran;
} flood;

static void run_flood(void *context) {
    flood *f = context;
    if (atomic_fetch_add(&f->small_ran, 1) > 10000 || atomic_load(&f->large_ran)) return;
    shd_pool_submit(f->pool, run_flood, f); /* there is always another one */
}

static void end_flood(void *context) {
    atomic_store(&((flood *)context)->large_ran, true);
}

static void begin_flood(void *context) {
    flood *f = context;
    shd_pool_submit(f->pool, run_flood, f);
    shd_pool_submit(f->pool, run_flood, f);
    shd_pool_defer(f->pool, end_flood, f);
}

static void large_jobs_take_turns_with_small_ones(void **state) {
    (void)state;
    flood f = {.pool = new_pool(1, 8)};
    assert_true(shd_pool_submit(f.pool, begin_flood, &f));
    while (!atomic_load(&f.large_ran)) usleep(1000);
    shd_pool_drop(f.pool);
    assert_true(atomic_load(&f.small_ran) < 100);
}

static void waiting_jobs_can_be_taken_back(void **state) {
    (void)state;
    gate g = {PTHREAD_MUTEX_INITIALIZER, PTHREAD_COND_INITIALIZER, 0, false, 0}, other = g;
    shd_pool *pool = new_pool(1, 3);
    assert_true(shd_pool_submit(pool, wait_at_gate, &g));
    wait_for_entered(&g, 1);
    assert_false(shd_pool_withdraw(pool, &g)); /* it runs */
    int a, b;
    assert_true(shd_pool_submit(pool, wait_at_gate, &a));
    assert_true(shd_pool_submit(pool, wait_at_gate, &other));
    shd_pool_defer(pool, wait_at_gate, &b);
    assert_false(shd_pool_submit(pool, wait_at_gate, &a)); /* deferred ones count */
    assert_true(shd_pool_withdraw(pool, &a));
    assert_false(shd_pool_withdraw(pool, &a));
    assert_true(shd_pool_withdraw(pool, &b));
    assert_int_equal(shd_pool_load_of(pool).queued, 1);
    open_gate(&other);
    open_gate(&g);
    shd_pool_drop(pool);
    assert_int_equal(atomic_load(&g.passed), 1);
    assert_int_equal(atomic_load(&other.passed), 1);
}

/* Whether a denormal product is zero; volatile, or compilers would know it. */
static bool is_flushed(void) {
    volatile float small = 0x1p-100f, product = small * 0x1p-40f;
    return product == 0;
}

static void note_flushed(void *context, size_t index, unsigned slot) {
    (void)index;
    (void)slot;
    atomic_fetch_add((atomic_uint *)context, is_flushed());
    usleep(100); /* so that helpers come, too */
}

static void note_outside(void *context) {
    atomic_fetch_add((atomic_uint *)context, is_flushed());
}

static void denormal_numbers_are_zero_in_loops_and_nowhere_else(void **state) {
    (void)state;
    const shd_denormals before = shd_denormals_set(SHD_NO_DENORMALS);
    const bool possible = is_flushed();
    shd_denormals_set(before);
    assert_false(is_flushed());
    shd_pool *pool = new_pool(3, 4);
    atomic_uint inside = 0, outside = 0;
    for (int round = 0; round < 4; round++) {
        shd_pool_for(pool, 50, note_flushed, &inside);
        assert_false(is_flushed());
        assert_true(shd_pool_submit(pool, note_outside, &outside));
    }
    shd_pool_drop(pool);
    assert_int_equal(atomic_load(&inside), possible ? 200 : 0);
    assert_int_equal(atomic_load(&outside), 0);
}

static void impossible_numbers_of_threads_are_refused(void **state) {
    (void)state;
    static const unsigned threads[] = {0, 1025, 4000000000u};
    for (size_t i = 0; i < 3; i++) {
        shd_pool *pool = (shd_pool *)&pool;
        shd_error error;
        assert_int_equal(shd_pool_new(threads[i], 1, &pool, &error), SHD_CONFIG);
        assert_ptr_equal(pool, &pool); /* untouched */
    }
}

static atomic_int steps_left;

static void do_nothing(void *context) {
    (void)context;
}

static bool take_step(void *context) {
    (void)context;
    return atomic_fetch_sub(&steps_left, 1) > 0;
}

static void idle_workers_do_what_there_is_to_do(void **state) {
    (void)state;
    shd_pool *pool;
    shd_error error;
    assert_int_equal(shd_pool_new(2, 4, &pool, &error), SHD_OK);
    atomic_store(&steps_left, 100);
    shd_pool_when_idle(pool, take_step, NULL);
    while (atomic_load(&steps_left) > 0) sched_yield();
    /* And again after each job. */
    atomic_store(&steps_left, 100);
    assert_true(shd_pool_submit(pool, do_nothing, NULL));
    while (atomic_load(&steps_left) > 0) sched_yield();
    /* Endless ones keep nobody from working. */
    atomic_store(&steps_left, INT_MAX);
    for (int i = 0; i < 100; i++)
        while (!shd_pool_submit(pool, do_nothing, NULL)) sched_yield();
    while (shd_pool_load_of(pool).queued) sched_yield();
    shd_pool_drop(pool);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(loops_run_every_index_once_in_slots_of_their_own),
        cmocka_unit_test(loops_within_jobs_and_loops_end),
        cmocka_unit_test(loops_of_many_threads_share_one_pool),
        cmocka_unit_test(a_full_queue_refuses_and_accepts_again),
        cmocka_unit_test(a_queue_of_none_takes_no_jobs),
        cmocka_unit_test(dropping_finishes_every_accepted_job),
        cmocka_unit_test(a_job_does_not_wait_for_the_end_of_a_loop),
        cmocka_unit_test(a_small_job_waits_for_a_tile_of_a_large_one),
        cmocka_unit_test(a_large_job_gives_way_between_its_tiles),
        cmocka_unit_test(large_jobs_take_turns_with_small_ones),
        cmocka_unit_test(waiting_jobs_can_be_taken_back),
        cmocka_unit_test(denormal_numbers_are_zero_in_loops_and_nowhere_else),
        cmocka_unit_test(idle_workers_do_what_there_is_to_do),
        cmocka_unit_test(impossible_numbers_of_threads_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
