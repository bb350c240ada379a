#include "jobs.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <xxhash.h>

#include "base/clock.h"
#include "job.h"
#include "problem.h"

enum { BUCKETS = 1024 };

struct shd_jobs {
    shd_server *server;
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    pthread_t thread;
    shd_waiter line; /* ring: everybody who waits; its first one is due first */
    shd_listing *by_body[BUCKETS], *by_meaning[BUCKETS];
    double wakes;       /* while the thread waits: when it looks next, infinity where it does not */
    double job_seconds; /* moving average; 0: no job has ended yet */
    bool stopped;       /* everybody is to leave */
    bool ending;        /* the thread is to end */
};

/* ---- Finding equal jobs ---- */

static void list(shd_listing *table[BUCKETS], shd_listing *entry, shd_job *job, uint64_t hash) {
    *entry = (shd_listing){table[hash % BUCKETS], job, hash};
    table[hash % BUCKETS] = entry;
}

static void unlist(shd_listing *table[BUCKETS], shd_listing *entry) {
    if (!entry->job) return;
    shd_listing **at = &table[entry->hash % BUCKETS];
    while (*at != entry) at = &(*at)->next;
    *at = entry->next;
    entry->job = NULL;
}

static void hide(shd_jobs *jobs, shd_job *job) {
    unlist(jobs->by_body, &job->by_body);
    unlist(jobs->by_meaning, &job->by_meaning);
}

/* Hashes only narrow the search: the bodies themselves are compared, so that nobody can make up one
 * that is answered by another's picture. */
static shd_job *find_by_body(shd_jobs *jobs, const shd_job *like, uint64_t hash) {
    for (shd_listing *l = jobs->by_body[hash % BUCKETS]; l; l = l->next) {
        shd_job *job = l->job;
        if (l->hash == hash && job->work == like->work &&
            shd_question_same(&job->question, &like->question))
            return job;
    }
    return NULL;
}

static shd_job *find_by_meaning(shd_jobs *jobs, const shd_job *like, uint64_t hash) {
    const char *etag = shd_request_etag(like->request);
    for (shd_listing *l = jobs->by_meaning[hash % BUCKETS]; l; l = l->next)
        if (l->hash == hash && l->job->work == like->work &&
            !strcmp(shd_request_etag(l->job->request), etag))
            return l->job;
    return NULL;
}

/* ---- Waiting ---- */

static void wait_for(shd_jobs *jobs, shd_waiter *waiter, shd_job *job) {
    waiter->job = job;
    waiter->other = job->waiters;
    job->waiters = waiter;
    /* Deadlines mostly come in order: the place is near the end. */
    shd_waiter *after = jobs->line.previous;
    while (after != &jobs->line && after->deadline > waiter->deadline) after = after->previous;
    waiter->previous = after;
    waiter->next = after->next;
    waiter->previous->next = waiter->next->previous = waiter;
    /* The thread may still wait for the deadline of somebody who left long since: then it need not
     * be called for a later one, which on a quiet server is every one. */
    if (waiter->deadline < jobs->wakes) pthread_cond_signal(&jobs->changed);
}

/* From now on the exchange is the caller's, who answers and resumes it without the mutex. */
static void wait_no_more(shd_waiter *waiter) {
    shd_waiter **at = &waiter->job->waiters;
    while (*at != waiter) at = &(*at)->other;
    *at = waiter->other;
    waiter->previous->next = waiter->next;
    waiter->next->previous = waiter->previous;
    waiter->job = NULL;
}

/* Where nobody waits for the job: nobody finds it any more, and it ends soon or at once. Returns a
 * job that the caller drops without the mutex. */
static shd_job *abandon(shd_jobs *jobs, shd_job *job) {
    if (job->waiters) return NULL;
    hide(jobs, job);
    if (shd_engine_withdraw(jobs->server->engine, job)) return job;
    if (job->may_cancel) shd_request_cancel(job->request);
    return NULL;
}

/* Resumes a list of exchanges, linked by `other`. */
static void send(shd_waiter *waiter) {
    while (waiter) {
        shd_waiter *other = waiter->other;
        shd_exchange_resume(waiter->exchange);
        waiter = other;
    }
}

/* ---- Deadlines ---- */

/* Takes those from the line whose time has come, all of them with `now` = INFINITY, in order. */
static void expel(shd_jobs *jobs, double now, shd_waiter **out, shd_job **unwanted) {
    while (jobs->line.next != &jobs->line && jobs->line.next->deadline <= now) {
        shd_waiter *waiter = jobs->line.next;
        shd_job *job = waiter->job;
        wait_no_more(waiter);
        waiter->other = *out;
        *out = waiter;
        job = abandon(jobs, job);
        if (!job) continue;
        job->other_unwanted = *unwanted;
        *unwanted = job;
    }
}

