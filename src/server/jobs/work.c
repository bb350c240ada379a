#include "work.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "base/clock.h"
#include "preview.h"
#include "scene_folder.h"
#include "server/answer/negotiate.h"
#include "server/answer/problem.h"
#include "server/ops/log.h"
#include "server/ops/memory.h"
#include "server/ops/settings.h"
#include "variants.h"

enum { WARNINGS_TOLD = 8 };

/* How many pictures a comparison is worth: one in each tier, and their differences. */
enum { COMPARED = 4 };

/* Work up to this is done at once, more is deferred: 512 x 512 pixels of 4 samples with 6 lights,
 * about 10 ms. */
static const double small_work = 1 << 23;

/* What a document costs before it is known what it asks for, and for each of its bytes: a megabyte
 * takes up to half a second to read. */
static const double unread_cost = 1 << 20, unread_byte_cost = 400;

/* Bytes of a document that is read at once. Larger ones are large work before it is known what they
 * ask for, and take 30 times their size of memory once they are read. */
static const size_t small_document = 64 << 10;

void shd_job_warn(shd_job *job) {
    const shd_report *report = shd_request_report(job->request);
    size_t warnings = shd_report_warnings_kept(report);
    for (size_t i = 0; i < warnings && i < WARNINGS_TOLD; i++)
        shd_reply_warning(&job->reply, report->warnings[i].pointer, report->warnings[i].detail);
}

void shd_job_read(shd_job *job) {
    const char *body = job->body ? (const char *)job->body : "";
    const shd_status status =
        shd_request_read(job->request, body, job->size, job->question.fallback);
    if (status == SHD_OK || status == SHD_CANCELLED) return;
    if (job->is_link)
        shd_preview_refuse(job);
    else
        shd_problem_report(&job->reply, shd_request_report(job->request), SHD_BAD_SCENE);
}

static void drop_job(shd_job *job) {
    assert(!job->waiters && !job->watched.next && !job->by_body.thing && !job->by_meaning.thing);
    shd_request_drop(job->request);
    shd_reply_clear(&job->reply);
    shd_kept_scene_drop(job->kept); /* before its engine goes with the settings */
    shd_settings_drop(job->settings);
    free(job->question.body);
    free(job->decoded);
    shd_memory_return_body(job->server, job->body_bytes);
    shd_variety_drop(job->variety);
    free(job);
}

/* Whether the document is known to be long. In a coding it is once it was measured. */
static bool is_long(const shd_job *job) {
    return job->documents > small_document ||
           (job->size > small_document && (!job->question.coding || job->was_measured));
}

bool shd_job_outgrows(shd_job *job, size_t documents) {
    const bool was_long = is_long(job);
    job->documents = documents;
    return !was_long && is_long(job);
}

static double find_unread_cost(const shd_job *job) {
    return unread_cost + unread_byte_cost * (double)(job->size + job->documents);
}

/* Once a daemon. */
static void log_loose_decoder(const shd_job *job) {
    if (!job->request || !shd_request_was_loose(job->request)) return;
    if (atomic_exchange(&job->server->loose_told, true)) return;
    shd_log_message(SHD_LOG_WARNING, "decoder-loose",
                    "shaded-decode has no filter of system calls: the kernel, a filter around the "
                    "daemon, or the build refuses seccomp(2)");
}

/* Whoever still waits gets the reply. There is none only if nobody does. */
static void finish_job(shd_job *job) {
    if (job->request) shd_metrics_memory(&job->server->metrics, shd_request_memory(job->request));
    log_loose_decoder(job);
    shd_jobs_finish(job->server->jobs, job);
    drop_job(job);
}

static void run_job(shd_job *job) {
    double began = shd_now();
    job->work->run(job);
    job->seconds += shd_now() - began;
    finish_job(job);
}

/* The cost of a document whose reading was cancelled is not known, nor asked for. */
static double find_cost(const shd_job *job) {
    const bool was_read = shd_request_report(job->request)->status == SHD_OK;
    if (!was_read) return job->cost;
    if (job->work->size == SHD_SMALL)
        return job->cost + (double)shd_request_planning_work(job->request);
    const double work = (double)shd_request_work(job->request);
    return job->work->size == SHD_LARGE ? COMPARED * work : work;
}

/* What a body stands for that has a coding, where that is not long, or its turn has come. Else only
 * about how long it is, since what waits must not have grown to a thousand times of what was sent,
 * nor others wait until all of it was seen. On a worker, whose time is divided among clients.
 * False: the reply says what is wrong, but where nobody waits for it. */
