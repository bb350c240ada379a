#include "jobs.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <time.h>

#include "base/clock.h"
#include "equal.h"
#include "job.h"
#include "server/answer/problem.h"
#include "turns.h"

/* How many of the last jobs, about, tell what work takes. */
static const double memory_of_jobs = 16;

struct shd_jobs {
    shd_engine *engine;
    shd_metrics *metrics;
    shd_jobs_calls calls;
    shd_jobs_limits limits;

    pthread_mutex_t mutex;
    pthread_cond_t changed;
    pthread_t thread;
    shd_equals *equals;
    shd_turns turns;           /* jobs that wait for a worker */
    shd_queue *crowd;          /* waiters; each costs 1, and nobody is taken from it */
    shd_job *first, *last;     /* jobs that somebody waits for, by deadline */
    double work, work_seconds; /* of the last jobs that are done */
    /* While the thread waits: when it looks next, infinity if it does not. */
    double wakes;
    bool stopped, ending; /* everybody is to leave; the thread is to end */
};

/* What is to be done once the mutex is free. */
typedef struct leftovers {
    shd_waiter *waiters; /* by `other`: to be told why they are sent away, or answered */
    shd_job *jobs;       /* by `later`: to be dropped */
} leftovers;

/* ---- Waiting ---- */

/* With the mutex. Deadlines mostly come in order: the place is near the end. */
static void insert_by_deadline(shd_jobs *jobs, shd_job *job) {
    shd_job *before = jobs->last;
    while (before && before->deadline > job->deadline) before = before->earlier;
    job->earlier = before;
    job->later = before ? before->later : jobs->first;
    *(job->earlier ? &job->earlier->later : &jobs->first) = job;
    *(job->later ? &job->later->earlier : &jobs->last) = job;
    /* The thread may still wait for the deadline of a job that was done long since: then it need
     * not be called for a later one, which on a quiet server is every one. */
    if (job->deadline < jobs->wakes) pthread_cond_signal(&jobs->changed);
}

/* With the mutex. */
static void attach_waiter(shd_jobs *jobs, shd_waiter *waiter, shd_job *job) {
    if (!job->waiters) insert_by_deadline(jobs, job);
    waiter->job = job;
    waiter->other = job->waiters;
    job->waiters = waiter;
}

/* With the mutex. */
static void detach_waiter(shd_jobs *jobs, shd_waiter *waiter) {
    shd_job *job = waiter->job;
    shd_waiter **at = &job->waiters;
    while (*at != waiter) at = &(*at)->other;
    *at = waiter->other;
    waiter->job = NULL;
    if (job->waiters) return;
    *(job->earlier ? &job->earlier->later : &jobs->first) = job->later;
    *(job->later ? &job->later->earlier : &jobs->last) = job->earlier;
}

/* With the mutex. From now on the waiter is the caller's, who answers it without the mutex. */
static void wait_no_more(shd_jobs *jobs, shd_waiter *waiter) {
    detach_waiter(jobs, waiter);
    shd_queue_leave(jobs->crowd, &waiter->turn);
}

/* With the mutex. If nobody waits for the job, nobody finds it any more, and it ends soon or at
 * once. */
static void abandon_job(shd_jobs *jobs, shd_job *job, leftovers *left) {
    if (job->waiters) return;
    shd_equals_hide(jobs->equals, job);
    if (!shd_turn_waits(&job->turn)) {
        if (!job->may_cancel) return;
        shd_request_cancel(job->request);
        shd_turns_watch(&jobs->turns, job);
        return;
    }
    shd_turns_leave(&jobs->turns, job);
    job->later = left->jobs;
    left->jobs = job;
}

/* ---- Sending away ---- */

/* With the mutex. New jobs pass large ones that run. But if no new one waits, the large ones take
 * the places. */
static unsigned retry_after(const shd_jobs *jobs, const char *client, shd_lane lane, double cost) {
    const unsigned threads = shd_engine_load(jobs->engine).threads;
    if (!shd_queue_count(jobs->turns.queue, SHD_LANE_NEW)) lane = SHD_LANE_LARGE;
    double ahead = shd_queue_ahead(jobs->turns.queue, lane, client, cost);
    if (lane == SHD_LANE_LARGE) ahead += jobs->turns.running;
    const double seconds = jobs->work > 0 ? ahead * jobs->work_seconds / jobs->work / threads : 0;
    return seconds < 1 ? 1 : seconds > 300 ? 300 : (unsigned)ceil(seconds);
}