static void drop_all(shd_job *job) {
    while (job) {
        shd_job *other = job->other_unwanted;
        shd_job_drop(job);
        job = other;
    }
}

static void answer_overdue(shd_waiter *waiters) {
    for (shd_waiter *w = waiters; w; w = w->other)
        shd_problem_reply(&w->exchange->reply, SHD_OVERDUE,
                          "not done after %.1f seconds: the limit `timeout` is %llu",
                          shd_now() - w->exchange->submitted,
                          (unsigned long long)w->exchange->settings->config.timeout);
    send(waiters);
}

static void answer_stopped(shd_waiter *waiters) {
    for (shd_waiter *w = waiters; w; w = w->other)
        shd_problem_reply(&w->exchange->reply, SHD_DRAINING,
                          "the server stops and the time for requests to finish is over");
    send(waiters);
}

static void *keep_time(void *context) {
    shd_jobs *jobs = context;
    pthread_mutex_lock(&jobs->mutex);
    while (!jobs->ending) {
        shd_waiter *late = NULL;
        shd_job *unwanted = NULL;
        expel(jobs, jobs->stopped ? INFINITY : shd_now(), &late, &unwanted);
        if (late) {
            bool stopped = jobs->stopped;
            pthread_mutex_unlock(&jobs->mutex);
            drop_all(unwanted);
            if (stopped)
                answer_stopped(late);
            else
                answer_overdue(late);
            pthread_mutex_lock(&jobs->mutex);
        } else if (jobs->line.next == &jobs->line) {
            jobs->wakes = INFINITY;
            pthread_cond_wait(&jobs->changed, &jobs->mutex);
        } else {
            jobs->wakes = jobs->line.next->deadline;
            struct timespec until = shd_timespec(jobs->line.next->deadline);
            pthread_cond_timedwait(&jobs->changed, &jobs->mutex, &until);
        }
    }
    pthread_mutex_unlock(&jobs->mutex);
    return NULL;
}

void shd_jobs_stop(shd_jobs *jobs) {
    pthread_mutex_lock(&jobs->mutex);
    jobs->stopped = true;
    pthread_cond_signal(&jobs->changed);
    pthread_mutex_unlock(&jobs->mutex);
}

/* ---- A job's way ---- */

bool shd_jobs_join(shd_jobs *jobs, shd_job *job, shd_exchange *exchange) {
    uint64_t hash = job->work->shared ? XXH3_64bits(job->question.body, job->question.size) : 0;
    shd_waiter *waiter = &exchange->waiter;
    waiter->exchange = exchange;
    waiter->deadline = exchange->submitted + (double)exchange->settings->config.timeout;
    pthread_mutex_lock(&jobs->mutex);
    shd_job *equal = job->work->shared ? find_by_body(jobs, job, hash) : NULL;
    if (!equal && job->work->shared) list(jobs->by_body, &job->by_body, job, hash);
    /* Those who came before it was read are settled then. */
    bool settled = equal && equal->was_read && equal->work->settle &&
                   equal->work->settle(equal, exchange, &exchange->reply);
    if (!settled) {
        if (equal) atomic_fetch_add(&jobs->server->metrics.joined, 1);
        wait_for(jobs, waiter, equal ? equal : job);
    }
    pthread_mutex_unlock(&jobs->mutex);
    if (settled) shd_exchange_resume(exchange);
    return equal;
}

bool shd_jobs_refuse(shd_jobs *jobs, shd_job *job, shd_exchange *exchange) {
    pthread_mutex_lock(&jobs->mutex);
    bool waits = exchange->waiter.job == job;
    if (waits) wait_no_more(&exchange->waiter);
    hide(jobs, job);
    pthread_mutex_unlock(&jobs->mutex);
    return waits;
}

bool shd_jobs_begin(shd_jobs *jobs, shd_job *job) {
    pthread_mutex_lock(&jobs->mutex);
    bool wanted = job->waiters;
    job->may_cancel = wanted && job->request;
    pthread_mutex_unlock(&jobs->mutex);
    return wanted;
}