static bool decode_body(shd_job *job, bool has_turn) {
    const shd_question *asked = &job->question;
    const uint64_t most = job->settings->config.limits.body;
    const shd_inflation how = {
        .most = most,
        .keep = has_turn ? most : small_document,
        .budget = job->server->budget,
        .room = shd_memory_beside(job->server, job->body_bytes + SHD_LEAST_REQUEST),
        .request = job->request};
    size_t taken;
    shd_error error;
    const shd_status status = shd_inflate(asked->coding, asked->body, asked->size, &how,
                                          &job->decoded, &job->size, &taken, &error);
    if (asked->is_link && (status == SHD_SYNTAX || status == SHD_LIMIT))
        shd_problem_mistakes(&job->reply, status == SHD_LIMIT ? SHD_OVER_LIMIT : SHD_BAD_QUERY,
                             &(shd_mistake){.parameter = "document", .detail = error.text}, 1);
    else if (status == SHD_SYNTAX || status == SHD_LIMIT)
        shd_problem_reply(&job->reply, status == SHD_LIMIT ? SHD_TOO_LARGE : SHD_BAD_CODING, "%s",
                          error.text);
    else if (status != SHD_OK && status != SHD_CANCELLED)
        shd_problem_error(&job->reply, &error);
    if (status == SHD_LIMIT) job->reply.limit = error.limit;
    if (status) return false;
    job->was_measured = true;
    job->body = job->decoded;
    job->body_bytes += taken;
    atomic_fetch_add(&job->server->body_bytes, taken);
    return true;
}

/* A document that is kept, but not in memory. False: the reply says what is wrong. */
static bool find_kept(shd_job *job) {
    shd_error error;
    const char *text;
    const shd_status status = shd_scene_folder_find(
        job->server->scenes, job->settings->engine, (const shd_digest *)(void *)job->question.body,
        job->settings->config.limits.body, job->client, &job->kept, &text, &job->size, &error);
    if (status == SHD_MISSING)
        return shd_problem_reply(&job->reply, SHD_NOT_FOUND, "%s", error.text);
    if (status)
        shd_problem_error(&job->reply, &error);
    else
        job->body = (const unsigned char *)text;
    return !status;
}

/* Whether the document that the question's body stands for is there. */
static bool fetch_document(shd_job *job, bool has_turn) {
    const shd_question *asked = &job->question;
    if (asked->is_digest && !job->kept) return find_kept(job);
    const bool is_decoded = !asked->coding || (job->documents && job->decoded);
    return is_decoded || decode_body(job, has_turn);
}

/* Reads the document, and runs the job unless that is for another turn, among the large ones. */
static void read_and_make(shd_job *job, bool had_turn) {
    shd_jobs *jobs = job->server->jobs;
    const double start = shd_now();
    shd_request_hold(job->request, shd_memory_beside(job->server, job->body_bytes));
    job->work->read(job);
    job->seconds += shd_now() - start;
    if (job->reply.status) {
        finish_job(job);
        return;
    }
    if (!had_turn && is_long(job)) {
        shd_request_drop(job->request);
        job->request = NULL;
        if (!shd_jobs_defer(jobs, job, find_unread_cost(job))) drop_job(job);
        return;
    }
    const double cost = find_cost(job);
    const bool is_large = job->work->size == SHD_LARGE || cost > small_work;
    if (had_turn && shd_jobs_is_early(jobs, job, cost)) {
        shd_request_drop(job->request);
        job->request = NULL;
        if (!shd_jobs_defer(jobs, job, cost)) drop_job(job);
        return;
    }
    if (!shd_jobs_settle(jobs, job, cost, is_large && !had_turn))
        drop_job(job);
    else if (!is_large || had_turn)
        run_job(job);
    else if (!shd_jobs_defer(jobs, job, cost))
        drop_job(job);
}

/* Works on a job that was taken. If only decoding shows that its document is long, the job is for
 * another turn. */
static void work_on(shd_job *job) {
    if (job->was_read) {
        run_job(job);
        return;
    }
    const bool had_turn = is_long(job);
    const double start = shd_now();
    shd_error error;
    if (!job->request) {
        job->began = start;
        if (shd_request_new(job->settings->engine, &job->request, &error))
            shd_problem_error(&job->reply, &error);
    }
    if (!shd_jobs_begin(job->server->jobs, job)) {
        drop_job(job);
        return;
    }
    const bool is_known = job->request && fetch_document(job, had_turn);
    job->seconds += shd_now() - start;
    if (is_known && had_turn && job->question.coding)
        shd_jobs_correct(job->server->jobs, job, find_unread_cost(job));
    if (!is_known)
        finish_job(job);
    else if (had_turn || !is_long(job))
        read_and_make(job, had_turn);
    else if (!shd_jobs_defer(job->server->jobs, job, find_unread_cost(job)))
        drop_job(job);
}

