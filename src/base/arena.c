#include "base/arena.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/poison.h"

enum { ALIGNMENT = 64, FIRST_BLOCK = 64 * 1024 };

typedef struct block {
    struct block *next;
    size_t size; /* usable bytes after the header */
    size_t used;
} block;

_Static_assert(sizeof(block) <= ALIGNMENT, "a block's header fits into one alignment unit");

struct shd_arena {
    size_t cap, taken;
    bool full;
    shd_spares *spares; /* NULL: blocks are the system's */
    block *blocks;      /* newest first */
};

static unsigned char *block_bytes(block *b) {
    return (unsigned char *)b + ALIGNMENT;
}

shd_arena *shd_arena_new_from(shd_spares *spares, size_t cap) {
    shd_arena *arena = calloc(1, sizeof *arena);
    if (!arena) return NULL;
    arena->cap = cap;
    arena->spares = spares;
    return arena;
}

shd_arena *shd_arena_new(size_t cap) {
    return shd_arena_new_from(NULL, cap);
}

void shd_arena_drop(shd_arena *arena) {
    if (!arena) return;
    for (block *b = arena->blocks; b;) {
        block *next = b->next;
        shd_spares_give(arena->spares, b, ALIGNMENT + b->size);
        b = next;
    }
    free(arena);
}

/* Blocks double so that their number stays small, but a request that is larger than that gets a
 * block of its own size: a big film does not double the arena. */
static block *add_block(shd_arena *arena, size_t need) {
    size_t size = arena->taken < FIRST_BLOCK ? FIRST_BLOCK : arena->taken;
    size_t room = arena->cap - arena->taken;
    if (room < ALIGNMENT || need > room - ALIGNMENT) {
        arena->full = true;
        return NULL;
    }
    if (size > 16u << 20) size = 16u << 20;
    if (size < need) size = need;
    if (size > room - ALIGNMENT) size = (room - ALIGNMENT) / ALIGNMENT * ALIGNMENT;
    if (size < need) {
        arena->full = true;
        return NULL;
    }
    block *b = shd_spares_take(arena->spares, ALIGNMENT + size);
    if (!b) return NULL;
    *b = (block){arena->blocks, size, 0};
    ASAN_POISON_MEMORY_REGION(block_bytes(b), size);
    arena->blocks = b;
    arena->taken += ALIGNMENT + size;
    return b;
}

void *shd_arena_alloc(shd_arena *arena, size_t count, size_t size) {
    if (size && count > (SIZE_MAX - ALIGNMENT) / size) {
        arena->full = true;
        return NULL;
    }
    size_t bytes = count * size;
    size_t rounded = (bytes ? bytes + ALIGNMENT - 1 : ALIGNMENT) / ALIGNMENT * ALIGNMENT;
    block *b = arena->blocks;
    if (!b || b->size - b->used < rounded) b = add_block(arena, rounded);
    if (!b) return NULL;
    void *at = block_bytes(b) + b->used;
    b->used += rounded;
    ASAN_UNPOISON_MEMORY_REGION(at, bytes);
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

bool shd_arena_full(const shd_arena *arena) {
    return arena->full;
}

size_t shd_arena_used(const shd_arena *arena) {
    return arena->taken;
}

size_t shd_arena_room(const shd_arena *arena) {
    return arena->cap - arena->taken;
}
