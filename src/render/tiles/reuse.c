#include "render/tiles/reuse.h"

#include <assert.h>
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
    shd_stock *stock;
    shd_lru published;
    shd_index index;
    shd_reuse_load load; /* bytes: all pieces of records, published or not */
};

shd_status shd_reuse_new(size_t cap, shd_budget *budget, shd_reuse **out, shd_error *error) {
    shd_reuse *reuse = calloc(1, sizeof *reuse);
    if (!reuse) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    pthread_mutex_init(&reuse->mutex, NULL);
    reuse->load.cap = cap;
    reuse->stock = shd_stock_new(cap, budget);
    const shd_status status = reuse->stock ? shd_index_new(RECORDS, &reuse->index, error)
                                           : shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    if (status == SHD_OK)
        *out = reuse;
    else
        shd_reuse_drop(reuse);
    return status;
}

/* ---- The mutex is held. ---- */

static void release_record(shd_record *r) {
    shd_reuse *reuse = r->reuse;
    assert(r->users > 0);
    if (--r->users) return;
    while (r->pieces) {
        piece *p = r->pieces;
        r->pieces = p->next;
        shd_stock_give(reuse->stock, p, p->size);
    }
    reuse->load.bytes -= r->use.bytes;
    free(r);
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

/* Gives the record a piece with room for `size` bytes and for a quarter of what it has, so that a
 * small picture keeps little more than it uses. The oldest records are forgotten for it. NULL: the
 * record is too large, or what is in use fills the cap. */
static piece *add_piece(shd_record *r, size_t size) {
    shd_reuse *reuse = r->reuse;
    const size_t unit = SHD_STOCK_UNIT, need = ALIGNMENT + size;
    size_t whole = need > r->use.bytes / 4 ? need : r->use.bytes / 4;
    whole = whole < SHD_STOCK_MOST ? (whole + unit - 1) / unit * unit : SHD_STOCK_MOST;
    /* No record takes more than half of what may be kept. */
    if (need > whole || r->use.bytes + whole > reuse->load.cap / 2) return NULL;
    piece *p = shd_stock_take(reuse->stock, whole);
    while (!p && forget_oldest(reuse)) p = shd_stock_take(reuse->stock, whole);
    if (!p) return NULL;
    *p = (piece){r->pieces, whole, ALIGNMENT};
    r->pieces = p;
    r->use.bytes += whole;
    reuse->load.bytes += whole;
    return p;
}

/* ---- Any thread. ---- */

void shd_reuse_drop(shd_reuse *reuse) {
    if (!reuse) return;
    while (forget_oldest(reuse)) {
    }
    assert(!reuse->load.bytes);
    shd_index_drop(&reuse->index);
    shd_stock_drop(reuse->stock);
    pthread_mutex_destroy(&reuse->mutex);
    free(reuse);
}

bool shd_reuse_keeps(const shd_reuse *reuse) {
    return reuse->load.cap > 0;
}

shd_record *shd_reuse_find(shd_reuse *reuse, shd_record_kind kind, shd_reuse_key key) {
    if (!reuse->load.cap) return NULL;
    const shd_key sought = shd_index_key(&reuse->index, kind, &key, sizeof key);
    pthread_mutex_lock(&reuse->mutex);
    shd_record *r = shd_index_find(&reuse->index, &sought);
    if (r) {
        r->users++;
        shd_lru_touch(&reuse->published, &r->use);
    }
    shd_reuse_load *load = &reuse->load;
    if (kind == SHD_RECORD_LIGHT)
        ++*(r ? &load->light_hits : &load->light_misses);
    else
        ++*(r ? &load->geometry_hits : &load->geometry_misses);
    pthread_mutex_unlock(&reuse->mutex);
    return r;
}

shd_record *shd_record_new(shd_reuse *reuse, shd_record_kind kind, shd_reuse_key key,
                           size_t tile_count) {
    if (!reuse->load.cap) return NULL;
    shd_record *r = calloc(1, sizeof *r + tile_count * sizeof *r->tiles);
    if (!r) return NULL;
    r->reuse = reuse;
    r->digest = key;
    r->key = shd_index_key(&reuse->index, kind, &r->digest, sizeof r->digest);
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
    if (p) p->used += size;
    void *memory = p ? (char *)p + p->used - size : NULL;
    pthread_mutex_unlock(&reuse->mutex);
    return memory;
}

void shd_record_put(shd_record *record, size_t tile, void *content) {
    assert(tile < record->tile_count);
    record->tiles[tile] = content;
}

const void *shd_record_get(const shd_record *record, size_t tile) {
    assert(tile < record->tile_count);
    return record->tiles[tile];
}

void shd_record_publish(shd_record *r) {
    shd_reuse *reuse = r->reuse;
    pthread_mutex_lock(&reuse->mutex);
    assert(r->users == 1);
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

size_t shd_reuse_trim(void *context, size_t bytes) {
    shd_reuse *reuse = context;
    pthread_mutex_lock(&reuse->mutex);
    size_t given = shd_stock_trim(reuse->stock, bytes);
    while (given < bytes && forget_oldest(reuse))
        given += shd_stock_trim(reuse->stock, bytes - given);
    pthread_mutex_unlock(&reuse->mutex);
    return given;
}

bool shd_reuse_touch(void *reuse) {
    return shd_stock_touch(((shd_reuse *)reuse)->stock);
}

shd_reuse_load shd_reuse_load_of(shd_reuse *reuse) {
    pthread_mutex_lock(&reuse->mutex);
    const shd_reuse_load load = reuse->load;
    pthread_mutex_unlock(&reuse->mutex);
    return load;
}
