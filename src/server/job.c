#include "job.h"

#include "clock.h"
#include "problem.h"

enum { WARNINGS_TOLD = 8 };

void shd_job_warn(shd_reply *reply, const shd_request *request) {
    const shd_report *report = shd_request_report(request);
    size_t warnings = shd_report_warnings_kept(report);
    for (size_t i = 0; i < warnings && i < WARNINGS_TOLD; i++)
        shd_reply_header(reply, "Shaded-Warning", "%.300s: %s", report->warnings[i].pointer,
                         report->warnings[i].detail);
}

static void run(void *context) {
    shd_exchange *exchange = context;
    shd_server *server = exchange->server;
    double queued = shd_now() - exchange->submitted;
    shd_metrics_stage(&server->metrics, SHD_STAGE_QUEUE, queued);

    shd_request *request = NULL;
    shd_error error;
    if (shd_request_new(server->engine, &request, &error))
        shd_problem_error(&exchange->reply, &error);
    else if (shd_watch_attach(server->watch, &exchange->watched, request))
        exchange->work(exchange, request, queued);

    shd_verdict verdict = shd_watch_remove(server->watch, &exchange->watched);
    shd_request_drop(request);
    if (!exchange->reply.status && verdict == SHD_STOPPED)
        shd_problem_reply(&exchange->reply, SHD_DRAINING,
                          "the server stops and the time for requests to finish is over");
    else if (!exchange->reply.status)
        shd_problem_reply(&exchange->reply, SHD_OVERDUE, "the limit `timeout` is %llu seconds",
                          (unsigned long long)server->config.timeout);
    shd_exchange_resume(exchange);
}

void shd_job_submit(shd_exchange *exchange, shd_work *work) {
    shd_server *server = exchange->server;
    exchange->work = work;
    exchange->submitted = shd_now();
    shd_watch_add(server->watch, &exchange->watched,
                  exchange->submitted + (double)server->config.timeout);
    /* Suspended first: the worker may be done before the next line. */
    shd_exchange_suspend(exchange);
    if (shd_engine_submit(server->engine, run, exchange)) return;

    shd_watch_remove(server->watch, &exchange->watched);
    shd_problem_reply(&exchange->reply, SHD_BUSY, "the limit `queue` is %llu waiting requests",
                      (unsigned long long)server->config.queue);
    shd_exchange_resume(exchange);
}
