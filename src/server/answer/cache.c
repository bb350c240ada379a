#include "cache.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <xxhash.h>

/* A question of more bytes is not kept: a mesh is seldom sent twice in the same way, and would take
 * the room of pictures. */
enum { QUESTION_MOST = 64 << 10 };

/* The largest share of the cap that one answer may have. */
enum { SHARE = 8 };

/* Bytes of an answer, for the number of buckets. */
enum { TYPICAL = 16 << 10, BUCKETS_MOST = 1 << 20 };

typedef struct entry {
    struct entry *newer, *older;                  /* by last use */
    struct entry *next_by_tag, *next_by_question; /* in the same bucket */
    uint64_t tag_hash, question_hash;
    char tag[SHD_TAG_SIZE];
    bool has_question;
    shd_question question; /* its body is owned */
    shd_reply reply;
    size_t bytes; /* all of it */
} entry;

struct shd_cache {
    pthread_mutex_t mutex;
    shd_budget *budget;
    size_t counted;      /* of the budget, beside answers' bodies */
    size_t bodies;       /* bytes of these */
    size_t cap, buckets; /* a power of two */
    uint64_t seed;       /* random: nobody can choose documents that share a bucket */
    entry **by_tag, **by_question;
    entry *newest, *oldest;
    shd_cache_load load;
};

bool shd_question_same(const shd_question *a, const shd_question *b) {
    return a->size == b->size && a->coding == b->coding && a->fallback == b->fallback &&
           a->picture_accepted == b->picture_accepted && a->settings == b->settings &&
           (!a->size || !memcmp(a->body, b->body, a->size));
}

static uint64_t hash_of(const shd_cache *cache, const void *data, size_t size) {
    return XXH3_64bits_withSeed(data, size, cache->seed);
}

/* A question on its way into the cache. */
typedef struct asked {
    shd_question question; /* `body` is a copy */
    uint64_t hash;
    bool kept;
} asked;

static bool is_kept(const shd_cache *cache, const shd_question *question) {
    return question && question->size <= QUESTION_MOST && question->size <= cache->cap / SHARE;
}

static asked copy_question(const shd_cache *cache, const shd_question *question) {
    if (!is_kept(cache, question)) return (asked){.kept = false};
    asked a = {.question = *question, .hash = hash_of(cache, question->body, question->size)};
    a.question.body = malloc(question->size + 1); /* NULL is out of memory alone */
    a.kept = a.question.body;
    if (a.kept && question->size) memcpy(a.question.body, question->body, question->size);
    return a;
}

/* ---- With the mutex held ---- */

static entry *find_tag(shd_cache *cache, const char *tag, uint64_t hash) {
    entry *e = cache->by_tag[hash & (cache->buckets - 1)];
    while (e && (e->tag_hash != hash || strcmp(e->tag, tag))) e = e->next_by_tag;
    return e;
}

static entry *find_question(shd_cache *cache, const shd_question *question, uint64_t hash) {
    entry *e = cache->by_question[hash & (cache->buckets - 1)];
    while (e && (e->question_hash != hash || !shd_question_same(&e->question, question)))
        e = e->next_by_question;
    return e;
}

static void unlink_use(shd_cache *cache, entry *e) {
    *(e->newer ? &e->newer->older : &cache->newest) = e->older;
    *(e->older ? &e->older->newer : &cache->oldest) = e->newer;
}

static void link_newest(shd_cache *cache, entry *e) {
    e->older = cache->newest;
    e->newer = NULL;
    *(cache->newest ? &cache->newest->newer : &cache->oldest) = e;
    cache->newest = e;
}

/* Returns the question's body, for the caller to free. */
static unsigned char *forget_question(shd_cache *cache, entry *e) {
    if (!e->has_question) return NULL;
    entry **at = &cache->by_question[e->question_hash & (cache->buckets - 1)];
    while (*at != e) at = &(*at)->next_by_question;
    *at = e->next_by_question;
    e->has_question = false;
    e->bytes -= e->question.size;
    cache->load.bytes -= e->question.size;
    return e->question.body;
}

