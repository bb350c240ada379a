#include "work.h"

#include <stdlib.h>
#include <string.h>

#include "server/answer/gzip.h"
#include "server/answer/negotiate.h"
#include "server/answer/problem.h"

/* `text` is what there is to tell, which clients have compressed, unless `status` says that there
 * is nothing. */
static void answer_text(shd_job *job, shd_status status, const char *type, char *text, size_t size,
                        const char *vary, const shd_error *error) {
    if (status == SHD_CANCELLED) return;
    if (status) {
        shd_problem_error(&job->reply, error);
        return;
    }
    job->reply.status = 200;
    size_t less;
    char *gzip = job->takes_gzip ? shd_gzip(text, size, &less) : NULL;
    if (gzip) {
        free(text);
        shd_reply_plain(&job->reply, "Content-Encoding", "gzip");
    }
    shd_reply_give(&job->reply, type, gzip ? gzip : text, gzip ? less : size);
    shd_budget_count(job->server->budget, gzip ? less : size);
    shd_reply_count(&job->reply, job->server->budget, gzip ? less : size);
    shd_reply_plain(&job->reply, "Vary", vary);
    /* Times are of this run, estimates and kernels of this machine. */
    shd_reply_plain(&job->reply, "Cache-Control", "no-store");
    shd_job_warn(job);
}

static void answer_json(shd_job *job, shd_status status, char *json, const shd_error *error) {
    answer_text(job, status, "application/json", json, status ? 0 : strlen(json), "Accept-Encoding",
                error);
}

static void compare_tiers(shd_job *job) {
    char *json = NULL;
    shd_error error;
    shd_status status = shd_request_compare(job->request, NULL, &json, &error);
    answer_json(job, status, json, &error);
}

static void analyze_outputs(shd_job *job) {
    char *json = NULL;
    shd_error error;
    shd_status status = shd_request_analyze(job->request, NULL, &json, &error);
    answer_json(job, status, json, &error);
}

static void explain_scene(shd_job *job) {
    char *json = NULL;
    shd_error error;
    shd_status status = shd_request_explain(job->request, SHD_IN_JSON, &json, &error);
    answer_json(job, status, json, &error);
}

static void tell_brdf(shd_job *job, shd_brdf_form form) {
    static const char *const types[] = {[SHD_BRDF_JSON] = "application/json",
                                        [SHD_BRDF_SVG] = "image/svg+xml",
                                        [SHD_BRDF_PNG] = "image/png"};
    unsigned char *data;
    size_t size;
    shd_error error;
    if (form == SHD_BRDF_PNG) job->takes_gzip = false;
    const shd_status status = shd_request_brdf(job->request, form, &data, &size, &error);
    answer_text(job, status, types[form], (char *)data, size, "Accept, Accept-Encoding", &error);
}

static void tell_brdf_json(shd_job *job) {
    tell_brdf(job, SHD_BRDF_JSON);
}

static void tell_brdf_svg(shd_job *job) {
    tell_brdf(job, SHD_BRDF_SVG);
}

static void tell_brdf_png(shd_job *job) {
    tell_brdf(job, SHD_BRDF_PNG);
}

static void read_pair(shd_job *job) {
    const char *body = job->body ? (const char *)job->body : "";
    const shd_status status = shd_request_read_pair(job->request, body, job->size);
    if (status == SHD_OK || status == SHD_CANCELLED) return;
    shd_problem_report(&job->reply, shd_request_report(job->request), SHD_BAD_SCENE);
}

static void diff_pair(shd_job *job, bool map) {
    unsigned char *data = NULL;
    size_t size = 0;
    shd_error error;
    if (map) job->takes_gzip = false;
    const shd_status status = shd_request_diff_pair(job->request, map, &data, &size, &error);
    answer_text(job, status, map ? "image/png" : "application/json", (char *)data, size,
                "Accept, Accept-Encoding", &error);
}

static void diff_json(shd_job *job) {
    diff_pair(job, false);
}

static void diff_map(shd_job *job) {
    diff_pair(job, true);
}

static void read_fit(shd_job *job) {
    const char *body = job->body ? (const char *)job->body : "";
    const shd_status status = shd_request_read_fit(job->request, body, job->size);
    if (status == SHD_OK || status == SHD_CANCELLED) return;
    shd_problem_report(&job->reply, shd_request_report(job->request), SHD_BAD_SCENE);
}

static void fit_photo(shd_job *job) {
    char *json = NULL;
    shd_error error;
    const shd_status status = shd_request_fit_kept(job->request, &json, &error);
    answer_json(job, status, json, &error);
}

void shd_compare_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = shd_job_read, .run = compare_tiers, .size = SHD_LARGE};
    shd_job_submit(exchange, &work);
}

void shd_analyze_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = shd_job_read, .run = analyze_outputs, .size = SHD_LARGE};
    shd_job_submit(exchange, &work);
}

void shd_explain_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = shd_job_read, .run = explain_scene, .size = SHD_SMALL};
    shd_job_submit(exchange, &work);
}

void shd_brdf_submit(shd_exchange *exchange) {
    static const shd_work works[] = {
        [SHD_BRDF_JSON] = {.read = shd_job_read, .run = tell_brdf_json, .size = SHD_LARGE},
        [SHD_BRDF_SVG] = {.read = shd_job_read, .run = tell_brdf_svg, .size = SHD_LARGE},
        [SHD_BRDF_PNG] = {.read = shd_job_read, .run = tell_brdf_png, .size = SHD_LARGE}};
    shd_brdf_form form = SHD_BRDF_JSON;
    shd_accepts_figure(exchange->accept, &form);
    shd_job_submit(exchange, &works[form]);
}

void shd_diff_submit(shd_exchange *exchange) {
    static const shd_work works[] = {{.read = read_pair, .run = diff_json},
                                     {.read = read_pair, .run = diff_map}};
    bool map = false;
    shd_accepts_map(exchange->accept, &map);
    shd_job_submit(exchange, &works[map]);
}

void shd_fit_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = read_fit, .run = fit_photo};
    shd_job_submit(exchange, &work);
}
