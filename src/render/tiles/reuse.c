#include "render/tiles/reuse.h"

#include <pthread.h>
#include <stdlib.h>

#include "base/lru.h"
#include "base/stock.h"

enum { ALIGNMENT = 64, RECORDS = 1024 };

typedef struct piece {
    struct piece *next;
    size_t size, used;
} piece;

struct shd_record {
    shd_use use; /* of published ones */
    shd_key key;
    shd_reuse_key digest;
    shd_reuse *reuse;
    unsigned users; /* and one more while it is published */
    bool failed;
    piece *pieces;
    size_t tile_count;
    void *tiles[];
};

struct shd_reuse {
    pthread_mutex_t mutex;
    size_t cap, bytes; /* bytes: all pieces of records, published or not */
    shd_stock *stock;
    shd_lru published;
    shd_index index;
    shd_reuse_load stats;
};

shd_status shd_reuse_new(size_t cap, shd_budget *budget, shd_reuse **out, shd_error *error) {
    shd_reuse *reuse = calloc(1, sizeof *reuse);
    if (!reuse) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    pthread_mutex_init(&reuse->mutex, NULL);
    reuse->cap = cap;
    reuse->stock = shd_stock_new(cap, budget);
    const shd_status status = reuse->stock ? shd_index_new(RECORDS, &reuse->index, error)
                                           : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    if (status == SHD_OK)
        *out = reuse;
    else
        shd_reuse_drop(reuse);
    return status;
}

static shd_key key_of(const shd_reuse *reuse, shd_record_kind kind, const shd_reuse_key *key) {
    return shd_index_key(&reuse->index, kind, key, sizeof *key);
}

/* Their callers hold the mutex. */

static void forget_record(shd_record *r) {
    shd_reuse *reuse = r->reuse;
    while (r->pieces) {
        piece *p = r->pieces;
        r->pieces = p->next;
        shd_stock_give(reuse->stock, p, p->size);
    }
    reuse->bytes -= r->use.bytes;
    free(r);
}

static void release_record(shd_record *r) {
    if (--r->users == 0) forget_record(r);
}

/* Forgets the oldest record that nobody uses. False: there is none. */
static bool forget_oldest(shd_reuse *reuse) {
    shd_record *r = (shd_record *)reuse->published.oldest;
    while (r && r->users > 1) r = (shd_record *)r->use.newer;
    if (!r) return false;
    shd_index_take(&reuse->index, &r->key);
    shd_lru_take(&reuse->published, &r->use);
    release_record(r);
    return true;
}

/* A piece of memory, for which the oldest records are forgotten. NULL: what is in use fills the
 * cap. */
static piece *take_piece(shd_reuse *reuse, size_t size) {
    piece *p = shd_stock_take(reuse->stock, size);
    while (!p && forget_oldest(reuse)) p = shd_stock_take(reuse->stock, size);
    return p;
}

/* Gives the record a piece with room for `size` bytes and for a quarter of what it has, so that a
 * small picture keeps little more than it uses. */
static piece *add_piece(shd_record *r, size_t size) {
    shd_reuse *reuse = r->reuse;
    const size_t unit = SHD_STOCK_UNIT, need = ALIGNMENT + size;
    size_t whole = need > r->use.bytes / 4 ? need : r->use.bytes / 4;
    whole = whole < SHD_STOCK_MOST ? (whole + unit - 1) / unit * unit : SHD_STOCK_MOST;
    /* No record takes more than half of what may be kept. */
    if (need > whole || r->use.bytes + whole > reuse->cap / 2) return NULL;
    piece *p = take_piece(reuse, whole);
    if (!p) return NULL;
    *p = (piece){r->pieces, whole, ALIGNMENT};
    r->pieces = p;
    r->use.bytes += whole;
    reuse->bytes += whole;
    return p;
}

/* ---- ---- */

