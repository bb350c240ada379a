#include "cache.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/lru.h"

/* A question of more bytes is not kept: a mesh is seldom sent twice in the same way, and would take
 * the room of pictures. */
enum { QUESTION_MOST = 64 << 10 };

/* The largest share of the cap that one answer may have. */
enum { SHARE = 8 };

/* Bytes of an answer, for the size of the index. */
enum { TYPICAL = 16 << 10 };

typedef struct entry {
    shd_use use;
    shd_key by_tag, by_question; /* a question's bytes are owned; kind 0: there is none */
    char tag[SHD_TAG_SIZE];
    shd_reply reply;
} entry;

struct shd_cache {
    pthread_mutex_t mutex;
    shd_budget *budget; /* counts all but answers' bodies */
    size_t cap;
    shd_lru entries;
    shd_index index; /* by tags and by questions */
    uint64_t evictions;
};

uint64_t shd_question_kind(const shd_question *q) {
    return q->settings << 16 | (uint64_t)q->coding << 12 | (uint64_t)q->is_digest << 11 |
           (uint64_t)q->is_link << 10 | (uint64_t)q->fallback << 2 |
           (uint64_t)q->picture_accepted << 1 | 1;
}

/* Of kind 0. */
static shd_key tag_key(const shd_cache *cache, const char *tag) {
    return shd_index_key(&cache->index, 0, tag, strlen(tag));
}

/* Kind 0: the question is not kept. */
static shd_key question_key(const shd_cache *cache, const shd_question *q) {
    if (!q || q->size > QUESTION_MOST || q->size > cache->cap / SHARE) return (shd_key){.kind = 0};
    return shd_index_key(&cache->index, shd_question_kind(q), q->body, q->size);
}

/* ---- With the mutex held ---- */

static void link_entry(shd_cache *cache, entry *e) {
    shd_lru_put(&cache->entries, &e->use);
    shd_budget_count(cache->budget, e->use.bytes - e->reply.size);
}

static void unlink_entry(shd_cache *cache, entry *e) {
    shd_lru_take(&cache->entries, &e->use);
    shd_budget_give(cache->budget, e->use.bytes - e->reply.size);
}

static void forget_question(shd_cache *cache, entry *e) {
    if (!e->by_question.kind) return;
    shd_index_take(&cache->index, &e->by_question);
    free(e->by_question.bytes);
    e->use.bytes -= e->by_question.size;
    e->by_question.kind = 0;
}

/* The question finds an entry that is not linked from now on, if nothing else does and memory is
 * there. */
static void take_question(shd_cache *cache, entry *e, const shd_key *question) {
    if (!question || !question->kind || shd_index_find(&cache->index, question)) return;
    void *copy = malloc(question->size + 1); /* NULL is out of memory alone */
    if (!copy) return;
    if (question->size) memcpy(copy, question->bytes, question->size);
    forget_question(cache, e);
    e->by_question = *question;
    e->by_question.bytes = copy;
    e->use.bytes += question->size;
    shd_index_put(&cache->index, &e->by_question, e);
}

/* Moves the oldest entry to those which the caller drops without the mutex. */
static entry *take_oldest(shd_cache *cache, shd_lru *gone) {
    entry *e = (entry *)cache->entries.oldest;
    assert(e);
    unlink_entry(cache, e);
    forget_question(cache, e);
    shd_index_take(&cache->index, &e->by_tag);
    shd_lru_put(gone, &e->use);
    cache->evictions++;
    return e;
}

/* Takes the oldest entries out until the rest is under the cap. The newest one stays: alone it is
 * under the cap. */
static shd_lru evict_over_cap(shd_cache *cache) {
    shd_lru gone = {0};
    while (cache->entries.bytes > cache->cap && cache->entries.count > 1) take_oldest(cache, &gone);
    return gone;
}

/* ---- Any thread ---- */

static void drop_entry(entry *e) {
    shd_reply_clear(&e->reply);
    free(e);
}

static void drop_entries(shd_lru gone) {
    for (shd_use *u; (u = shd_lru_pop(&gone));) drop_entry((entry *)u);
}

/* The answer under a key, found by the question `asked` from now on, unless that is NULL. `tag`, if
 * it is not, gets its tag. */
static shd_cached recall(shd_cache *cache, const shd_key *key, const shd_key *asked, char *tag,
                         shd_reply *reply) {
    shd_lru gone = {0};
    pthread_mutex_lock(&cache->mutex);
    entry *e = shd_index_find(&cache->index, key);
    if (e) {
        if (tag) memcpy(tag, e->tag, SHD_TAG_SIZE);
        shd_reply_copy(reply, &e->reply);
        unlink_entry(cache, e);
        take_question(cache, e, asked);
        link_entry(cache, e);
        gone = evict_over_cap(cache);
    }
    pthread_mutex_unlock(&cache->mutex);
    drop_entries(gone);
    return e ? SHD_CACHE_HIT : SHD_CACHE_MISS;
}

