#include "work.h"

#include "server/answer/problem.h"
#include "server/ops/settings.h"

/* 201 if it is new, 204 if it was kept already. */
static void answer_kept(shd_job *job, bool known) {
    job->reply.status = known ? 204 : 201;
    shd_reply_plain(&job->reply, "Cache-Control", "no-store");
    shd_job_warn(job);
}

/* Bytes that do not have the path's digest are no mesh; those of a mesh that is kept need not be
 * read again. */
static void read_body(shd_job *job) {
    const shd_digest digest = shd_digest_of(job->body, job->size);
    if (!shd_digest_same(&digest, &job->digest)) {
        char text[SHD_DIGEST_TEXT];
        shd_digest_write(&digest, text);
        shd_problem_reply(&job->reply, SHD_BAD_MESH, "the SHA-256 of the body's %zu bytes is %s",
                          job->size, text);
    } else if (shd_engine_has_mesh(job->settings->engine, &digest)) {
        answer_kept(job, true);
    }
}

static void keep_mesh(shd_job *job) {
    bool known = false;
    const shd_status status =
        shd_request_keep_mesh(job->request, job->body ? job->body : (const void *)"", job->size,
                              job->is_binary, &job->digest, job->client, &known);
    if (status == SHD_CANCELLED) return;
    if (status == SHD_OK)
        answer_kept(job, known);
    else
        shd_problem_report(&job->reply, shd_request_report(job->request), SHD_BAD_MESH);
}

void shd_mesh_submit(shd_exchange *exchange) {
    static const shd_work work = {.read = read_body, .run = keep_mesh, .size = SHD_SMALL};
    shd_job_submit(exchange, &work);
}
