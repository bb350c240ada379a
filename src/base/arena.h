/* A capped memory arena: everything that a request allocates lives here and goes at once.
 *
 * Allocations are aligned to 64 bytes (a cache line, and the widest vector). They are NULL if the
 * cap, an overflow of count * size, the budget or the system refuses them, which callers turn into
 * SHD_MEMORY. One thread at a time may allocate; the memory itself may be shared. Under
 * AddressSanitizer unused arena bytes are poisoned. */
#pragma once

#include "base/spares.h"
#include "base/status.h"

typedef struct shd_arena shd_arena;

/* `cap` is the largest total in bytes, block overhead included. NULL if there is no memory. */
shd_arena *shd_arena_new(size_t cap);

/* Blocks come from `spares`, which outlives the arena, and go back there. New ones are taken from
 * the budget of `spares`, if it gives them within five seconds. */
shd_arena *shd_arena_new_from(shd_spares *spares, size_t cap);

/* A cap that is lower. Before anything is allocated. */
void shd_arena_hold(shd_arena *arena, size_t cap);

void shd_arena_drop(shd_arena *arena); /* NULL is fine */

/* Uninitialized and zeroed memory for `count` items of `size` bytes. Not NULL for count 0. */
void *shd_arena_alloc(shd_arena *arena, size_t count, size_t size);
void *shd_arena_zalloc(shd_arena *arena, size_t count, size_t size);

/* Bytes of a block that such an allocation takes. 0: more than there can be. */
size_t shd_arena_size(size_t count, size_t size);

/* Copies; NULL if memory is short. */
char *shd_arena_strdup(shd_arena *arena, const char *text);
char *shd_arena_printf(shd_arena *arena, const char *format, ...) SHD_PRINTF(2, 3);

/* Has the budget keep `bytes` ready, which the arena will take. False: it does not have as many. */
bool shd_arena_reserve(shd_arena *arena, size_t bytes);

/* Counts memory that others allocate for the arena's sake as if it were the arena's, until it is
 * repaid. False: the cap or the budget does not have it. */
bool shd_arena_borrow(shd_arena *arena, size_t bytes);
bool shd_arena_try_borrow(shd_arena *arena,
                          size_t bytes); /* what is free, for work may do without */
void shd_arena_repay(shd_arena *arena, size_t bytes);

/* Counts borrowed memory no longer: the caller gives it later to the budget that is returned. */
shd_budget *shd_arena_release(shd_arena *arena, size_t bytes);

/* Returning to a mark frees all that was allocated after it, and ends the marks made after it. */
typedef struct shd_arena_mark {
    void *block;
    size_t used;
} shd_arena_mark;

shd_arena_mark shd_arena_mark_here(const shd_arena *arena);
void shd_arena_return(shd_arena *arena, shd_arena_mark mark);

bool shd_arena_full(const shd_arena *arena);    /* the cap, or an overflow, has refused some */
bool shd_arena_crowded(const shd_arena *arena); /* the budget has */
size_t shd_arena_room(const shd_arena *arena);  /* bytes that the cap leaves */
size_t shd_arena_used(const shd_arena *arena);  /* bytes of its blocks */
size_t shd_arena_peak(const shd_arena *arena);  /* the most that blocks and loans were */