shd_cached shd_cache_find(shd_cache *cache, const char *tag, const shd_question *question,
                          shd_reply *reply) {
    if (!cache->cap) return SHD_CACHE_OFF;
    const shd_key key = tag_key(cache, tag), asked = question_key(cache, question);
    return recall(cache, &key, &asked, NULL, reply);
}

shd_cached shd_cache_ask(shd_cache *cache, const shd_question *question, char tag[SHD_TAG_SIZE],
                         shd_reply *reply) {
    if (!cache->cap) return SHD_CACHE_OFF;
    const shd_key key = question_key(cache, question);
    return key.kind ? recall(cache, &key, NULL, tag, reply) : SHD_CACHE_MISS;
}

/* What an entry takes without its question; malloc's own share is left out. */
static size_t bytes_of(const shd_reply *reply) {
    size_t bytes = sizeof(entry) + sizeof(shd_bytes_held) + reply->size;
    for (size_t i = 0; i < reply->header_count; i++) bytes += strlen(reply->headers[i].value) + 1;
    return bytes;
}

/* An entry that nobody knows yet; NULL if memory is short. */
static entry *make_entry(const char *tag, const shd_reply *reply) {
    entry *e = calloc(1, sizeof *e);
    if (!e) return NULL;
    strcpy(e->tag, tag);
    shd_reply_copy(&e->reply, reply);
    e->use.bytes = bytes_of(reply);
    /* Headers that found no memory would be missing ever after. */
    if (e->reply.header_count == reply->header_count) return e;
    drop_entry(e);
    return NULL;
}

shd_cached shd_cache_put(shd_cache *cache, const char *tag, const shd_question *question,
                         shd_reply *reply) {
    if (!cache->cap) return SHD_CACHE_OFF;
    if (reply->is_short || strlen(tag) >= SHD_TAG_SIZE || bytes_of(reply) > cache->cap / SHARE)
        return SHD_CACHE_MISS;
    shd_reply_fit(reply);
    entry *e = make_entry(tag, reply);
    if (!e) return SHD_CACHE_MISS;
    e->by_tag = tag_key(cache, e->tag);
    const shd_key asked = question_key(cache, question);
    shd_lru gone = {0};
    pthread_mutex_lock(&cache->mutex);
    const bool there = shd_index_find(&cache->index, &e->by_tag);
    if (!there) {
        shd_index_put(&cache->index, &e->by_tag, e);
        take_question(cache, e, &asked);
        link_entry(cache, e);
        gone = evict_over_cap(cache);
    }
    pthread_mutex_unlock(&cache->mutex);
    drop_entries(gone);
    if (there) drop_entry(e);
    return SHD_CACHE_STORED;
}

size_t shd_cache_trim(shd_cache *cache, size_t bytes) {
    shd_lru gone = {0};
    size_t freed = 0;
    pthread_mutex_lock(&cache->mutex);
    while (freed < bytes && cache->entries.count) {
        const entry *e = take_oldest(cache, &gone);
        /* What somebody is being sent goes when it is sent. */
        const bool last = !e->reply.held || atomic_load(&e->reply.held->holders) == 1;
        freed += e->use.bytes - (last ? 0 : e->reply.size);
    }
    pthread_mutex_unlock(&cache->mutex);
    drop_entries(gone);
    return freed;
}

shd_cache_load shd_cache_load_of(shd_cache *cache) {
    pthread_mutex_lock(&cache->mutex);
    const shd_cache_load load = {cache->entries.bytes, cache->entries.count, cache->evictions};
    pthread_mutex_unlock(&cache->mutex);
    return load;
}

/* ---- The whole ---- */

shd_status shd_cache_new(size_t cap, shd_budget *budget, shd_cache **out, shd_error *error) {
    shd_cache *cache = calloc(1, sizeof *cache);
    if (!cache) return shd_fail(error, SHD_EXHAUSTED, "", "no memory for the response cache");
    pthread_mutex_init(&cache->mutex, NULL);
    cache->cap = cap;
    cache->budget = budget;
    const shd_status status = shd_index_new(cap / TYPICAL, &cache->index, error);
    if (status == SHD_OK)
        *out = cache;
    else
        shd_cache_drop(cache);
    return status;
}

void shd_cache_drop(shd_cache *cache) {
    if (!cache) return;
    shd_lru gone = {0};
    while (cache->entries.count) take_oldest(cache, &gone);
    drop_entries(gone);
    shd_index_drop(&cache->index);
    pthread_mutex_destroy(&cache->mutex);
    free(cache);
}