/* The entry's question is `a` from now on. Returns a body for the caller to free. */
static unsigned char *take_question(shd_cache *cache, entry *e, const asked *a) {
    if (!a->kept || find_question(cache, &a->question, a->hash)) return a->question.body;
    unsigned char *old = forget_question(cache, e);
    entry **bucket = &cache->by_question[a->hash & (cache->buckets - 1)];
    e->question = a->question;
    e->question_hash = a->hash;
    e->has_question = true;
    e->next_by_question = *bucket;
    *bucket = e;
    e->bytes += e->question.size;
    cache->load.bytes += e->question.size;
    return old;
}

static void use(shd_cache *cache, entry *e, shd_reply *reply) {
    unlink_use(cache, e);
    link_newest(cache, e);
    shd_reply_copy(reply, &e->reply);
}

static void unlink_entry(shd_cache *cache, entry *e) {
    entry **at = &cache->by_tag[e->tag_hash & (cache->buckets - 1)];
    while (*at != e) at = &(*at)->next_by_tag;
    *at = e->next_by_tag;
    unlink_use(cache, e);
    cache->load.bytes -= e->bytes;
    cache->bodies -= e->reply.size;
    cache->load.entries--;
}

/* Puts the oldest entry at the head of a list. */
static entry *take_oldest(shd_cache *cache, entry *list) {
    entry *e = cache->oldest;
    e->question.body = forget_question(cache, e);
    unlink_entry(cache, e);
    cache->load.evictions++;
    e->older = list;
    return e;
}

/* Takes the oldest entries out until the rest is under the cap: a list linked by `older`, which the
 * caller drops without the mutex. The newest one stays: alone it is under the cap. */
static entry *evict(shd_cache *cache) {
    entry *list = NULL;
    while (cache->load.bytes > cache->cap && cache->oldest != cache->newest)
        list = take_oldest(cache, list);
    return list;
}

static void count_overhead(shd_cache *cache) {
    const size_t overhead = cache->load.bytes - cache->bodies;
    if (overhead > cache->counted) shd_budget_count(cache->budget, overhead - cache->counted);
    if (overhead < cache->counted) shd_budget_give(cache->budget, cache->counted - overhead);
    cache->counted = overhead;
}

/* ---- Any thread ---- */

static void drop_list(entry *list) {
    while (list) {
        entry *e = list;
        list = e->older;
        shd_reply_clear(&e->reply);
        free(e->question.body);
        free(e);
    }
}

shd_cached shd_cache_find(shd_cache *cache, const char *tag, const shd_question *question,
                          shd_reply *reply) {
    if (!cache->cap) return SHD_CACHE_OFF;
    uint64_t hash = hash_of(cache, tag, strlen(tag));
    pthread_mutex_lock(&cache->mutex);
    entry *e = find_tag(cache, tag, hash), *evicted = NULL;
    if (e) use(cache, e, reply);
    pthread_mutex_unlock(&cache->mutex);
    if (!e) return SHD_CACHE_MISS;

    /* The copy is made for a hit alone, and without the mutex; meanwhile the entry may have gone.
     */
    asked a = copy_question(cache, question);
    pthread_mutex_lock(&cache->mutex);
    e = find_tag(cache, tag, hash);
    unsigned char *old = a.question.body;
    if (e) {
        old = take_question(cache, e, &a);
        evicted = evict(cache);
        count_overhead(cache);
    }
    pthread_mutex_unlock(&cache->mutex);
    free(old);
    drop_list(evicted);
    return SHD_CACHE_HIT;
}

shd_cached shd_cache_ask(shd_cache *cache, const shd_question *question, char tag[SHD_TAG_SIZE],
                         shd_reply *reply) {
    if (!cache->cap) return SHD_CACHE_OFF;
    if (!is_kept(cache, question)) return SHD_CACHE_MISS;
    uint64_t hash = hash_of(cache, question->body, question->size);
    pthread_mutex_lock(&cache->mutex);
    entry *e = find_question(cache, question, hash);
    if (e) {
        memcpy(tag, e->tag, SHD_TAG_SIZE);
        use(cache, e, reply);
    }
    pthread_mutex_unlock(&cache->mutex);
    return e ? SHD_CACHE_HIT : SHD_CACHE_MISS;
}

