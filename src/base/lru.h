/* What caches are made of: an order by last use, and an index that finds things by their keys.
 *
 * The links of both are members of the things. Nothing here owns or allocates a thing, or locks. */
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "base/status.h"

/* A thing's place in an order. As the thing's first member, it is found at the thing's address. */
typedef struct shd_use {
    struct shd_use *newer, *older;
    size_t bytes; /* of the thing; they stay as many while it is in an order */
} shd_use;

/* Things by their last use. All zero is an empty order. */
typedef struct shd_lru {
    shd_use *newest, *oldest;
    size_t bytes, count; /* of all its things */
} shd_lru;

void shd_lru_put(shd_lru *lru, shd_use *use); /* as the newest */
void shd_lru_take(shd_lru *lru, shd_use *use);
shd_use *shd_lru_pop(shd_lru *lru);             /* takes the oldest; NULL: it is empty */
void shd_lru_touch(shd_lru *lru, shd_use *use); /* makes it the newest */

/* What a thing is found by: some bytes, and their kind. */
typedef struct shd_key {
    struct shd_key *next; /* in the same bucket */
    void *thing;
    uint64_t kind, hash;
    void *bytes; /* stay where they are while the key is in an index */
    size_t size;
} shd_key;

typedef struct shd_index {
    shd_key **buckets;
    size_t count;  /* a power of two */
    uint64_t seed; /* random: nobody can choose bytes that share a bucket */
} shd_index;

/* An index for about as many `things`. SHD_EXHAUSTED; SHD_INTERNAL: there are no random numbers. */
shd_status shd_index_new(size_t things, shd_index *out, shd_error *error);
void shd_index_drop(shd_index *index); /* all zero is fine */

/* The key of `size` bytes. Any thread, whatever others do with the index. */
shd_key shd_index_key(const shd_index *index, uint64_t kind, const void *bytes, size_t size);

/* The thing that has the same key, or NULL. */
void *shd_index_find(const shd_index *index, const shd_key *key);

void shd_index_put(shd_index *index, shd_key *key, void *thing);
void shd_index_take(shd_index *index, shd_key *key);