/* With the mutex. The waiter does not wait, or does not any more. */
static void send_away(shd_waiter *waiter, enum shd_sent why, unsigned later, leftovers *left) {
    waiter->sent = why;
    waiter->retry_after = later;
    waiter->other = left->waiters;
    left->waiters = waiter;
}

/* With the mutex. All who wait for the job leave it, and it is abandoned. */
static void send_all_away(shd_jobs *jobs, shd_job *job, enum shd_sent why, leftovers *left) {
    const shd_lane lane = job->cost > jobs->limits.small ? SHD_LANE_LARGE : SHD_LANE_NEW;
    while (job->waiters) {
        shd_waiter *waiter = job->waiters;
        wait_no_more(jobs, waiter);
        waiter->waited = shd_now() - job->asked;
        waiter->limit = job->deadline - job->asked;
        send_away(waiter, why, retry_after(jobs, waiter->client, lane, job->cost), left);
    }
    abandon_job(jobs, job, left);
}

static void tell_why(const shd_jobs *jobs, const shd_waiter *waiter) {
    const unsigned long long places = jobs->limits.queue;
    shd_reply *reply = waiter->reply;
    if (waiter->sent == SHD_SENT_LATE)
        shd_problem_reply(reply, SHD_OVERDUE,
                          "not done after %.1f seconds: the limit `timeout` is %.0f",
                          waiter->waited, waiter->limit);
    else if (waiter->sent == SHD_SENT_FULL)
        shd_problem_later(reply, SHD_BUSY, waiter->retry_after,
                          "as many requests wait as may: the limit `queue` is %llu", places);
    else if (waiter->sent == SHD_SENT_DISPLACED)
        shd_problem_later(reply, SHD_BUSY, waiter->retry_after,
                          "it gave way to another client's: the limit `queue` is %llu, and this "
                          "client's requests held most of its places",
                          places);
    else if (waiter->sent == SHD_SENT_CROWD)
        shd_problem_later(reply, SHD_BUSY, waiter->retry_after,
                          "too many connections wait for answers, and this client has most");
    else if (waiter->sent == SHD_SENT_NO_MEMORY)
        shd_problem_reply(reply, SHD_NO_MEMORY, "no memory for a place in the queue");
    else
        shd_problem_reply(reply, SHD_DRAINING,
                          "the server stops and the time for requests to finish is over");
    const bool is_full = waiter->sent == SHD_SENT_FULL || waiter->sent == SHD_SENT_DISPLACED;
    if (is_full || waiter->sent == SHD_SENT_LATE)
        reply->limit = is_full ? SHD_LIMIT_QUEUE : SHD_LIMIT_TIMEOUT;
}

/* Without the mutex: answers and drops what is left over. */
static void clear_up(shd_jobs *jobs, const leftovers *left) {
    for (shd_job *job = left->jobs, *later; job; job = later) {
        later = job->later;
        jobs->calls.drop(job);
    }
    for (shd_waiter *waiter = left->waiters, *other; waiter; waiter = other) {
        other = waiter->other;
        if (waiter->sent != SHD_SENT_NOT) tell_why(jobs, waiter);
        waiter->answer(waiter);
    }
}

/* ---- Deadlines ---- */