bool shd_jobs_settle(shd_jobs *jobs, shd_job *job) {
    shd_waiter *settled = NULL;
    pthread_mutex_lock(&jobs->mutex);
    job->was_read = true;
    for (shd_waiter *w = job->waiters, *other; w; w = other) {
        other = w->other;
        if (!job->work->settle || !job->work->settle(job, w->exchange, &w->exchange->reply))
            continue;
        wait_no_more(w);
        w->other = settled;
        settled = w;
    }
    if (job->waiters && job->work->shared) {
        const char *etag = shd_request_etag(job->request);
        uint64_t hash = XXH3_64bits(etag, strlen(etag));
        shd_job *equal = find_by_meaning(jobs, job, hash);
        if (!equal) list(jobs->by_meaning, &job->by_meaning, job, hash);
        while (equal && job->waiters) {
            shd_waiter *w = job->waiters;
            wait_no_more(w);
            wait_for(jobs, w, equal);
            atomic_fetch_add(&jobs->server->metrics.joined, 1);
        }
    }
    bool wanted = job->waiters;
    if (!wanted) hide(jobs, job);
    job->may_cancel = wanted;
    pthread_mutex_unlock(&jobs->mutex);
    send(settled);
    return wanted;
}

/* Everybody's reply is a copy, which shares the body. */
static void fill(const shd_job *job, shd_exchange *exchange) {
    shd_reply *reply = &exchange->reply;
    double queued = job->began - exchange->submitted;
    if (queued < 0) queued = 0; /* it came when the job was running already */
    shd_metrics_stage(&job->server->metrics, SHD_STAGE_QUEUE, queued);
    if (job->reply.status == 200 && job->work->settle && job->work->settle(job, exchange, reply)) {
        shd_reply_share(reply, &job->reply); /* of which a 304 tells the length */
        return;
    }
    shd_reply_copy(reply, &job->reply);
    if (job->reply.status == 200 && job->work->add) job->work->add(job, queued, reply);
}

void shd_jobs_finish(shd_jobs *jobs, shd_job *job) {
    shd_waiter *all = NULL;
    pthread_mutex_lock(&jobs->mutex);
    hide(jobs, job);
    job->may_cancel = false;
    while (job->waiters) {
        shd_waiter *w = job->waiters;
        wait_no_more(w);
        w->other = all;
        all = w;
    }
    double weight = jobs->job_seconds > 0 ? 1.0 / 16 : 1;
    if (job->reply.status) jobs->job_seconds += weight * (job->seconds - jobs->job_seconds);
    pthread_mutex_unlock(&jobs->mutex);
    for (shd_waiter *w = all; w; w = w->other) fill(job, w->exchange);
    send(all);
}

bool shd_jobs_leave(shd_jobs *jobs, shd_exchange *exchange) {
    shd_job *unwanted = NULL;
    pthread_mutex_lock(&jobs->mutex);
    shd_job *job = exchange->waiter.job;
    if (job) {
        wait_no_more(&exchange->waiter);
        unwanted = abandon(jobs, job);
    }
    pthread_mutex_unlock(&jobs->mutex);
    if (unwanted) shd_job_drop(unwanted);
    if (job) atomic_fetch_add(&jobs->server->metrics.left, 1);
    return job;
}

unsigned shd_jobs_retry_after(shd_jobs *jobs) {
    shd_load load = shd_engine_load(jobs->server->engine);
    pthread_mutex_lock(&jobs->mutex);
    double seconds = jobs->job_seconds * (double)(load.queued + 1) / load.threads;
    pthread_mutex_unlock(&jobs->mutex);
    return seconds < 1 ? 1 : seconds > 300 ? 300 : (unsigned)ceil(seconds);
}

/* ---- The whole ---- */

shd_status shd_jobs_new(shd_server *server, shd_jobs **out, shd_error *error) {
    shd_jobs *jobs = calloc(1, sizeof *jobs);
    if (!jobs) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for the jobs");
    jobs->server = server;
    jobs->line.previous = jobs->line.next = &jobs->line;
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&jobs->mutex, NULL);
    pthread_cond_init(&jobs->changed, &monotonic);
    pthread_condattr_destroy(&monotonic);
    if (pthread_create(&jobs->thread, NULL, keep_time, jobs)) {
        pthread_cond_destroy(&jobs->changed);
        pthread_mutex_destroy(&jobs->mutex);
        free(jobs);
        return shd_fail(error, SHD_EXHAUSTED, "", "the system refused to start a thread");
    }
    *out = jobs;
    return SHD_OK;
}

void shd_jobs_drop(shd_jobs *jobs) {
    if (!jobs) return;
    pthread_mutex_lock(&jobs->mutex);
    jobs->ending = true;
    pthread_cond_signal(&jobs->changed);
    pthread_mutex_unlock(&jobs->mutex);
    pthread_join(jobs->thread, NULL);
    pthread_cond_destroy(&jobs->changed);
    pthread_mutex_destroy(&jobs->mutex);
    free(jobs);
}
