#include "assets/store.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

enum { ALIGNMENT = 64, BUCKETS = 4096, SHARE = 2 /* one client may have 1/SHARE of the cap */ };

typedef struct client {
    struct client *next, *previous;
    shd_stored *newest, *oldest; /* by last use; there is at least one */
    size_t bytes;
    char name[SHD_STORE_CLIENT];
} client;

struct shd_stored {
    shd_store *store;
    shd_digest digest;
    size_t bytes;
    unsigned holders; /* one more while it is kept */
    client *client;   /* NULL: the thing is not kept */
    bool was_kept;
    shd_stored *next; /* in the same bucket */
    shd_stored *newer, *older;
};

/* What stands before a thing's bytes. */
enum { HEAD = (sizeof(shd_stored) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT };

struct shd_store {
    pthread_mutex_t mutex;
    uint64_t seed; /* random: nobody can choose digests that share a bucket */
    shd_budget *budget;
    shd_stored *buckets[BUCKETS];
    client *clients;
    shd_store_load load;
};

/* ---- The mutex is held ---- */

/* The one place where bytes are counted: those of things that are kept, and those of things that
 * are only held. */
static void count_bytes(shd_store *store, ptrdiff_t kept, ptrdiff_t held) {
    store->load.bytes += (size_t)kept;
    store->load.held += (size_t)held;
}

static shd_stored **bucket_of(shd_store *store, const shd_digest *digest) {
    uint64_t word;
    memcpy(&word, digest->bytes, sizeof word);
    return &store->buckets[((word ^ store->seed) * UINT64_C(0x9e3779b97f4a7c15)) >> 52];
}

static shd_stored *find_thing(shd_store *store, const shd_digest *digest) {
    shd_stored *thing = *bucket_of(store, digest);
    while (thing && !shd_digest_same(&thing->digest, digest)) thing = thing->next;
    return thing;
}

static client *find_client(shd_store *store, const char *name) {
    client *c = store->clients;
    while (c && strncmp(c->name, name, sizeof c->name - 1)) c = c->next;
    return c;
}

static void link_newest(shd_stored *thing) {
    client *c = thing->client;
    thing->older = c->newest;
    thing->newer = NULL;
    *(c->newest ? &c->newest->newer : &c->oldest) = thing;
    c->newest = thing;
}

static void unlink_use(shd_stored *thing) {
    client *c = thing->client;
    *(thing->newer ? &thing->newer->older : &c->newest) = thing->older;
    *(thing->older ? &thing->older->newer : &c->oldest) = thing->newer;
}

static void keep_thing(shd_store *store, shd_stored *thing, client *c) {
    shd_stored **bucket = bucket_of(store, &thing->digest);
    thing->next = *bucket;
    *bucket = thing;
    thing->client = c;
    thing->holders++;
    link_newest(thing);
    c->bytes += thing->bytes;
    store->load.things++;
    count_bytes(store, (ptrdiff_t)thing->bytes, 0);
}

static void drop_client(shd_store *store, client *c) {
    *(c->previous ? &c->previous->next : &store->clients) = c->next;
    if (c->next) c->next->previous = c->previous;
    free(c);
}

/* Returns the thing if nobody holds it, for the caller to free after the mutex is released. */
static shd_stored *forget_thing(shd_store *store, shd_stored *thing) {
    client *c = thing->client;
    shd_stored **at = bucket_of(store, &thing->digest);
    while (*at != thing) at = &(*at)->next;
    *at = thing->next;
    unlink_use(thing);
    c->bytes -= thing->bytes;
    if (!c->newest) drop_client(store, c);
    thing->client = NULL;
    store->load.things--;
    store->load.evictions++;
    const bool held = --thing->holders;
    count_bytes(store, -(ptrdiff_t)thing->bytes, held ? (ptrdiff_t)thing->bytes : 0);
    return held ? NULL : thing;
}

/* The thing to forget next: the oldest one of the client that has most. The thing that was put last
 * is spared; it is its client's oldest only if the client has nothing else. NULL: there is
 * nothing. */
static shd_stored *find_victim(const shd_store *store, const shd_stored *last) {
    const client *most = NULL;
    for (const client *c = store->clients; c; c = c->next)
        if (c->oldest != last && (!most || c->bytes > most->bytes)) most = c;
    return most ? most->oldest : NULL;
}

/* Returns a list of the things to free, linked by `older`. */
static shd_stored *make_room(shd_store *store, size_t bytes, const shd_stored *last) {
    shd_stored *list = NULL, *victim;
    while (store->load.bytes > bytes && (victim = find_victim(store, last))) {
        shd_stored *freed = forget_thing(store, victim);
        if (!freed) continue;
        freed->older = list;
        list = freed;
    }
    return list;
}

/* ---- Any thread ---- */

static void free_thing(shd_stored *thing) {
    shd_budget *budget = thing->store->budget;
    const size_t bytes = thing->bytes;
    free(thing);
    shd_budget_give(budget, bytes);
}

/* Frees a list, and returns how many bytes its things had. */
static size_t free_list(shd_stored *list) {
    size_t bytes = 0;
    while (list) {
        shd_stored *thing = list;
        list = thing->older;
        bytes += thing->bytes;
        free_thing(thing);
    }
    return bytes;
}

shd_status shd_stored_new(shd_store *store, const shd_digest *digest, size_t bytes,
                          shd_stored **out, shd_error *error) {
    size_t whole;
    if (__builtin_add_overflow(bytes, HEAD + ALIGNMENT - 1, &whole))
        return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    whole = whole / ALIGNMENT * ALIGNMENT;
    if (!shd_budget_take(store->budget, whole))
        return shd_fail(error, SHD_CROWDED, "", "the process may take no more memory just now");
    shd_stored *thing = aligned_alloc(ALIGNMENT, whole);
    if (!thing) {
        shd_budget_give(store->budget, whole);
        return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    }
    *thing = (shd_stored){.store = store, .digest = *digest, .bytes = whole, .holders = 1};
    *out = thing;
    return SHD_OK;
}

void *shd_stored_bytes(const shd_stored *thing) {
    return (unsigned char *)(uintptr_t)thing + HEAD;
}

size_t shd_stored_size(const shd_stored *thing) {
    return thing->bytes;
}

void shd_stored_drop(shd_stored *thing) {
    if (!thing) return;
    shd_store *store = thing->store;
    pthread_mutex_lock(&store->mutex);
    const bool last = --thing->holders == 0;
    if (last && thing->was_kept) count_bytes(store, 0, -(ptrdiff_t)thing->bytes);
    pthread_mutex_unlock(&store->mutex);
    if (last) free_thing(thing);
}

shd_status shd_store_put(shd_store *store, shd_stored *thing, const char *name, bool *known,
                         shd_error *error) {
    const size_t most = store->load.cap / SHARE;
    if (thing->bytes > most)
        return shd_fail(error, SHD_LIMIT, "",
                        "it takes %zu bytes; half of the limit `mesh-store` is %zu", thing->bytes,
                        most);
    client *fresh = calloc(1, sizeof *fresh);
    if (!fresh) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    strncpy(fresh->name, name, sizeof fresh->name - 1);
    pthread_mutex_lock(&store->mutex);
    shd_stored *there = find_thing(store, &thing->digest), *freed = NULL;
    if (!there) {
        client *c = find_client(store, name);
        if (!c) {
            c = fresh;
            c->next = store->clients;
            if (c->next) c->next->previous = c;
            store->clients = c;
            fresh = NULL;
        }
        thing->was_kept = true;
        keep_thing(store, thing, c);
        freed = make_room(store, store->load.cap, thing);
    }
    pthread_mutex_unlock(&store->mutex);
    free(fresh);
    free_list(freed);
    *known = there;
    return SHD_OK;
}

shd_stored *shd_store_find(shd_store *store, const shd_digest *digest) {
    pthread_mutex_lock(&store->mutex);
    shd_stored *thing = find_thing(store, digest);
    if (thing) {
        thing->holders++;
        unlink_use(thing);
        link_newest(thing);
    }
    (*(thing ? &store->load.hits : &store->load.misses))++;
    pthread_mutex_unlock(&store->mutex);
    return thing;
}

size_t shd_store_shrink(shd_store *store, size_t bytes) {
    pthread_mutex_lock(&store->mutex);
    shd_stored *freed = make_room(store, bytes, NULL);
    pthread_mutex_unlock(&store->mutex);
    return free_list(freed);
}

size_t shd_store_trim(shd_store *store, size_t bytes) {
    pthread_mutex_lock(&store->mutex);
    const size_t kept = store->load.bytes;
    shd_stored *freed = make_room(store, kept > bytes ? kept - bytes : 0, NULL);
    pthread_mutex_unlock(&store->mutex);
    return free_list(freed);
}

shd_store_load shd_store_load_of(shd_store *store) {
    pthread_mutex_lock(&store->mutex);
    const shd_store_load load = store->load;
    pthread_mutex_unlock(&store->mutex);
    return load;
}

shd_status shd_store_new(size_t cap, shd_budget *budget, shd_store **out, shd_error *error) {
    shd_store *store = calloc(1, sizeof *store);
    if (!store) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    if (getrandom(&store->seed, sizeof store->seed, 0) != (ssize_t)sizeof store->seed) {
        free(store);
        return shd_fail(error, SHD_INTERNAL, "", "the system gives no random numbers");
    }
    pthread_mutex_init(&store->mutex, NULL);
    store->load.cap = cap;
    store->budget = budget;
    *out = store;
    return SHD_OK;
}

void shd_store_drop(shd_store *store) {
    if (!store) return;
    shd_store_shrink(store, 0);
    pthread_mutex_destroy(&store->mutex);
    free(store);
}
