/* What clients have put here to be named by its digest: kept in memory, under a cap.
 *
 * A thing is one block of bytes, constant once it is kept. It lives while it is kept or somebody
 * holds it: what is forgotten while a picture is made from it is freed when the picture is done.
 * For lack of room the client that has most of the store loses, of its things, the one that was
 * used the longest ago; never the thing that was put last, which takes half of the cap at most. So
 * nobody can fill the store but at their own expense. Any thread. */
#ifndef SHD_ASSETS_STORE_H
#define SHD_ASSETS_STORE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/budget.h"
#include "base/digest.h"
#include "base/status.h"

typedef struct shd_store shd_store;
typedef struct shd_stored shd_stored;

/* `cap` bytes at most are kept; 0: nothing is. All bytes come from the budget, which outlives it.
 */
shd_status shd_store_new(size_t cap, shd_budget *budget, shd_store **out, shd_error *error);
void shd_store_drop(shd_store *store); /* nobody holds anything any more; NULL is fine */

/* A thing that is not kept yet, of `bytes` bytes that the caller fills, aligned to 64, and holds.
 * SHD_CROWDED where the budget has not as many, SHD_EXHAUSTED. */
shd_status shd_stored_new(shd_store *store, const shd_digest *digest, size_t bytes,
                          shd_stored **out, shd_error *error);

void *shd_stored_bytes(const shd_stored *thing);
size_t shd_stored_size(const shd_stored *thing); /* all that it takes of the cap */
void shd_stored_drop(shd_stored *thing);         /* holds it no longer; NULL is fine */

/* Keeps a thing for a client, by any word for it up to SHD_STORE_CLIENT - 1 bytes, longer ones cut.
 * The caller still drops it. SHD_LIMIT where it is more than half of the cap, and SHD_EXHAUSTED.
 * `known`: something was kept by that digest already, and stays. */
enum { SHD_STORE_CLIENT = 64 };
shd_status shd_store_put(shd_store *store, shd_stored *thing, const char *client, bool *known,
                         shd_error *error);

/* What is kept by a digest, to be dropped by the caller; it is the last that is forgotten then.
 * NULL: there is nothing. Counts. */
shd_stored *shd_store_find(shd_store *store, const shd_digest *digest);

/* Forgets until `bytes` bytes at most are kept. Returns how many were given back to the budget:
 * those of what nobody holds. */
size_t shd_store_shrink(shd_store *store, size_t bytes);

/* The same until `bytes` fewer are kept. */
size_t shd_store_trim(shd_store *store, size_t bytes);

typedef struct shd_store_load {
    size_t cap, bytes, things; /* what is kept */
    size_t held;               /* bytes that are forgotten and that somebody still holds */
    uint64_t hits, misses, evictions;
} shd_store_load;

shd_store_load shd_store_load_of(shd_store *store);

#endif
