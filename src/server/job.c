#include "job.h"

#include <stdlib.h>

#include "base/clock.h"
#include "negotiate.h"
#include "problem.h"

enum { WARNINGS_TOLD = 8 };

/* Work up to this is done at once, more is deferred: 512 x 512 pixels of 4 samples with 6 lights,
 * about 10 ms. */
static const uint64_t small_work = UINT64_C(1) << 23;

/* Bytes of a document that is read at once. Larger ones are large work before it is known what they
 * ask for: a megabyte takes up to half a second to read, and then 30 MB of memory. */
static const size_t small_document = 64 << 10;

void shd_job_warn(shd_reply *reply, const shd_request *request) {
    const shd_report *report = shd_request_report(request);
    size_t warnings = shd_report_warnings_kept(report);
    for (size_t i = 0; i < warnings && i < WARNINGS_TOLD; i++)
        shd_reply_warning(reply, report->warnings[i].pointer, report->warnings[i].detail);
}

void shd_job_read(shd_job *job) {
    const shd_question *asked = &job->question;
    const char *body = asked->body ? (const char *)asked->body : "";
    if (!shd_request_read(job->request, body, asked->size, asked->fallback)) return;
    if (job->work->refuse)
        job->work->refuse(job);
    else
        shd_problem_report(&job->reply, shd_request_report(job->request));
}

void shd_job_drop(shd_job *job) {
    shd_request_drop(job->request);
    shd_reply_clear(&job->reply);
    shd_settings_drop(job->settings);
    free(job->question.body);
    atomic_fetch_sub(&job->server->body_bytes, job->body_bytes);
    free(job);
}

/* Whoever still waits gets the reply; there is none only where nobody does. */
static void finish(shd_job *job) {
    if (job->request) shd_metrics_memory(&job->server->metrics, shd_request_memory(job->request));
    shd_jobs_finish(job->server->jobs, job);
    shd_job_drop(job);
}

static void run(void *context) {
    shd_job *job = context;
    double began = shd_now();
    job->work->run(job);
    job->seconds += shd_now() - began;
    finish(job);
}

static bool is_large(const shd_job *job) {
    return job->work->size == SHD_LARGE ||
           (job->work->size == SHD_BY_SCENE && shd_request_work(job->request) > small_work);
}

static void begin(void *context) {
    shd_job *job = context;
    shd_server *server = job->server;
    if (job->question.size > small_document && !job->had_turn) {
        job->had_turn = true;
        shd_engine_defer(server->engine, begin, job);
        return;
    }
    shd_error error;
    job->began = shd_now();
    if (shd_request_new(job->settings->engine, &job->request, &error))
        shd_problem_error(&job->reply, &error);
    if (!shd_jobs_begin(server->jobs, job)) {
        shd_job_drop(job);
        return;
    }
    if (job->request) job->work->read(job);
    job->seconds = shd_now() - job->began;
    if (job->reply.status)
        finish(job);
    else if (!shd_jobs_settle(server->jobs, job))
        shd_job_drop(job);
    else if (is_large(job) && !job->had_turn)
        shd_engine_defer(server->engine, run, job);
    else
        run(job);
}

void shd_job_submit(shd_exchange *exchange, const shd_work *work) {
    shd_server *server = exchange->server;
    exchange->submitted = shd_now();
    shd_job *job = calloc(1, sizeof *job);
    if (!job) {
        shd_problem_reply(&exchange->reply, SHD_NO_MEMORY, "out of memory");
        return;
    }
    *job = (shd_job){.server = server,
                     .settings = exchange->settings,
                     .work = work,
                     .question = {.body = exchange->body,
                                  .size = exchange->size,
                                  .fallback = SHD_PNG,
                                  .settings = exchange->settings->number}};
    shd_question *asked = &job->question;
    job->takes_gzip = shd_accepts_gzip(exchange->accept_encoding);
    asked->picture_accepted = shd_accepts_picture(exchange->accept, &asked->fallback);
    exchange->body = NULL;
    job->body_bytes = exchange->capacity;
    exchange->capacity = 0;
    atomic_fetch_add(&job->settings->holders, 1);
    if (work->recall && work->recall(job, exchange, &exchange->reply)) {
        shd_job_drop(job);
        return;
    }

    /* Suspended first: the answer may be there before the next line. */
    shd_exchange_suspend(exchange);
    if (shd_jobs_join(server->jobs, job, exchange)) {
        shd_job_drop(job);
        return;
    }
    if (shd_engine_submit(server->engine, begin, job)) return;

    bool waits = shd_jobs_refuse(server->jobs, job, exchange);
    shd_job_drop(job);
    if (!waits) return;
    shd_problem_later(&exchange->reply, SHD_BUSY, shd_jobs_retry_after(server->jobs),
                      "as many requests wait as may: the limit `queue` is %llu",
                      (unsigned long long)server->config.queue);
    shd_exchange_resume(exchange);
}
