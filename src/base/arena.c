#include "base/arena.h"

#include <assert.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/poison.h"

enum { ALIGNMENT = 64, FIRST_BLOCK = 64 << 10, LARGEST_BLOCK = 2 << 20 };

typedef struct block {
    struct block *next;
    size_t size; /* usable, after the header */
    size_t used;
} block;

_Static_assert(sizeof(block) <= ALIGNMENT, "a block's header fits into one alignment unit");

/* Seconds that the arena waits for others to give way. */
static const double PATIENCE = 5;

struct shd_arena {
    size_t cap, taken, borrowed, peak;
    size_t reserved; /* bytes of the budget that are kept ready, beside those that were taken */
    bool full, crowded;
    shd_spares *spares; /* NULL: blocks come from the system */
    shd_budget *budget;
    block *blocks; /* newest first */
};

static unsigned char *block_bytes(block *b) {
    return (unsigned char *)b + ALIGNMENT;
}

shd_arena *shd_arena_new_from(shd_spares *spares, size_t cap) {
    shd_arena *arena = malloc(sizeof *arena);
    if (arena)
        *arena = (shd_arena){.cap = cap, .spares = spares, .budget = shd_spares_budget(spares)};
    return arena;
}

shd_arena *shd_arena_new(size_t cap) {
    return shd_arena_new_from(NULL, cap);
}

void shd_arena_hold(shd_arena *arena, size_t cap) {
    arena->cap = cap;
}

void shd_arena_drop(shd_arena *arena) {
    if (!arena) return;
    shd_arena_return(arena, (shd_arena_mark){.block = NULL});
    shd_budget_give(arena->budget, arena->reserved + arena->borrowed);
    free(arena);
}

shd_arena_mark shd_arena_mark_here(const shd_arena *arena) {
    return (shd_arena_mark){arena->blocks, arena->blocks ? arena->blocks->used : 0};
}

void shd_arena_return(shd_arena *arena, shd_arena_mark mark) {
    while (arena->blocks != mark.block) {
        block *b = arena->blocks;
        assert(b && arena->taken >= ALIGNMENT + b->size);
        arena->blocks = b->next;
        arena->taken -= ALIGNMENT + b->size;
        shd_spares_give(arena->spares, b, ALIGNMENT + b->size);
    }
    block *b = arena->blocks;
    if (!b) return;
    b->used = mark.used;
    ASAN_POISON_MEMORY_REGION(block_bytes(b) + b->used, b->size - b->used);
}

/* ---- The budget ---- */

/* Takes bytes of what is reserved, and the rest of the budget. */
static bool draw_budget(shd_arena *arena, size_t bytes) {
    const size_t ready = bytes < arena->reserved ? bytes : arena->reserved;
    if (bytes > ready && !shd_budget_wait(arena->budget, bytes - ready, PATIENCE)) {
        arena->crowded = true;
        return false;
    }
    arena->reserved -= ready;
    return true;
}

bool shd_arena_reserve(shd_arena *arena, size_t bytes) {
    if (bytes <= arena->reserved) return true;
    if (!draw_budget(arena, bytes)) return false;
    arena->reserved += bytes;
    return true;
}

static void note_peak(shd_arena *arena) {
    const size_t all = arena->taken + arena->borrowed;
    if (all > arena->peak) arena->peak = all;
}

bool shd_arena_borrow(shd_arena *arena, size_t bytes) {
    if (bytes > shd_arena_room(arena)) {
        arena->full = true;
        return false;
    }
    if (!draw_budget(arena, bytes)) return false;
    arena->borrowed += bytes;
    note_peak(arena);
    return true;
}

bool shd_arena_try_borrow(shd_arena *arena, size_t bytes) {
    if (bytes > shd_arena_room(arena) || !shd_budget_try(arena->budget, bytes)) return false;
    arena->borrowed += bytes;
    note_peak(arena);
    return true;
}

void shd_arena_repay(shd_arena *arena, size_t bytes) {
    shd_budget_give(shd_arena_release(arena, bytes), bytes);
}

