#include "work.h"

#include <stdlib.h>
#include <string.h>

#include "server/answer/gzip.h"
#include "server/answer/problem.h"

/* `json` is what there is to tell, unless `status` says that there is nothing. */
static void answer_json(shd_job *job, shd_status status, char *json, const shd_error *error) {
    if (status == SHD_CANCELLED) return;
    if (status) {
        shd_problem_error(&job->reply, error);
        return;
    }
    job->reply.status = 200;
    size_t size = strlen(json), less;
    char *gzip = job->takes_gzip ? shd_gzip(json, size, &less) : NULL;
    if (gzip) {
        free(json);
        shd_reply_plain(&job->reply, "Content-Encoding", "gzip");
    }
    shd_reply_give(&job->reply, "application/json", gzip ? gzip : json, gzip ? less : size);
    shd_budget_count(job->server->budget, gzip ? less : size);
    shd_reply_count(&job->reply, job->server->budget, gzip ? less : size);
    shd_reply_plain(&job->reply, "Vary", "Accept-Encoding");
    /* Times are of this run, estimates and kernels of this machine. */
    shd_reply_plain(&job->reply, "Cache-Control", "no-store");
    shd_job_warn(job);
}

static void compare_tiers(shd_job *job) {
    char *json = NULL;
    shd_error error;
    shd_status status = shd_request_compare(job->request, NULL, &json, &error);
    answer_json(job, status, json, &error);
}

static void explain_scene(shd_job *job) {
    char *json = NULL;
    shd_error error;
    shd_status status = shd_request_explain(job->request, SHD_IN_JSON, &json, &error);
    answer_json(job, status, json, &error);
}

void shd_compare_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = shd_job_read, .run = compare_tiers, .size = SHD_LARGE};
    shd_job_submit(exchange, &work);
}

void shd_explain_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = shd_job_read, .run = explain_scene, .size = SHD_SMALL};
    shd_job_submit(exchange, &work);
}
