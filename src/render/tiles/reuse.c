#include "render/tiles/reuse.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "base/stock.h"

enum { ALIGNMENT = 64 };

typedef struct piece {
    struct piece *next;
    size_t size, used;
} piece;

struct shd_record {
    shd_reuse *reuse;
    shd_record_kind kind;
    shd_reuse_key key;
    unsigned users; /* and one more while it is published */
    bool failed;
    piece *pieces;
    size_t bytes;
    struct shd_record *newer, *older; /* published ones, by last use */
    size_t tile_count;
    void *tiles[];
};

struct shd_reuse {
    pthread_mutex_t mutex;
    size_t cap, bytes; /* bytes: all pieces of records, published or not */
    shd_stock *stock;
    shd_record *newest, *oldest;
    shd_reuse_load stats;
};

shd_reuse *shd_reuse_new(size_t cap, shd_budget *budget) {
    shd_reuse *reuse = calloc(1, sizeof *reuse);
    if (!reuse) return NULL;
    reuse->cap = cap;
    reuse->stock = shd_stock_new(cap, budget);
    if (!reuse->stock) {
        free(reuse);
        return NULL;
    }
    pthread_mutex_init(&reuse->mutex, NULL);
    return reuse;
}

static void unlink_record(shd_reuse *reuse, shd_record *r) {
    *(r->newer ? &r->newer->older : &reuse->newest) = r->older;
    *(r->older ? &r->older->newer : &reuse->oldest) = r->newer;
    r->newer = r->older = NULL;
}

static void link_newest(shd_reuse *reuse, shd_record *r) {
    r->older = reuse->newest;
    r->newer = NULL;
    *(reuse->newest ? &reuse->newest->newer : &reuse->oldest) = r;
    reuse->newest = r;
}

/* Their callers hold the mutex. */

static void forget_record(shd_record *r) {
    shd_reuse *reuse = r->reuse;
    while (r->pieces) {
        piece *p = r->pieces;
        r->pieces = p->next;
        shd_stock_give(reuse->stock, p, p->size);
    }
    reuse->bytes -= r->bytes;
    free(r);
}

static void release_record(shd_record *r) {
    if (--r->users == 0) forget_record(r);
}

static void unpublish_record(shd_record *r) {
    unlink_record(r->reuse, r);
    release_record(r);
}

/* Forgets the oldest record that nobody uses. False: there is none. */
static bool forget_oldest(shd_reuse *reuse) {
    shd_record *r = reuse->oldest;
    while (r && r->users > 1) r = r->newer;
    if (r) unpublish_record(r);
    return r;
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
    size_t whole = need > r->bytes / 4 ? need : r->bytes / 4;
    whole = whole < SHD_STOCK_MOST ? (whole + unit - 1) / unit * unit : SHD_STOCK_MOST;
    /* No record takes more than half of what may be kept. */
    if (need > whole || r->bytes + whole > reuse->cap / 2) return NULL;
    piece *p = take_piece(reuse, whole);
    if (!p) return NULL;
    *p = (piece){r->pieces, whole, ALIGNMENT};
    r->pieces = p;
    r->bytes += whole;
    reuse->bytes += whole;
    return p;
}

static shd_record *find_record(shd_reuse *reuse, shd_record_kind kind, shd_reuse_key key) {
    for (shd_record *r = reuse->newest; r; r = r->older)
        if (r->kind == kind && r->key.low == key.low && r->key.high == key.high) return r;
    return NULL;
}

/* ---- ---- */

void shd_reuse_drop(shd_reuse *reuse) {
    if (!reuse) return;
    while (reuse->newest) unpublish_record(reuse->newest);
    shd_stock_drop(reuse->stock);
    pthread_mutex_destroy(&reuse->mutex);
    free(reuse);
}

shd_record *shd_reuse_find(shd_reuse *reuse, shd_record_kind kind, shd_reuse_key key) {
    if (!reuse->cap) return NULL;
    pthread_mutex_lock(&reuse->mutex);
    shd_record *r = find_record(reuse, kind, key);
    if (r) {
        r->users++;
        unlink_record(reuse, r);
        link_newest(reuse, r);
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
    r->kind = kind;
    r->key = key;
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
    if (!r->failed && r->bytes && !find_record(reuse, r->kind, r->key)) {
        r->users++;
        link_newest(reuse, r);
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
