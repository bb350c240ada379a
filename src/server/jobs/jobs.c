#include "jobs.h"

#include <assert.h>
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "job.h"
#include "server/answer/problem.h"
#include "turns.h"

/* Of what the jobs before one that is done tell of what work takes. */
static const double kept = 15. / 16;

/* On shd_now()'s clock: 30 years. */
static const double end_of_time = 1e9;

struct shd_jobs {
    shd_metrics *metrics;
    shd_jobs_options options;
    pthread_mutex_t mutex; /* the functions below have it, unless they are public or say so */
    pthread_cond_t changed;
    pthread_t thread;
    shd_index equals;          /* jobs by what is asked, so that equal ones are done once */
    shd_turns turns;           /* jobs that wait for a worker */
    shd_queue *crowd;          /* waiters; each costs 1, and nobody is taken from it */
    shd_job *first, *last;     /* jobs that somebody waits for, by deadline */
    double work, work_seconds; /* of the last jobs that are done */
    double wakes;              /* while the thread waits: when it looks next, or infinity */
    bool stopped, ending;      /* everybody is to leave; the thread is to end */
};

/* What is to be done once the mutex is free. */
typedef struct leftovers {
    shd_waiter *waiters; /* by `other`: to be told why they are sent away, or answered */
    shd_job *jobs;       /* by `later`: to be dropped */
    const shd_job *done; /* whose reply is the answer; NULL: they have their own */
} leftovers;

/* ---- Waiting ---- */

/* Deadlines mostly come in order: the place is near the end. */
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

static void attach_waiter(shd_jobs *jobs, shd_waiter *waiter, shd_job *job) {
    if (!job->waiters) insert_by_deadline(jobs, job);
    waiter->job = job;
    waiter->other = job->waiters;
    job->waiters = waiter;
}

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

/* From now on the waiter is the caller's, who answers it without the mutex. */
static void wait_no_more(shd_jobs *jobs, shd_waiter *waiter) {
    detach_waiter(jobs, waiter);
    shd_queue_leave(jobs->crowd, &waiter->turn);
}

/* An equal job that has at least half of its time left: who joins it can wait for it about as long
 * as for work of their own. Jobs are put in the index for want of one, so that only the last that
 * was put there can be it. */
static shd_job *find_equal(const shd_jobs *jobs, const shd_key *key) {
    shd_job *job = shd_index_find(&jobs->equals, key);
    return job && job->deadline - shd_now() >= (job->deadline - job->asked) / 2 ? job : NULL;
}

/* Nobody finds the job any more. */
static void hide_job(shd_jobs *jobs, shd_job *job) {
    if (job->by_body.thing) shd_index_take(&jobs->equals, &job->by_body);
    if (job->by_meaning.thing) shd_index_take(&jobs->equals, &job->by_meaning);
    job->by_body.thing = job->by_meaning.thing = NULL;
}