/* What an entry takes without its question; malloc's own share is left out. */
static size_t bytes_of(const shd_reply *reply) {
    size_t bytes = sizeof(entry) + sizeof(shd_bytes_held) + reply->size;
    for (size_t i = 0; i < reply->header_count; i++) bytes += strlen(reply->headers[i].value) + 1;
    return bytes;
}

/* An entry that nobody knows yet; NULL where memory is short. */
static entry *make_entry(const char *tag, const shd_reply *reply) {
    entry *e = calloc(1, sizeof *e);
    if (!e) return NULL;
    strcpy(e->tag, tag);
    shd_reply_copy(&e->reply, reply);
    e->bytes = bytes_of(reply);
    /* Headers that found no memory would be missing ever after. */
    if (e->reply.header_count == reply->header_count) return e;
    drop_list(e);
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
    e->tag_hash = hash_of(cache, tag, strlen(tag));
    asked a = copy_question(cache, question);
    unsigned char *old = a.question.body;

    pthread_mutex_lock(&cache->mutex);
    entry *evicted = NULL, *there = find_tag(cache, tag, e->tag_hash);
    if (!there) {
        entry **bucket = &cache->by_tag[e->tag_hash & (cache->buckets - 1)];
        e->next_by_tag = *bucket;
        *bucket = e;
        link_newest(cache, e);
        cache->load.bytes += e->bytes;
        cache->bodies += e->reply.size;
        cache->load.entries++;
        old = take_question(cache, e, &a);
        evicted = evict(cache);
        count_overhead(cache);
    }
    pthread_mutex_unlock(&cache->mutex);
    free(old);
    drop_list(evicted);
    if (there) drop_list(e);
    return SHD_CACHE_STORED;
}

size_t shd_cache_trim(shd_cache *cache, size_t bytes) {
    entry *list = NULL;
    size_t freed = 0;
    pthread_mutex_lock(&cache->mutex);
    while (freed < bytes && cache->oldest) {
        list = take_oldest(cache, list);
        /* What somebody is being sent goes when it is sent. */
        const bool last = !list->reply.held || atomic_load(&list->reply.held->holders) == 1;
        freed += list->bytes - (last ? 0 : list->reply.size);
    }
    count_overhead(cache);
    pthread_mutex_unlock(&cache->mutex);
    drop_list(list);
    return freed;
}

shd_cache_load shd_cache_load_of(shd_cache *cache) {
    pthread_mutex_lock(&cache->mutex);
    shd_cache_load load = cache->load;
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
    cache->buckets = 1;
    while (cap && cache->buckets < cap / TYPICAL && cache->buckets < BUCKETS_MOST)
        cache->buckets *= 2;
    cache->by_tag = calloc(cache->buckets, sizeof(entry *));
    cache->by_question = calloc(cache->buckets, sizeof(entry *));
    shd_status status = SHD_OK;
    if (!cache->by_tag || !cache->by_question)
        status = shd_fail(error, SHD_EXHAUSTED, "", "no memory for the response cache");
    else if (getrandom(&cache->seed, sizeof cache->seed, 0) != (ssize_t)sizeof cache->seed)
        status = shd_fail(error, SHD_INTERNAL, "", "the system gives no random numbers");
    if (status)
        shd_cache_drop(cache);
    else
        *out = cache;
    return status;
}

void shd_cache_drop(shd_cache *cache) {
    if (!cache) return;
    drop_list(cache->newest); /* linked by `older` already */
    shd_budget_give(cache->budget, cache->counted);
    free(cache->by_tag);
    free(cache->by_question);
    pthread_mutex_destroy(&cache->mutex);
    free(cache);
}
