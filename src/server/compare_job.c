#include "compare_job.h"

#include <string.h>

#include "job.h"
#include "problem.h"

static void compare(shd_job *job) {
    char *json;
    shd_error error;
    shd_status status = shd_request_compare(job->request, NULL, &json, &error);
    if (status == SHD_CANCELLED) return;
    if (status) {
        shd_problem_error(&job->reply, &error);
        return;
    }
    job->reply.status = 200;
    shd_reply_give(&job->reply, "application/json", json, strlen(json));
    /* Times are of this run only. */
    shd_reply_plain(&job->reply, "Cache-Control", "no-store");
    shd_job_warn(&job->reply, job->request);
}

void shd_compare_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = shd_job_read, .run = compare, .size = SHD_LARGE};
    shd_job_submit(exchange, &work);
}
