#include "base/scratch.h"

void *shd_scratch_take(shd_scratch *scratch, size_t count, size_t size) {
    const size_t bytes = shd_arena_size(count, size);
    if (!bytes || __builtin_add_overflow(scratch->bytes, bytes, &scratch->bytes))
        scratch->bytes = UINT64_MAX;
    if (!scratch->arena || scratch->full) return NULL;
    void *at = shd_arena_alloc(scratch->arena, count, size);
    scratch->full = !at;
    return at;
}
