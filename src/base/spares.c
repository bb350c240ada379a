#include "base/spares.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "base/poison.h"

enum { ALIGNMENT = 64, SMALLEST = 64 * 1024, HUGE_PAGE = 2 << 20, MOST = 256 };

typedef struct spare {
    void *memory;
    size_t size;
    unsigned rest; /* shd_spares_rest as it was before the block was given back */
} spare;

struct shd_spares {
    pthread_mutex_t mutex;
    shd_budget *budget;
    size_t cap, kept, count;
    unsigned rests;
    /* [count]; the block given back last is last; one too many for a moment */
    spare list[MOST + 1];
};

shd_spares *shd_spares_new(size_t cap, shd_budget *budget) {
    shd_spares *spares = calloc(1, sizeof *spares);
    if (!spares) return NULL;
    spares->cap = cap;
    spares->budget = budget;
    pthread_mutex_init(&spares->mutex, NULL);
    return spares;
}

shd_budget *shd_spares_budget(const shd_spares *spares) {
    return spares ? spares->budget : NULL;
}

size_t shd_spares_size(size_t size) {
    if (size <= SMALLEST) return SMALLEST;
    if (size > SIZE_MAX / 2) return 0;
    size_t step = SMALLEST / 8;
    while (step * 16 < size) step *= 2;
    return (size + step - 1) / step * step;
}

/* The mutex is held. */
static spare unlist_spare(shd_spares *spares, size_t index) {
    spare out = spares->list[index];
    spares->count--;
    spares->kept -= out.size;
    memmove(spares->list + index, spares->list + index + 1,
            (spares->count - index) * sizeof *spares->list);
    return out;
}

static void end_spare(shd_spares *spares, spare s) {
    ASAN_UNPOISON_MEMORY_REGION(s.memory, s.size);
    free(s.memory);
    shd_budget_give(shd_spares_budget(spares), s.size);
}

void shd_spares_drop(shd_spares *spares) {
    if (!spares) return;
    for (size_t i = 0; i < spares->count; i++) end_spare(spares, spares->list[i]);
    pthread_mutex_destroy(&spares->mutex);
    free(spares);
}

void *shd_spares_make(size_t size) {
    size = shd_spares_size(size);
    if (!size) return NULL;
    if (size < 2 * HUGE_PAGE) return aligned_alloc(ALIGNMENT, size);
    /* A film's pages one by one would cost as much time as its shading. */
    void *memory = NULL;
    if (posix_memalign(&memory, HUGE_PAGE, size)) return NULL;
#ifdef MADV_HUGEPAGE
    madvise(memory, size, MADV_HUGEPAGE); /* only advice: nothing is lost if it is not taken */
#endif
    return memory;
}

void *shd_spares_find(shd_spares *spares, size_t size) {
    spare found = {.memory = NULL};
    size = shd_spares_size(size);
    if (!spares || !size) return NULL;
    pthread_mutex_lock(&spares->mutex);
    for (size_t i = spares->count; i-- > 0 && !found.memory;)
        if (spares->list[i].size == size) found = unlist_spare(spares, i);
    pthread_mutex_unlock(&spares->mutex);
    if (found.memory) ASAN_UNPOISON_MEMORY_REGION(found.memory, size);
    return found.memory;
}

void shd_spares_give(shd_spares *spares, void *memory, size_t size) {
    if (!memory) return;
    spare given = {.memory = memory, .size = shd_spares_size(size)};
    if (!spares || given.size > spares->cap) {
        end_spare(spares, given);
        return;
    }
    ASAN_POISON_MEMORY_REGION(memory, given.size);
    pthread_mutex_lock(&spares->mutex);
    given.rest = spares->rests;
    spares->list[spares->count++] = given;
    spares->kept += given.size;
    while (spares->kept > spares->cap || spares->count > MOST)
        end_spare(spares, unlist_spare(spares, 0));
    pthread_mutex_unlock(&spares->mutex);
}

size_t shd_spares_trim(shd_spares *spares, size_t bytes) {
    pthread_mutex_lock(&spares->mutex);
    const size_t before = spares->kept;
    while (spares->count && before - spares->kept < bytes)
        end_spare(spares, unlist_spare(spares, 0));
    const size_t ended = before - spares->kept;
    pthread_mutex_unlock(&spares->mutex);
    return ended;
}

void shd_spares_rest(shd_spares *spares, size_t floor) {
    pthread_mutex_lock(&spares->mutex);
    while (spares->kept > floor && spares->list[0].rest != spares->rests)
        end_spare(spares, unlist_spare(spares, 0));
    spares->rests++;
    pthread_mutex_unlock(&spares->mutex);
}

size_t shd_spares_kept(shd_spares *spares) {
    pthread_mutex_lock(&spares->mutex);
    size_t kept = spares->kept;
    pthread_mutex_unlock(&spares->mutex);
    return kept;
}