/* If nobody waits for the job, nobody finds it any more, and it ends soon or at once. */
static void abandon_job(shd_jobs *jobs, shd_job *job, leftovers *left) {
    if (job->waiters) return;
    hide_job(jobs, job);
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

/* New jobs pass large ones that run. But if no new one waits, the large ones take the places. */
static unsigned retry_after(const shd_jobs *jobs, const char *client, shd_lane lane, double cost) {
    const unsigned threads = shd_engine_load(jobs->turns.engine).threads;
    if (!shd_queue_count(jobs->turns.queue, SHD_LANE_NEW)) lane = SHD_LANE_LARGE;
    double ahead = shd_queue_ahead(jobs->turns.queue, lane, client, cost);
    if (lane == SHD_LANE_LARGE) ahead += jobs->turns.running;
    const double seconds = jobs->work > 0 ? ahead * jobs->work_seconds / jobs->work / threads : 0;
    return seconds < 1 ? 1 : seconds > 300 ? 300 : (unsigned)ceil(seconds);
}

/* The waiter does not wait, or does not any more. */
static void send_away(shd_waiter *waiter, enum shd_sent why, unsigned later, leftovers *left) {
    assert(!waiter->job && !shd_turn_waits(&waiter->turn));
    waiter->sent = why;
    waiter->retry_after = later;
    waiter->other = left->waiters;
    left->waiters = waiter;
}

/* The waiter gets the job's answer, or has its own. */
static void release_waiter(shd_jobs *jobs, shd_waiter *waiter, leftovers *left) {
    wait_no_more(jobs, waiter);
    send_away(waiter, SHD_SENT_NOT, 0, left);
}

/* All who wait for the job leave it, and it is abandoned. */
static void send_all_away(shd_jobs *jobs, shd_job *job, enum shd_sent why, leftovers *left) {
    const shd_lane lane = job->cost > jobs->options.small ? SHD_LANE_LARGE : SHD_LANE_NEW;
    while (job->waiters) {
        shd_waiter *waiter = job->waiters;
        wait_no_more(jobs, waiter);
        waiter->waited = shd_now() - job->asked;
        waiter->limit = job->deadline - job->asked;
        send_away(waiter, why, retry_after(jobs, waiter->client, lane, job->cost), left);
    }
    abandon_job(jobs, job, left);
}

/* Without the mutex. */
static void tell_why(const shd_jobs *jobs, const shd_waiter *waiter) {
    const unsigned long long places = jobs->options.queue;
    const unsigned later = waiter->retry_after;
    const enum shd_sent why = waiter->sent;
    shd_reply *reply = waiter->reply;
    if (why == SHD_SENT_LATE)
        shd_problem_reply(reply, SHD_OVERDUE,
                          "not done after %.1f seconds: the limit `timeout` is %.0f",
                          waiter->waited, waiter->limit);
    else if (why == SHD_SENT_FULL)
        shd_problem_later(reply, SHD_BUSY, later,
                          "as many requests wait as may: the limit `queue` is %llu", places);
    else if (why == SHD_SENT_DISPLACED)
        shd_problem_later(reply, SHD_BUSY, later,
                          "it gave way to another client's: the limit `queue` is %llu, and this "
                          "client's requests held most of its places",
                          places);
    else if (why == SHD_SENT_CROWD)
        shd_problem_later(reply, SHD_BUSY, later,
                          "too many connections wait for answers, and this client has most");
    else if (why == SHD_SENT_NO_MEMORY)
        shd_problem_reply(reply, SHD_NO_MEMORY, "no memory for a place in the queue");
    else
        shd_problem_reply(reply, SHD_DRAINING,
                          "the server stops and the time for requests to finish is over");
    if (why == SHD_SENT_LATE) reply->limit = SHD_LIMIT_TIMEOUT;
    if (why == SHD_SENT_FULL || why == SHD_SENT_DISPLACED) reply->limit = SHD_LIMIT_QUEUE;
}

static bool is_settled(const shd_job *job, const shd_waiter *waiter) {
    return job->work->settle && job->work->settle(job, waiter->exchange, waiter->reply);
}

/* Without the mutex. Everybody's reply is a copy, which shares the body. */
static void fill_reply(shd_jobs *jobs, const shd_job *job, shd_waiter *waiter) {
    const double queued = fmax(job->began - waiter->asked, 0); /* if it came while the job runs */
    shd_metrics_stage(jobs->metrics, SHD_STAGE_QUEUE, queued);
    if (job->reply.status == 200 && is_settled(job, waiter)) {
        shd_reply_share(waiter->reply, &job->reply); /* of which a 304 tells the length */
        return;
    }
    shd_reply_copy(waiter->reply, &job->reply);
    if (job->reply.status == 200 && job->work->add) job->work->add(job, queued, waiter->reply);
}

/* Leaves the mutex; drops what is left over, and answers once all who share a body have it. */
static void clear_up(shd_jobs *jobs, const leftovers *left) {
    pthread_mutex_unlock(&jobs->mutex);
    for (shd_job *job = left->jobs, *later; job; job = later) {
        later = job->later;
        jobs->options.drop(job);
    }
    for (shd_waiter *waiter = left->waiters; waiter && left->done; waiter = waiter->other)
        if (waiter->sent == SHD_SENT_NOT) fill_reply(jobs, left->done, waiter);
    for (shd_waiter *waiter = left->waiters, *other; waiter; waiter = other) {
        other = waiter->other;
        if (waiter->sent != SHD_SENT_NOT) tell_why(jobs, waiter);
        waiter->answer(waiter);
    }
}

/* ---- Deadlines ---- */

/* A thread of its own, which begins without the mutex. */
static void *keep_time(void *context) {
    shd_jobs *jobs = context;
    pthread_mutex_lock(&jobs->mutex);
    while (!jobs->ending) {
        leftovers left = {.jobs = NULL};
        while (jobs->first && (jobs->stopped || jobs->first->deadline <= shd_now()))
            send_all_away(jobs, jobs->first, jobs->stopped ? SHD_SENT_STOPPED : SHD_SENT_LATE,
                          &left);
        if (left.waiters) {
            clear_up(jobs, &left);
            pthread_mutex_lock(&jobs->mutex);
            continue;
        }
        shd_stuck_tell(&jobs->turns.cancelled, &jobs->wakes);
        if (jobs->first) jobs->wakes = fmin(jobs->wakes, jobs->first->deadline);
        const struct timespec until = shd_timespec(fmin(jobs->wakes, end_of_time));
        pthread_cond_timedwait(&jobs->changed, &jobs->mutex, &until);
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

/* Gets the job a place, as the client's, and a ticket; or returns why not. */
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

static void join_job(shd_jobs *jobs, shd_waiter *waiter, shd_job *job) {
    attach_waiter(jobs, waiter, job);
    waiter->joined = true;
    if (shd_turn_waits(&job->turn)) shd_queue_share(jobs->turns.queue, &job->turn, waiter->client);
    atomic_fetch_add(&jobs->metrics->joined, 1);
}

/* The waiter has its place in the crowd. False: it does not wait for this job, or not at all. */
static bool find_work(shd_jobs *jobs, shd_job *job, shd_waiter *waiter, shd_lane lane,
                      leftovers *left) {
    const bool shared = job->work->shared;
    shd_job *equal = shared ? find_equal(jobs, &job->by_body) : NULL;
    /* Those who came before it was read are settled then. */
    const bool settled = equal && equal->was_read && is_settled(equal, waiter);
    enum shd_sent why = SHD_SENT_NOT;
    if (!equal) why = queue_up(jobs, job, lane, waiter->client, false, left);
    if (settled || why != SHD_SENT_NOT) {
        shd_queue_leave(jobs->crowd, &waiter->turn);
        send_away(waiter, why, retry_after(jobs, waiter->client, lane, job->cost), left);
    } else if (equal) {
        join_job(jobs, waiter, equal);
    } else {
        attach_waiter(jobs, waiter, job);
        if (shared) shd_index_put(&jobs->equals, &job->by_body, job);
    }
    return waiter->job == job;
}

bool shd_jobs_enter(shd_jobs *jobs, shd_job *job, shd_lane lane, shd_waiter *waiter) {
    const shd_question *asked = &job->question;
    leftovers left = {.jobs = NULL};
    bool waits = false;
    /* Its lowest bits tell the kind from those of meanings. */
    if (job->work->shared)
        job->by_body = shd_index_key(&jobs->equals, shd_question_kind(asked) << 1 | job->is_link,
                                     asked->body, asked->size);
    pthread_mutex_lock(&jobs->mutex);
    const enum shd_sent why = join_crowd(jobs, waiter, &left);
    if (why == SHD_SENT_NOT)
        waits = find_work(jobs, job, waiter, lane, &left);
    else
        send_away(waiter, why, retry_after(jobs, waiter->client, SHD_LANE_NEW, 0), &left);
    clear_up(jobs, &left);
    return waits;
}

/* ---- On a worker ---- */

/* The job is not the worker's any more. */
static void take_back(shd_jobs *jobs, shd_job *job) {
    jobs->turns.running -= job->cost;
    shd_stuck_forget(&job->watched);
}

/* If nobody waits for the job, the worker has it no more. */
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

/* What was estimated before the document was read was for the queue to go by. */
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

static void join_equal(shd_jobs *jobs, shd_job *job) {
    const char *tag = shd_request_etag(job->request);
    job->by_meaning = shd_index_key(&jobs->equals, job->is_link, tag, strlen(tag));
    shd_job *equal = find_equal(jobs, &job->by_meaning);
    if (!equal) shd_index_put(&jobs->equals, &job->by_meaning, job);
    while (equal && job->waiters) {
        shd_waiter *waiter = job->waiters;
        detach_waiter(jobs, waiter);
        join_job(jobs, waiter, equal);
    }
}

bool shd_jobs_settle(shd_jobs *jobs, shd_job *job, double cost, bool is_large) {
    leftovers left = {.jobs = NULL};
    pthread_mutex_lock(&jobs->mutex);
    job->was_read = true;
    correct_cost(jobs, job, cost, is_large);
    for (shd_waiter *w = job->waiters, *other; w; w = other) {
        other = w->other;
        if (is_settled(job, w)) release_waiter(jobs, w, &left);
    }
    if (job->waiters && job->work->shared) join_equal(jobs, job);
    bool wanted = is_wanted(jobs, job);
    if (!wanted) hide_job(jobs, job);
    job->may_cancel = wanted;
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
    leftovers left = {.jobs = NULL};
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
    clear_up(jobs, &left);
    return waits;
}

void shd_jobs_finish(shd_jobs *jobs, shd_job *job) {
    leftovers left = {.done = job};
    pthread_mutex_lock(&jobs->mutex);
    hide_job(jobs, job);
    job->may_cancel = false;
    take_back(jobs, job);
    while (job->waiters) release_waiter(jobs, job->waiters, &left);
    if (job->was_read && job->reply.status) {
        jobs->work = kept * jobs->work + job->cost;
        jobs->work_seconds = kept * jobs->work_seconds + job->seconds;
    }
    clear_up(jobs, &left);
}

bool shd_jobs_leave(shd_jobs *jobs, shd_waiter *waiter) {
    leftovers left = {.jobs = NULL};
    pthread_mutex_lock(&jobs->mutex);
    shd_job *job = waiter->job;
    if (job) {
        wait_no_more(jobs, waiter);
        abandon_job(jobs, job, &left);
    }
    clear_up(jobs, &left);
    if (job) atomic_fetch_add(&jobs->metrics->left, 1);
    return job;
}

shd_jobs_load shd_jobs_load_of(shd_jobs *jobs) {
    pthread_mutex_lock(&jobs->mutex);
    const shd_jobs_load load = {.waiting = shd_queue_count(jobs->turns.queue, SHD_LANES),
                                .large_waiting = shd_queue_count(jobs->turns.queue, SHD_LANE_LARGE),
                                .large_begun = shd_turns_begun(&jobs->turns),
                                .stuck = shd_stuck_tell(&jobs->turns.cancelled, &(double){0})};
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

static void free_jobs(shd_jobs *jobs) {
    pthread_cond_destroy(&jobs->changed);
    pthread_mutex_destroy(&jobs->mutex);
    shd_index_drop(&jobs->equals);
    shd_queue_drop(jobs->turns.queue);
    shd_queue_drop(jobs->crowd);
    free(jobs);
}

shd_status shd_jobs_new(shd_engine *engine, shd_metrics *metrics, const shd_jobs_options *options,
                        shd_jobs **out, shd_error *error) {
    shd_jobs *jobs = calloc(1, sizeof *jobs);
    if (!jobs) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for the jobs");
    *jobs = (shd_jobs){.metrics = metrics, .options = *options};
    jobs->turns = (shd_turns){
        .engine = engine, .mutex = &jobs->mutex, .changed = &jobs->changed, .run = options->run};
    pthread_mutex_init(&jobs->mutex, NULL);
    shd_cond_init(&jobs->changed);
    shd_status status = shd_index_new(options->queue, &jobs->equals, error);
    if (!status) status = shd_turns_init(&jobs->turns, options->queue, error);
    if (!status) status = shd_queue_new(options->crowd, &jobs->crowd, error);
    if (!status && pthread_create(&jobs->thread, NULL, keep_time, jobs))
        status = shd_fail(error, SHD_EXHAUSTED, "", "the system refused to start a thread");
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
    free_jobs(jobs);
}
