#include "equal.h"

#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#include "job.h"

enum { BUCKETS = 1024 };

struct shd_equals {
    shd_listing *by_body[BUCKETS], *by_meaning[BUCKETS];
};

static void list_job(shd_listing *table[BUCKETS], shd_listing *entry, shd_job *job, uint64_t hash) {
    *entry = (shd_listing){table[hash % BUCKETS], job, hash};
    table[hash % BUCKETS] = entry;
}

static void unlist_job(shd_listing *table[BUCKETS], shd_listing *entry) {
    if (!entry->job) return;
    shd_listing **at = &table[entry->hash % BUCKETS];
    while (*at != entry) at = &(*at)->next;
    *at = entry->next;
    entry->job = NULL;
}

static uint64_t hash_body(const shd_job *job) {
    return XXH3_64bits(job->question.body, job->question.size);
}

static uint64_t hash_meaning(const shd_job *job) {
    const char *etag = shd_request_etag(job->request);
    return XXH3_64bits(etag, strlen(etag));
}

static bool may_be_joined(const shd_job *job, double now) {
    return job->deadline - now >= (job->deadline - job->asked) / 2;
}

/* Hashes only narrow the search: the bodies themselves are compared, so that nobody can make up one
 * that is answered by another's picture. */
shd_job *shd_equals_by_body(const shd_equals *equals, const shd_job *like, double now) {
    const uint64_t hash = hash_body(like);
    for (shd_listing *l = equals->by_body[hash % BUCKETS]; l; l = l->next)
        if (l->hash == hash && l->job->work == like->work && may_be_joined(l->job, now) &&
            shd_question_same(&l->job->question, &like->question))
            return l->job;
    return NULL;
}

shd_job *shd_equals_by_meaning(const shd_equals *equals, const shd_job *like, double now) {
    const uint64_t hash = hash_meaning(like);
    const char *etag = shd_request_etag(like->request);
    for (shd_listing *l = equals->by_meaning[hash % BUCKETS]; l; l = l->next)
        if (l->hash == hash && l->job->work == like->work && may_be_joined(l->job, now) &&
            !strcmp(shd_request_etag(l->job->request), etag))
            return l->job;
    return NULL;
}

void shd_equals_list_body(shd_equals *equals, shd_job *job) {
    list_job(equals->by_body, &job->by_body, job, hash_body(job));
}

void shd_equals_list_meaning(shd_equals *equals, shd_job *job) {
    list_job(equals->by_meaning, &job->by_meaning, job, hash_meaning(job));
}

void shd_equals_hide(shd_equals *equals, shd_job *job) {
    unlist_job(equals->by_body, &job->by_body);
    unlist_job(equals->by_meaning, &job->by_meaning);
}

shd_equals *shd_equals_new(void) {
    return calloc(1, sizeof(shd_equals));
}

void shd_equals_drop(shd_equals *equals) {
    free(equals);
}
