/* A capped memory arena: everything a request allocates lives here and goes at once.
 *
 * Allocations are aligned to 64 bytes (a cache line, and the widest vector). Going over the cap,
 * overflowing count * size, or running out of system memory gives NULL, which callers turn into
 * SHD_MEMORY; shd_arena_full and shd_arena_crowded tell which it was. One thread at a time may
 * allocate; the memory itself may be shared. Under AddressSanitizer unused arena bytes are
 * poisoned. */
#ifndef SHD_BASE_ARENA_H
#define SHD_BASE_ARENA_H

#include <stdbool.h>
#include <stddef.h>

#include "base/spares.h"
#include "base/status.h"

typedef struct shd_arena shd_arena;

/* `cap` is the largest total in bytes, block overhead included. NULL when out of memory. */
shd_arena *shd_arena_new(size_t cap);

/* Blocks come from `spares`, which outlives the arena, and go back there. What is kept changes
 * nothing about the cap. New ones are taken from the budget of `spares`, where that gives them
 * within two seconds. */
shd_arena *shd_arena_new_from(shd_spares *spares, size_t cap);

void shd_arena_drop(shd_arena *arena); /* NULL is fine */

/* Uninitialized and zeroed memory for `count` items of `size` bytes; never NULL for count 0. */
void *shd_arena_alloc(shd_arena *arena, size_t count, size_t size);
void *shd_arena_zalloc(shd_arena *arena, size_t count, size_t size);

/* Copies; NULL where memory is short. */
char *shd_arena_strdup(shd_arena *arena, const char *text);
char *shd_arena_printf(shd_arena *arena, const char *format, ...) SHD_PRINTF(2, 3);

/* Has the budget keep ready what the arena will take, `bytes` of it. False: it has not as many. */
bool shd_arena_reserve(shd_arena *arena, size_t bytes);

/* Memory that others allocate for the arena's sake counts as if it were the arena's, until it is
 * repaid. False: the cap or the budget does not have it. */
bool shd_arena_borrow(shd_arena *arena, size_t bytes);
void shd_arena_repay(shd_arena *arena, size_t bytes);

/* The same for memory that outlives the arena: the caller gives it to the budget later. */
void shd_arena_release(shd_arena *arena, size_t bytes);

/* All that is allocated after a mark goes when it is returned to; marks that were made after it
 * are gone, too. */
typedef struct shd_arena_mark {
    void *block;
    size_t used;
} shd_arena_mark;

shd_arena_mark shd_arena_mark_here(const shd_arena *arena);
void shd_arena_return(shd_arena *arena, shd_arena_mark mark);

/* Whether the cap, or an overflow, has refused an allocation; the system may have as well. */
bool shd_arena_full(const shd_arena *arena);

/* Whether the budget has refused something. */
bool shd_arena_crowded(const shd_arena *arena);

size_t shd_arena_room(const shd_arena *arena); /* bytes that the cap leaves */
size_t shd_arena_used(const shd_arena *arena); /* bytes of its blocks */
size_t shd_arena_peak(const shd_arena *arena); /* the most that those and what is borrowed were */

#endif