static void *keep_time(void *context) {
    shd_jobs *jobs = context;
    pthread_mutex_lock(&jobs->mutex);
    while (!jobs->ending) {
        leftovers left = {NULL, NULL};
        while (jobs->first && (jobs->stopped || jobs->first->deadline <= shd_now()))
            send_all_away(jobs, jobs->first, jobs->stopped ? SHD_SENT_STOPPED : SHD_SENT_LATE,
                          &left);
        if (left.waiters) {
            pthread_mutex_unlock(&jobs->mutex);
            clear_up(jobs, &left);
            pthread_mutex_lock(&jobs->mutex);
            continue;
        }
        shd_stuck_tell(&jobs->turns.cancelled, &jobs->wakes);
        if (jobs->first) jobs->wakes = fmin(jobs->wakes, jobs->first->deadline);
        if (jobs->wakes < INFINITY) {
            const struct timespec until = shd_timespec(jobs->wakes);
            pthread_cond_timedwait(&jobs->changed, &jobs->mutex, &until);
        } else {
            pthread_cond_wait(&jobs->changed, &jobs->mutex);
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

/* ---- The queue ---- */

/* With the mutex. Gets the job a place, as the client's, and a ticket; or returns why not. */
static enum shd_sent queue_up(shd_jobs *jobs, shd_job *job, shd_lane lane, const char *client,
                              bool is_rest, leftovers *left) {
    void *displaced;
    const shd_entry entry = shd_queue_enter(jobs->turns.queue, &job->turn, job, lane, client,
                                            job->cost, is_rest, &displaced);
    if (entry != SHD_ENTRY_WAITS)
        return entry == SHD_ENTRY_FULL ? SHD_SENT_FULL : SHD_SENT_NO_MEMORY;
    if (displaced) send_all_away(jobs, displaced, SHD_SENT_DISPLACED, left);
    if (shd_turns_give(&jobs->turns, lane)) return SHD_SENT_NOT;
    shd_queue_leave(jobs->turns.queue, &job->turn);
    return SHD_SENT_FULL;
}

/* With the mutex. */
static enum shd_sent join_crowd(shd_jobs *jobs, shd_waiter *waiter, leftovers *left) {
    void *displaced;
    const shd_entry entry = shd_queue_enter(jobs->crowd, &waiter->turn, waiter, SHD_LANE_NEW,
                                            waiter->client, 1, false, &displaced);
    if (entry != SHD_ENTRY_WAITS)
        return entry == SHD_ENTRY_FULL ? SHD_SENT_CROWD : SHD_SENT_NO_MEMORY;
    if (!displaced) return SHD_SENT_NOT;
    shd_waiter *newest = displaced;
    shd_job *job = newest->job;
    wait_no_more(jobs, newest);
    abandon_job(jobs, job, left);
    send_away(newest, SHD_SENT_CROWD, retry_after(jobs, newest->client, SHD_LANE_NEW, 0), left);
    return SHD_SENT_NOT;
}

/* With the mutex. */
static void join_job(shd_jobs *jobs, shd_waiter *waiter, shd_job *job) {
    attach_waiter(jobs, waiter, job);
    waiter->joined = true;
    if (shd_turn_waits(&job->turn)) shd_queue_share(jobs->turns.queue, &job->turn, waiter->client);
    atomic_fetch_add(&jobs->metrics->joined, 1);
}

static bool is_settled(const shd_job *job, const shd_waiter *waiter) {
    return job->work->settle && job->work->settle(job, waiter->exchange, waiter->reply);
}

/* With the mutex. The waiter has its place in the crowd. False: it does not wait for this job, or
 * not at all. */
static bool find_work(shd_jobs *jobs, shd_job *job, shd_waiter *waiter, shd_lane lane,
                      leftovers *left) {
    const bool shared = job->work->shared;
    shd_job *equal = shared ? shd_equals_by_body(jobs->equals, job, shd_now()) : NULL;
    /* Those who came before it was read are settled then. */
    if (equal && equal->was_read && is_settled(equal, waiter)) {
        shd_queue_leave(jobs->crowd, &waiter->turn);
        send_away(waiter, SHD_SENT_NOT, 0, left);
    } else if (equal) {
        join_job(jobs, waiter, equal);
    } else {
        const enum shd_sent why = queue_up(jobs, job, lane, waiter->client, false, left);
        if (why == SHD_SENT_NOT) {
            attach_waiter(jobs, waiter, job);
            if (shared) shd_equals_list_body(jobs->equals, job);
            return true;
        }
        shd_queue_leave(jobs->crowd, &waiter->turn);
        send_away(waiter, why, retry_after(jobs, waiter->client, lane, job->cost), left);
    }
    return false;
}

bool shd_jobs_enter(shd_jobs *jobs, shd_job *job, shd_lane lane, shd_waiter *waiter) {
    leftovers left = {NULL, NULL};
    bool waits = false;
    pthread_mutex_lock(&jobs->mutex);
    const enum shd_sent why = join_crowd(jobs, waiter, &left);
    if (why == SHD_SENT_NOT)
        waits = find_work(jobs, job, waiter, lane, &left);
    else
        send_away(waiter, why, retry_after(jobs, waiter->client, SHD_LANE_NEW, 0), &left);
    pthread_mutex_unlock(&jobs->mutex);
    clear_up(jobs, &left);
    return waits;
}

/* ---- On a worker ---- */

/* With the mutex. The job is not the worker's any more. */
static void take_back(shd_jobs *jobs, shd_job *job) {
    jobs->turns.running -= job->cost;
    shd_stuck_forget(&job->watched);
}

/* With the mutex. If nobody waits for the job, the worker has it no more. */
static bool is_wanted(shd_jobs *jobs, shd_job *job) {
    if (!job->waiters) take_back(jobs, job);
    return job->waiters;
}

bool shd_jobs_begin(shd_jobs *jobs, shd_job *job) {
    pthread_mutex_lock(&jobs->mutex);
    bool wanted = is_wanted(jobs, job);
    job->may_cancel = wanted && job->request;
    pthread_mutex_unlock(&jobs->mutex);
    return wanted;
}

/* With the mutex. What was estimated before the document was read was for the queue to go by. */
static void correct_cost(shd_jobs *jobs, shd_job *job, double cost, bool is_large) {
    const double more = cost - job->cost;
    shd_turns_correct(&jobs->turns, job, more);
    if (more > 0 && job->waiters && !is_large)
        shd_queue_charge(jobs->turns.queue, job->begun ? SHD_LANE_LARGE : SHD_LANE_NEW,
                         job->waiters->client, more);
}

void shd_jobs_correct(shd_jobs *jobs, shd_job *job, double cost) {
    pthread_mutex_lock(&jobs->mutex);
    correct_cost(jobs, job, cost, false);
    pthread_mutex_unlock(&jobs->mutex);
}

/* With the mutex. */
static void settle_some(shd_jobs *jobs, shd_job *job, leftovers *left) {
    for (shd_waiter *w = job->waiters, *other; w; w = other) {
        other = w->other;
        if (!is_settled(job, w)) continue;
        wait_no_more(jobs, w);
        send_away(w, SHD_SENT_NOT, 0, left);
    }
}

/* With the mutex. */
static void join_equal(shd_jobs *jobs, shd_job *job) {
    shd_job *equal = shd_equals_by_meaning(jobs->equals, job, shd_now());
    if (!equal) shd_equals_list_meaning(jobs->equals, job);
    while (equal && job->waiters) {
        shd_waiter *waiter = job->waiters;
        detach_waiter(jobs, waiter);
        join_job(jobs, waiter, equal);
    }
}

bool shd_jobs_settle(shd_jobs *jobs, shd_job *job, double cost, bool is_large) {
    leftovers left = {NULL, NULL};
    pthread_mutex_lock(&jobs->mutex);
    job->was_read = true;
    correct_cost(jobs, job, cost, is_large);
    settle_some(jobs, job, &left);
    if (job->waiters && job->work->shared) join_equal(jobs, job);
    bool wanted = is_wanted(jobs, job);
    if (!wanted) shd_equals_hide(jobs->equals, job);
    job->may_cancel = wanted;
    pthread_mutex_unlock(&jobs->mutex);
    clear_up(jobs, &left);
    return wanted;
}

bool shd_jobs_is_early(shd_jobs *jobs, shd_job *job, double cost) {
    pthread_mutex_lock(&jobs->mutex);
    const bool is_early = shd_turns_is_early(job, cost);
    if (is_early) job->may_cancel = false;
    pthread_mutex_unlock(&jobs->mutex);
    return is_early;
}

bool shd_jobs_defer(shd_jobs *jobs, shd_job *job, double cost) {
    leftovers left = {NULL, NULL};
    bool waits = false;
    pthread_mutex_lock(&jobs->mutex);
    take_back(jobs, job);
    job->cost = cost;
    if (job->waiters) {
        const enum shd_sent why =
            queue_up(jobs, job, SHD_LANE_LARGE, job->waiters->client, true, &left);
        waits = why == SHD_SENT_NOT;
        for (shd_waiter *w = job->waiters->other; waits && w; w = w->other)
            shd_queue_share(jobs->turns.queue, &job->turn, w->client);
        job->may_cancel = job->may_cancel && waits;
        if (!waits) send_all_away(jobs, job, why, &left);
    }
    pthread_mutex_unlock(&jobs->mutex);
    clear_up(jobs, &left);
    return waits;
}

/* Without the mutex. Everybody's reply is a copy, which shares the body. */
static void fill_reply(shd_jobs *jobs, const shd_job *job, shd_waiter *waiter) {
    double queued = job->began - waiter->asked;
    if (queued < 0) queued = 0; /* it came when the job was running already */
    shd_metrics_stage(jobs->metrics, SHD_STAGE_QUEUE, queued);
    if (job->reply.status == 200 && is_settled(job, waiter)) {
        shd_reply_share(waiter->reply, &job->reply); /* of which a 304 tells the length */
        return;
    }
    shd_reply_copy(waiter->reply, &job->reply);
    if (job->reply.status == 200 && job->work->add) job->work->add(job, queued, waiter->reply);
}

void shd_jobs_finish(shd_jobs *jobs, shd_job *job) {
    leftovers left = {NULL, NULL};
    pthread_mutex_lock(&jobs->mutex);
    shd_equals_hide(jobs->equals, job);
    job->may_cancel = false;
    take_back(jobs, job);
    while (job->waiters) {
        shd_waiter *waiter = job->waiters;
        wait_no_more(jobs, waiter);
        send_away(waiter, SHD_SENT_NOT, 0, &left);
    }
    if (job->was_read && job->reply.status) {
        const double kept = 1 - 1 / memory_of_jobs;
        jobs->work = kept * jobs->work + job->cost;
        jobs->work_seconds = kept * jobs->work_seconds + job->seconds;
    }
    pthread_mutex_unlock(&jobs->mutex);
    for (shd_waiter *w = left.waiters; w; w = w->other) fill_reply(jobs, job, w);
    clear_up(jobs, &left);
}

bool shd_jobs_leave(shd_jobs *jobs, shd_waiter *waiter) {
    leftovers left = {NULL, NULL};
    pthread_mutex_lock(&jobs->mutex);
    shd_job *job = waiter->job;
    if (job) {
        wait_no_more(jobs, waiter);
        abandon_job(jobs, job, &left);
    }
    pthread_mutex_unlock(&jobs->mutex);
    clear_up(jobs, &left);
    if (job) atomic_fetch_add(&jobs->metrics->left, 1);
    return job;
}

shd_jobs_load shd_jobs_load_of(shd_jobs *jobs) {
    double next;
    pthread_mutex_lock(&jobs->mutex);
    const shd_jobs_load load = {.waiting = shd_queue_count(jobs->turns.queue, SHD_LANES),
                                .large_waiting = shd_queue_count(jobs->turns.queue, SHD_LANE_LARGE),
                                .large_begun = shd_turns_begun(&jobs->turns),
                                .stuck = shd_stuck_tell(&jobs->turns.cancelled, &next)};
    pthread_mutex_unlock(&jobs->mutex);
    return load;
}

unsigned shd_jobs_retry_after(shd_jobs *jobs, const char *client) {
    pthread_mutex_lock(&jobs->mutex);
    unsigned seconds = retry_after(jobs, client, SHD_LANE_NEW, 0);
    pthread_mutex_unlock(&jobs->mutex);
    return seconds;
}

/* ---- The whole ---- */

static shd_status start_thread(shd_jobs *jobs, shd_error *error) {
    pthread_mutex_init(&jobs->mutex, NULL);
    shd_cond_init(&jobs->changed);
    if (!pthread_create(&jobs->thread, NULL, keep_time, jobs)) return SHD_OK;
    pthread_cond_destroy(&jobs->changed);
    pthread_mutex_destroy(&jobs->mutex);
    return shd_fail(error, SHD_EXHAUSTED, "", "the system refused to start a thread");
}

static void free_jobs(shd_jobs *jobs) {
    shd_equals_drop(jobs->equals);
    shd_turns_clear(&jobs->turns);
    shd_queue_drop(jobs->crowd);
    free(jobs);
}

shd_status shd_jobs_new(shd_engine *engine, shd_metrics *metrics, const shd_jobs_limits *limits,
                        const shd_jobs_calls *calls, shd_jobs **out, shd_error *error) {
    shd_jobs *jobs = calloc(1, sizeof *jobs);
    if (!jobs) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for the jobs");
    *jobs = (shd_jobs){.engine = engine,
                       .metrics = metrics,
                       .limits = *limits,
                       .calls = *calls,
                       .turns = {.engine = engine,
                                 .mutex = &jobs->mutex,
                                 .changed = &jobs->changed,
                                 .run = calls->run},
                       .equals = shd_equals_new()};
    shd_status status = jobs->equals ? shd_turns_init(&jobs->turns, limits->queue, error)
                                     : shd_fail(error, SHD_EXHAUSTED, "", "no memory for the jobs");
    if (!status) status = shd_queue_new(limits->crowd, &jobs->crowd, error);
    if (!status) status = start_thread(jobs, error);
    if (status)
        free_jobs(jobs);
    else
        *out = jobs;
    return status;
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
    free_jobs(jobs);
}
