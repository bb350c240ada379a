/* What clients have put here to be named by its digest. It is kept in memory, under a cap.
 *
 * A thing is one block of bytes, constant once it is kept. It lives while it is kept or somebody
 * holds it: a thing that is forgotten while a picture is made from it is freed when the picture is
 * done. If room is short, the client that has most of the store loses the thing that it used the
 * longest ago. The thing that was put last is never lost, and takes half of the cap at most. So
 * nobody can fill the store but at their own expense. Any thread. */
#pragma once

#include "base/budget.h"
#include "base/digest.h"
#include "base/status.h"

typedef struct shd_store shd_store;
typedef struct shd_stored shd_stored;

/* `cap` bytes at most are kept; with 0 nothing is. All bytes come from the budget, which outlives
 * the store. */
shd_status shd_store_new(size_t cap, shd_budget *budget, shd_store **out, shd_error *error);
void shd_store_drop(shd_store *store); /* nobody may hold anything any more; NULL is fine */

/* What a thing is. A digest names one of each kind, and none of them for another. */
typedef enum shd_thing {
    SHD_THING_MESH,
    SHD_THING_SCENE,
    SHD_THING_TABLE,
    SHD_THING_ASSET,  /* a picture's samples as its file has them */
    SHD_THING_TEXELS, /* a picture converted for one use; the digest is of the use, too */
    SHD_THING_LEVELS  /* smaller ones of that (base/pyramid.h); by the same digest */
} shd_thing;

/* A thing that is not kept yet. The caller holds it, and fills its `bytes` bytes, which are aligned
 * to 64. SHD_CROWDED if the budget does not have as many, SHD_EXHAUSTED if the system does not. */
shd_status shd_stored_new(shd_store *store, shd_thing kind, const shd_digest *digest, size_t bytes,
                          shd_stored **out, shd_error *error);

void *shd_stored_bytes(const shd_stored *thing);
size_t shd_stored_size(const shd_stored *thing); /* all bytes that it takes of the cap */
void shd_stored_drop(shd_stored *thing);         /* ends a hold; NULL is fine */

/* Whether a thing of so many bytes is ever kept: SHD_LIMIT if it is more than half of the cap. */
shd_status shd_store_admit(const shd_store *store, size_t bytes, shd_error *error);

/* Keeps a thing for a client. `client` is any word for it up to SHD_STORE_CLIENT - 1 bytes; longer
 * ones are cut. The caller still drops the thing. SHD_LIMIT if it is more than half of the cap;
 * SHD_EXHAUSTED. `known`: a thing of its kind was kept by that digest already, and stays. */
enum { SHD_STORE_CLIENT = 64 };
shd_status shd_store_put(shd_store *store, shd_stored *thing, const char *client, bool *known,
                         shd_error *error);

/* The thing of a kind that is kept by a digest, which the caller drops. It becomes the last one to
 * be forgotten. NULL: there is none. Counts hits and misses. */
shd_stored *shd_store_find(shd_store *store, shd_thing kind, const shd_digest *digest);

/* Forgets things until `bytes` bytes at most are kept. Returns how many bytes were given back to
 * the budget: those of things that nobody holds. */
size_t shd_store_shrink(shd_store *store, size_t bytes);

typedef struct shd_store_load {
    size_t cap, bytes, things; /* what is kept */
    size_t held;               /* forgotten bytes that somebody still holds */
    uint64_t hits, misses, evictions;
} shd_store_load;

shd_store_load shd_store_load_of(shd_store *store);
