#include "assets/store.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/lru.h"

enum { ALIGNMENT = 64, THINGS = 4096, SHARE = 2 /* one client may have 1/SHARE of the cap */ };

typedef struct client {
    struct client *next;
    shd_lru things; /* there is at least one */
    char name[SHD_STORE_CLIENT];
} client;

struct shd_stored {
    shd_use use; /* of its client's things */
    shd_key key;
    shd_store *store;
    shd_digest digest;
    unsigned holders; /* one more while it is kept */
    client *client;   /* NULL: the thing is not kept */
    bool was_kept;
};

static_assert(offsetof(shd_stored, use) == 0, "a thing is where its use is");

/* What stands before a thing's bytes. */
enum { HEAD = (sizeof(shd_stored) + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT };

struct shd_store {
    pthread_mutex_t mutex;
    shd_budget *budget;
    shd_index index; /* by kind and digest */
    client *clients;
    shd_store_load load;
};

static shd_key key_of(const shd_store *store, shd_thing kind, const shd_digest *digest) {
    return shd_index_key(&store->index, kind, digest->bytes, sizeof digest->bytes);
}

/* ---- The mutex is held ---- */

/* The client of a name, made if it is new. NULL: out of memory. */
static client *get_client(shd_store *store, const char *name) {
    client **at = &store->clients;
    while (*at && strncmp((*at)->name, name, sizeof(*at)->name - 1)) at = &(*at)->next;
    if (!*at && (*at = calloc(1, sizeof **at))) strncpy((*at)->name, name, sizeof(*at)->name - 1);
    return *at;
}

static void keep_thing(shd_store *store, shd_stored *thing, client *c) {
    thing->client = c;
    thing->was_kept = true;
    thing->holders++;
    shd_index_put(&store->index, &thing->key, thing);
    shd_lru_put(&c->things, &thing->use);
    store->load.things++;
    store->load.bytes += thing->use.bytes;
}

static void drop_client(shd_store *store, client *c) {
    client **at = &store->clients;
    while (*at != c) at = &(*at)->next;
    *at = c->next;
    free(c);
}

/* Adds the thing to `freed` if nobody holds it. */
static void forget_thing(shd_store *store, shd_stored *thing, shd_lru *freed) {
    client *c = thing->client;
    assert(c && thing->holders && c->things.count && store->load.bytes >= thing->use.bytes);
    shd_index_take(&store->index, &thing->key);
    shd_lru_take(&c->things, &thing->use);
    if (!c->things.count) drop_client(store, c);
    thing->client = NULL;
    store->load.things--;
    store->load.evictions++;
    store->load.bytes -= thing->use.bytes;
    if (--thing->holders)
        store->load.held += thing->use.bytes;
    else
        shd_lru_put(freed, &thing->use);
}

/* The thing to forget next: the oldest one of the client that has most. The thing that was put last
 * is spared; it is its client's oldest only if the client has nothing else. NULL: there is
 * nothing. */
static shd_stored *find_victim(const shd_store *store, const shd_stored *last) {
    const client *most = NULL;
    for (const client *c = store->clients; c; c = c->next)
        if (c->things.oldest != (const shd_use *)last &&
            (!most || c->things.bytes > most->things.bytes))
            most = c;
    return most ? (shd_stored *)most->things.oldest : NULL;
}

/* Returns the things to free, without the mutex. */
static shd_lru make_room(shd_store *store, size_t bytes, const shd_stored *last) {
    shd_lru freed = {0};
    shd_stored *victim;
    while (store->load.bytes > bytes && (victim = find_victim(store, last)))
        forget_thing(store, victim, &freed);
    return freed;
}

/* ---- Any thread ---- */

static void free_things(shd_store *store, shd_lru freed) {
    const size_t bytes = freed.bytes;
    for (shd_use *use; (use = shd_lru_pop(&freed));) free(use);
    shd_budget_give(store->budget, bytes);
}

static size_t whole_of(size_t bytes) {
    return (HEAD + bytes + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
}

static shd_status admit_whole(const shd_store *store, size_t whole, shd_error *error) {
    const size_t most = store->load.cap / SHARE;
    if (whole <= most) return SHD_OK;
    shd_fail(error, SHD_LIMIT, "", "it takes %zu bytes; half of the limit `mesh-store` is %zu",
             whole, most);
    return shd_fail_limit(error, SHD_LIMIT_MESH_STORE);
}

shd_status shd_store_admit(const shd_store *store, size_t bytes, shd_error *error) {
    return admit_whole(store, whole_of(bytes), error);
}

shd_status shd_stored_new(shd_store *store, shd_thing kind, const shd_digest *digest, size_t bytes,
                          shd_stored **out, shd_error *error) {
    assert(bytes <= SIZE_MAX / 2);
    const size_t whole = whole_of(bytes);
    if (!shd_budget_take(store->budget, whole))
        return shd_fail(error, SHD_CROWDED, "", "the process may take no more memory just now");
    shd_stored *thing = aligned_alloc(ALIGNMENT, whole);
    if (!thing) {
        shd_budget_give(store->budget, whole);
        return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    }
    *thing = (shd_stored){.use.bytes = whole, .store = store, .digest = *digest, .holders = 1};
    thing->key = key_of(store, kind, &thing->digest);
    *out = thing;
    return SHD_OK;
}

void *shd_stored_bytes(const shd_stored *thing) {
    return (unsigned char *)(uintptr_t)thing + HEAD;
}

size_t shd_stored_size(const shd_stored *thing) {
    return thing->use.bytes;
}

void shd_stored_drop(shd_stored *thing) {
    if (!thing) return;
    shd_store *store = thing->store;
    shd_lru freed = {0};
    pthread_mutex_lock(&store->mutex);
    assert(thing->holders);
    if (!--thing->holders) {
        if (thing->was_kept) store->load.held -= thing->use.bytes;
        shd_lru_put(&freed, &thing->use);
    }
    pthread_mutex_unlock(&store->mutex);
    free_things(store, freed);
}

shd_status shd_store_put(shd_store *store, shd_stored *thing, const char *name, bool *known,
                         shd_error *error) {
    assert(thing->store == store && !thing->client);
    const shd_status status = admit_whole(store, thing->use.bytes, error);
    if (status != SHD_OK) return status;
    shd_lru freed = {0};
    pthread_mutex_lock(&store->mutex);
    const bool there = shd_index_find(&store->index, &thing->key);
    client *c = there ? NULL : get_client(store, name);
    if (c) {
        keep_thing(store, thing, c);
        freed = make_room(store, store->load.cap, thing);
    }
    pthread_mutex_unlock(&store->mutex);
    if (!there && !c) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    free_things(store, freed);
    *known = there;
    return SHD_OK;
}

shd_stored *shd_store_find(shd_store *store, shd_thing kind, const shd_digest *digest) {
    const shd_key key = key_of(store, kind, digest);
    pthread_mutex_lock(&store->mutex);
    shd_stored *thing = shd_index_find(&store->index, &key);
    if (thing) {
        thing->holders++;
        shd_lru_touch(&thing->client->things, &thing->use);
    }
    (*(thing ? &store->load.hits : &store->load.misses))++;
    pthread_mutex_unlock(&store->mutex);
    return thing;
}

size_t shd_store_shrink(shd_store *store, size_t bytes) {
    pthread_mutex_lock(&store->mutex);
    const shd_lru freed = make_room(store, bytes, NULL);
    pthread_mutex_unlock(&store->mutex);
    free_things(store, freed);
    return freed.bytes;
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
    const shd_status status = shd_index_new(THINGS, &store->index, error);
    if (status != SHD_OK) {
        free(store);
        return status;
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
    assert(!store->clients && !store->load.held);
    shd_index_drop(&store->index);
    pthread_mutex_destroy(&store->mutex);
    free(store);
}