shd_status shd_server_start_jobs(shd_server *server, shd_error *error) {
    /* A quarter of the connections is for who does not wait. */
    const size_t connections = server->config.connections;
    const shd_jobs_options options = {.queue = server->config.queue,
                                      .crowd = connections - connections / 4,
                                      .small = small_work,
                                      .run = work_on,
                                      .drop = drop_job};
    return shd_jobs_new(server->engine, &server->metrics, &options, &server->jobs, error);
}

/* ---- Exchanges ---- */

static bool leave_job(void *who) {
    shd_exchange *exchange = who;
    if (exchange->stream) return exchange->stream->kind->leave(exchange->stream);
    return shd_jobs_leave(exchange->server->jobs, &exchange->waiter);
}

static void resume_exchange(void *who) {
    shd_exchange_resume(who);
}

const shd_departure shd_exchange_departure = {.leave = leave_job, .release = resume_exchange};

static void answer_waiter(shd_waiter *waiter) {
    shd_exchange_resume((shd_exchange *)(void *)((char *)waiter - offsetof(shd_exchange, waiter)));
}

/* The job has what the exchange brought. NULL: memory is short. */
static shd_job *make_job(shd_exchange *exchange, const shd_work *work) {
    shd_job *job = calloc(1, sizeof *job);
    if (!job) return NULL;
    const bool is_inside = !exchange->coding && !exchange->is_digest;
    *job = (shd_job){.server = exchange->server,
                     .settings = exchange->settings,
                     .work = work,
                     .digest = exchange->digest,
                     .is_binary = exchange->is_binary,
                     .is_link = exchange->route == SHD_ROUTE_PREVIEW,
                     .kept = exchange->kept,
                     .body = is_inside ? exchange->body : (const void *)exchange->kept_text,
                     .size = exchange->is_digest ? exchange->kept_size : exchange->size,
                     .question = {.body = exchange->body,
                                  .size = exchange->size,
                                  .coding = exchange->coding,
                                  .fallback = exchange->format,
                                  .is_link = exchange->is_link,
                                  .is_digest = exchange->is_digest,
                                  .settings = exchange->settings->number}};
    memcpy(job->id, exchange->id, sizeof job->id);
    job->takes_parts = shd_accepts(exchange->accept, "multipart/form-data");
    shd_question *asked = &job->question;
    strcpy(job->client, exchange->client);
    job->takes_gzip = shd_accepts_gzip(exchange->accept_encoding);
    asked->picture_accepted =
        asked->is_link || shd_accepts_picture(exchange->accept, &asked->fallback);
    exchange->kept = NULL;
    exchange->body = NULL;
    job->body_bytes = exchange->capacity;
    exchange->capacity = 0;
    atomic_fetch_add(&job->settings->holders, 1);
    return job;
}

void shd_job_enter(shd_job *job, shd_waiter *waiter) {
    job->asked = waiter->asked;
    job->deadline = job->asked + (double)job->settings->config.timeout;
    job->cost = find_unread_cost(job);
    const shd_lane lane = is_long(job) ? SHD_LANE_LARGE : SHD_LANE_NEW;
    if (!shd_jobs_enter(job->server->jobs, job, lane, waiter)) drop_job(job);
}

void shd_job_submit(shd_exchange *exchange, const shd_work *work) {
    exchange->submitted = shd_now();
    shd_job *job = make_job(exchange, work);
    if (!job) {
        shd_problem_reply(&exchange->reply, SHD_NO_MEMORY, "out of memory");
        return;
    }
    if (work->recall && work->recall(job, exchange, &exchange->reply)) {
        drop_job(job);
        return;
    }

    exchange->waiter = (shd_waiter){.client = exchange->client,
                                    .exchange = exchange,
                                    .asked = exchange->submitted,
                                    .reply = &exchange->reply,
                                    .answer = answer_waiter};
    /* Suspended first: the answer may be there before the next line. */
    shd_exchange_suspend(exchange);
    shd_job_enter(job, &exchange->waiter);
}
