#include "explain_job.h"

#include <string.h>

#include "job.h"
#include "problem.h"

static void explain(shd_job *job) {
    char *json;
    shd_error error;
    shd_status status = shd_request_explain(job->request, SHD_IN_JSON, &json, &error);
    if (status == SHD_CANCELLED) return;
    if (status) {
        shd_problem_error(&job->reply, &error);
        return;
    }
    job->reply.status = 200;
    shd_reply_give(&job->reply, "application/json", json, strlen(json));
    /* Estimates and kernels are of this machine. */
    shd_reply_plain(&job->reply, "Cache-Control", "no-store");
    shd_job_warn(&job->reply, job->request);
}

void shd_explain_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = shd_job_read, .run = explain, .size = SHD_SMALL};
    shd_job_submit(exchange, &work);
}