shd_budget *shd_arena_release(shd_arena *arena, size_t bytes) {
    assert(arena->borrowed >= bytes);
    arena->borrowed -= bytes;
    return arena->budget;
}

/* Returns NULL if there is no memory. A spare block is counted already, so as much of what is
 * reserved goes back to the budget. */
static block *get_block(shd_arena *arena, size_t size) {
    const size_t whole = shd_spares_size(size);
    block *b = shd_spares_find(arena->spares, size);
    if (b) {
        const size_t less = whole < arena->reserved ? whole : arena->reserved;
        arena->reserved -= less;
        shd_budget_give(arena->budget, less);
        return b;
    }
    if (!whole || !draw_budget(arena, whole)) return NULL;
    b = shd_spares_make(size);
    if (!b) shd_budget_give(arena->budget, whole);
    return b;
}

/* ---- Blocks ---- */

/* Blocks double so that their number stays small. A request that is larger than that gets a block
 * of its own size, so that a big film does not double the arena. */
static block *add_block(shd_arena *arena, size_t need) {
    size_t size = arena->taken < FIRST_BLOCK ? FIRST_BLOCK : arena->taken;
    const size_t room = shd_arena_room(arena) / ALIGNMENT * ALIGNMENT;
    if (room <= need) { /* the header takes a unit */
        arena->full = true;
        return NULL;
    }
    if (size > LARGEST_BLOCK) size = LARGEST_BLOCK;
    if (size < need) size = need;
    if (size > room - ALIGNMENT) size = room - ALIGNMENT;
    assert(size >= need && size % ALIGNMENT == 0);
    block *b = get_block(arena, ALIGNMENT + size);
    if (!b) return NULL;
    *b = (block){arena->blocks, size, 0};
    ASAN_POISON_MEMORY_REGION(block_bytes(b), size);
    arena->blocks = b;
    arena->taken += ALIGNMENT + size;
    note_peak(arena);
    return b;
}

size_t shd_arena_size(size_t count, size_t size) {
    if (size && count > (SIZE_MAX - ALIGNMENT) / size) return 0;
    const size_t bytes = count * size;
    return (bytes ? bytes + ALIGNMENT - 1 : ALIGNMENT) / ALIGNMENT * ALIGNMENT;
}

void *shd_arena_alloc(shd_arena *arena, size_t count, size_t size) {
    const size_t rounded = shd_arena_size(count, size);
    if (!rounded) {
        arena->full = true;
        return NULL;
    }
    block *b = arena->blocks;
    if (!b || b->size - b->used < rounded) b = add_block(arena, rounded);
    if (!b) return NULL;
    void *at = block_bytes(b) + b->used;
    b->used += rounded;
    ASAN_UNPOISON_MEMORY_REGION(at, count * size);
    return at;
}

void *shd_arena_zalloc(shd_arena *arena, size_t count, size_t size) {
    void *at = shd_arena_alloc(arena, count, size);
    if (at) memset(at, 0, count * size);
    return at;
}

char *shd_arena_strdup(shd_arena *arena, const char *text) {
    size_t bytes = strlen(text) + 1;
    char *copy = shd_arena_alloc(arena, bytes, 1);
    return copy ? memcpy(copy, text, bytes) : NULL;
}

char *shd_arena_printf(shd_arena *arena, const char *format, ...) {
    va_list args;
    va_start(args, format);
    int length = vsnprintf(NULL, 0, format, args);
    va_end(args);
    if (length < 0) return NULL;
    char *text = shd_arena_alloc(arena, (size_t)length + 1, 1);
    if (!text) return NULL;
    va_start(args, format);
    vsnprintf(text, (size_t)length + 1, format, args);
    va_end(args);
    return text;
}

bool shd_arena_crowded(const shd_arena *arena) {
    return arena->crowded;
}

bool shd_arena_full(const shd_arena *arena) {
    return arena->full;
}

size_t shd_arena_used(const shd_arena *arena) {
    return arena->taken;
}

size_t shd_arena_peak(const shd_arena *arena) {
    return arena->peak;
}

size_t shd_arena_room(const shd_arena *arena) {
    return arena->cap - arena->taken - arena->borrowed;
}
