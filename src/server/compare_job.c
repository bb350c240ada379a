#include "compare_job.h"

#include <string.h>

#include "job.h"
#include "problem.h"

static void answer(shd_exchange *exchange, shd_request *request, double queued) {
    (void)queued;
    shd_reply *reply = &exchange->reply;
    const char *body = exchange->body ? (const char *)exchange->body : "";
    shd_status status = shd_request_read(request, body, exchange->size, SHD_PNG);
    if (status == SHD_CANCELLED) return;
    if (status) {
        shd_problem_report(reply, shd_request_report(request));
        return;
    }
    char *json;
    shd_error error;
    status = shd_request_compare(request, NULL, &json, &error);
    if (status == SHD_CANCELLED) return;
    if (status) {
        shd_problem_error(reply, &error);
        return;
    }
    reply->status = 200;
    shd_reply_give(reply, "application/json", json, strlen(json));
    /* Times are of this run only. */
    shd_reply_plain(reply, "Cache-Control", "no-store");
    shd_job_warn(reply, request);
}

void shd_compare_submit(shd_exchange *exchange) {
    shd_job_submit(exchange, answer);
}
