/* Meshes and pictures that are put under the digest of their bytes. */
#include "work.h"

#include "server/answer/problem.h"
#include "server/ops/settings.h"

/* 201 if it is new, 204 if it was kept already. */
static void answer_kept(shd_job *job, bool known) {
    job->reply.status = known ? 204 : 201;
    shd_reply_plain(&job->reply, "Cache-Control", "no-store");
    shd_job_warn(job);
}

/* Bytes that do not have the path's digest are not what was meant; those of a thing that is kept
 * need not be read again. */
static void check_body(shd_job *job, shd_problem_kind wrong,
                       bool has(shd_engine *engine, const shd_digest *digest)) {
    const shd_digest digest = shd_digest_of(job->body, job->size);
    if (!shd_digest_same(&digest, &job->digest)) {
        char text[SHD_DIGEST_TEXT];
        shd_digest_write(&digest, text);
        shd_problem_reply(&job->reply, wrong, "the SHA-256 of the body's %zu bytes is %s",
                          job->size, text);
    } else if (has(job->settings->engine, &digest)) {
        answer_kept(job, true);
    }
}

static void answer_put(shd_job *job, shd_status status, bool known, shd_problem_kind wrong) {
    if (status == SHD_CANCELLED) return;
    if (status == SHD_OK)
        answer_kept(job, known);
    else
        shd_problem_report(&job->reply, shd_request_report(job->request), wrong);
}

static const void *body_of(const shd_job *job) {
    return job->body ? job->body : (const void *)"";
}

static void read_mesh(shd_job *job) {
    check_body(job, SHD_BAD_MESH, shd_engine_has_mesh);
}

static void keep_mesh(shd_job *job) {
    bool known = false;
    const shd_status status = shd_request_keep_mesh(
        job->request, body_of(job), job->size, job->is_binary, &job->digest, job->client, &known);
    answer_put(job, status, known, SHD_BAD_MESH);
}

static void read_asset(shd_job *job) {
    check_body(job, SHD_BAD_ASSET, shd_engine_has_asset);
}

static void keep_asset(shd_job *job) {
    bool known = false;
    const shd_status status = shd_request_keep_asset(job->request, body_of(job), job->size,
                                                     &job->digest, job->client, &known);
    answer_put(job, status, known, SHD_BAD_ASSET);
}

void shd_mesh_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = read_mesh, .run = keep_mesh, .size = SHD_SMALL};
    shd_job_submit(exchange, &work);
}

void shd_asset_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = read_asset, .run = keep_asset, .size = SHD_SMALL};
    shd_job_submit(exchange, &work);
}
