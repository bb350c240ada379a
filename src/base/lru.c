#include "base/lru.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <xxhash.h>

void shd_lru_put(shd_lru *lru, shd_use *use) {
    assert(!lru->newest == !lru->oldest && !lru->newest == !lru->count);
    use->newer = NULL;
    use->older = lru->newest;
    *(lru->newest ? &lru->newest->newer : &lru->oldest) = use;
    lru->newest = use;
    lru->bytes += use->bytes;
    lru->count++;
}

void shd_lru_take(shd_lru *lru, shd_use *use) {
    assert(lru->count > 0 && lru->bytes >= use->bytes);
    *(use->newer ? &use->newer->older : &lru->newest) = use->older;
    *(use->older ? &use->older->newer : &lru->oldest) = use->newer;
    lru->bytes -= use->bytes;
    lru->count--;
}

shd_use *shd_lru_pop(shd_lru *lru) {
    shd_use *use = lru->oldest;
    if (use) shd_lru_take(lru, use);
    return use;
}

void shd_lru_touch(shd_lru *lru, shd_use *use) {
    shd_lru_take(lru, use);
    shd_lru_put(lru, use);
}

shd_status shd_index_new(size_t things, shd_index *out, shd_error *error) {
    enum { MOST = 1 << 20 };
    shd_index index = {.count = 1};
    while (index.count < things && index.count < MOST) index.count *= 2;
    if (getrandom(&index.seed, sizeof index.seed, 0) != (ssize_t)sizeof index.seed)
        return shd_fail(error, SHD_INTERNAL, "", "the system gives no random numbers");
    index.buckets = calloc(index.count, sizeof(shd_key *));
    if (!index.buckets) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    *out = index;
    return SHD_OK;
}

void shd_index_drop(shd_index *index) {
    free(index->buckets);
}

shd_key shd_index_key(const shd_index *index, uint64_t kind, const void *bytes, size_t size) {
    const uint64_t hash = XXH3_64bits_withSeed(bytes, size, index->seed + kind);
    return (shd_key){NULL, NULL, kind, hash, (void *)(uintptr_t)bytes, size};
}

static shd_key **bucket_of(const shd_index *index, const shd_key *key) {
    return &index->buckets[key->hash & (index->count - 1)];
}

void *shd_index_find(const shd_index *index, const shd_key *key) {
    const shd_key *k = *bucket_of(index, key);
    while (k && (k->hash != key->hash || k->kind != key->kind || k->size != key->size ||
                 (k->size && memcmp(k->bytes, key->bytes, k->size))))
        k = k->next;
    return k ? k->thing : NULL;
}

void shd_index_put(shd_index *index, shd_key *key, void *thing) {
    shd_key **bucket = bucket_of(index, key);
    key->thing = thing;
    key->next = *bucket;
    *bucket = key;
}

void shd_index_take(shd_index *index, shd_key *key) {
    shd_key **at = bucket_of(index, key);
    while (*at != key) at = &(*at)->next;
    *at = key->next;
}