void shd_reuse_drop(shd_reuse *reuse) {
    if (!reuse) return;
    while (forget_oldest(reuse)) {
    }
    shd_index_drop(&reuse->index);
    shd_stock_drop(reuse->stock);
    pthread_mutex_destroy(&reuse->mutex);
    free(reuse);
}

shd_record *shd_reuse_find(shd_reuse *reuse, shd_record_kind kind, shd_reuse_key key) {
    if (!reuse->cap) return NULL;
    const shd_key sought = key_of(reuse, kind, &key);
    pthread_mutex_lock(&reuse->mutex);
    shd_record *r = shd_index_find(&reuse->index, &sought);
    if (r) {
        r->users++;
        shd_lru_touch(&reuse->published, &r->use);
    }
    if (kind == SHD_RECORD_LIGHT)
        *(r ? &reuse->stats.light_hits : &reuse->stats.light_misses) += 1;
    else
        *(r ? &reuse->stats.geometry_hits : &reuse->stats.geometry_misses) += 1;
    pthread_mutex_unlock(&reuse->mutex);
    return r;
}

shd_record *shd_record_new(shd_reuse *reuse, shd_record_kind kind, shd_reuse_key key,
                           size_t tile_count) {
    if (!reuse->cap) return NULL;
    shd_record *r = calloc(1, sizeof *r + tile_count * sizeof *r->tiles);
    if (!r) return NULL;
    r->reuse = reuse;
    r->digest = key;
    r->key = key_of(reuse, kind, &r->digest);
    r->users = 1;
    r->tile_count = tile_count;
    return r;
}

void *shd_record_alloc(shd_record *r, size_t size) {
    shd_reuse *reuse = r->reuse;
    size = (size + ALIGNMENT - 1) / ALIGNMENT * ALIGNMENT;
    pthread_mutex_lock(&reuse->mutex);
    piece *p = r->failed ? NULL : r->pieces;
    if (!r->failed && (!p || size > p->size - p->used)) p = add_piece(r, size);
    r->failed = !p;
    void *memory = NULL;
    if (p) {
        memory = (char *)p + p->used;
        p->used += size;
    }
    pthread_mutex_unlock(&reuse->mutex);
    return memory;
}

void shd_record_put(shd_record *record, size_t tile, void *content) {
    record->tiles[tile] = content;
}

const void *shd_record_get(const shd_record *record, size_t tile) {
    return record->tiles[tile];
}

void shd_record_publish(shd_record *r) {
    shd_reuse *reuse = r->reuse;
    pthread_mutex_lock(&reuse->mutex);
    /* Another request may have been faster. If nothing is seen there is nothing to keep. */
    if (!r->failed && r->use.bytes && !shd_index_find(&reuse->index, &r->key)) {
        r->users++;
        shd_index_put(&reuse->index, &r->key, r);
        shd_lru_put(&reuse->published, &r->use);
    }
    pthread_mutex_unlock(&reuse->mutex);
}

void shd_record_drop(shd_record *r) {
    if (!r) return;
    pthread_mutex_t *mutex = &r->reuse->mutex;
    pthread_mutex_lock(mutex);
    release_record(r);
    pthread_mutex_unlock(mutex);
}

size_t shd_reuse_trim(shd_reuse *reuse, size_t bytes) {
    pthread_mutex_lock(&reuse->mutex);
    size_t given = shd_stock_trim(reuse->stock, bytes);
    while (given < bytes && forget_oldest(reuse))
        given += shd_stock_trim(reuse->stock, bytes - given);
    pthread_mutex_unlock(&reuse->mutex);
    return given;
}

bool shd_reuse_touch(shd_reuse *reuse) {
    return shd_stock_touch(reuse->stock);
}

shd_reuse_load shd_reuse_load_of(shd_reuse *reuse) {
    pthread_mutex_lock(&reuse->mutex);
    shd_reuse_load stats = reuse->stats;
    stats.bytes = reuse->bytes;
    stats.cap = reuse->cap;
    pthread_mutex_unlock(&reuse->mutex);
    return stats;
}
