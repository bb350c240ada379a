#include "variants.h"

#include <stdlib.h>

#include "server/answer/problem.h"
#include "server/ops/memory.h"

/* How long others are waited for that give way to a document, seconds. */
static const double patience = 5;

struct shd_variety {
    atomic_uint holders;
    shd_server *server;
    shd_batch *batch;
    unsigned char *text, *decoded; /* one of them is the batch's */
    size_t bytes;                  /* of both, as the server counts them */
};

struct shd_variety *shd_variety_take(shd_job *job, shd_batch *batch) {
    struct shd_variety *variety = malloc(sizeof *variety);
    if (!variety) return NULL;
    *variety = (struct shd_variety){.holders = 1,
                                    .server = job->server,
                                    .batch = batch,
                                    .text = job->question.body,
                                    .decoded = job->decoded,
                                    .bytes = job->body_bytes};
    job->question.body = job->decoded = NULL;
    job->body = NULL;
    job->body_bytes = 0;
    return variety;
}

struct shd_variety *shd_variety_hold(struct shd_variety *variety) {
    atomic_fetch_add(&variety->holders, 1);
    return variety;
}

void shd_variety_drop(struct shd_variety *variety) {
    if (!variety || atomic_fetch_sub(&variety->holders, 1) != 1) return;
    shd_batch_drop(variety->batch);
    free(variety->text);
    free(variety->decoded);
    shd_memory_return_body(variety->server, variety->bytes);
    free(variety);
}

const shd_batch *shd_variety_batch(const struct shd_variety *variety) {
    return variety->batch;
}

bool shd_variety_write(shd_job *job) {
    char *text;
    size_t length;
    shd_error error;
    if (job->decoded) return true; /* it is read again */
    job->size = 0;
    const shd_status status =
        shd_batch_document(job->variety->batch, job->variant, job->request, &text, &length, &error);
    if (status == SHD_CANCELLED) return true; /* nobody wants it: it is empty */
    if (status != SHD_OK) {
        shd_problem_error(&job->reply, &error);
        return false;
    }
    if (!shd_budget_wait(job->server->budget, length, patience)) {
        free(text);
        return shd_problem_reply(&job->reply, SHD_BUSY,
                                 "other requests have the memory just now: the limit `memory` "
                                 "leaves too little");
    }
    job->decoded = (unsigned char *)text;
    job->body = job->decoded;
    job->size = length;
    job->body_bytes = length;
    atomic_fetch_add(&job->server->body_bytes, length);
    return true;
}
