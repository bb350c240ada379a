#include "base/spares.h"

#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "base/poison.h"

enum { ALIGNMENT = 64, SMALLEST = 64 * 1024, HUGE_PAGE = 2 << 20, MOST = 256 };

typedef struct spare {
    void *memory;
    size_t size;
} spare;

struct shd_spares {
    pthread_mutex_t mutex;
    size_t cap, kept, count;
    spare list[MOST + 1]; /* [count], what was given back last is last; one too many for a moment */
};

shd_spares *shd_spares_new(size_t cap) {
    shd_spares *spares = calloc(1, sizeof *spares);
    if (!spares) return NULL;
    spares->cap = cap;
    pthread_mutex_init(&spares->mutex, NULL);
    return spares;
}

/* The size of the block that holds `size` bytes; 0 where there is none. */
static size_t round_up(size_t size) {
    if (size <= SMALLEST) return SMALLEST;
    if (size > SIZE_MAX / 2) return 0;
    size_t step = SMALLEST / 8;
    while (step * 16 < size) step *= 2;
    return (size + step - 1) / step * step;
}

/* The mutex is held. */
static spare take_out(shd_spares *spares, size_t index) {
    spare out = spares->list[index];
    spares->count--;
    spares->kept -= out.size;
    memmove(spares->list + index, spares->list + index + 1,
            (spares->count - index) * sizeof *spares->list);
    return out;
}

static void end_spare(spare s) {
    ASAN_UNPOISON_MEMORY_REGION(s.memory, s.size);
    free(s.memory);
}

void shd_spares_drop(shd_spares *spares) {
    if (!spares) return;
    for (size_t i = 0; i < spares->count; i++) end_spare(spares->list[i]);
    pthread_mutex_destroy(&spares->mutex);
    free(spares);
}

static void *allocate(size_t size) {
    if (size < 2 * HUGE_PAGE) return aligned_alloc(ALIGNMENT, size);
    /* A film's pages one by one would cost as much time as its shading. */
    void *memory = NULL;
    if (posix_memalign(&memory, HUGE_PAGE, size)) return NULL;
#ifdef MADV_HUGEPAGE
    madvise(memory, size, MADV_HUGEPAGE); /* advice: where it is not taken nothing is lost */
#endif
    return memory;
}

void *shd_spares_take(shd_spares *spares, size_t size) {
    size = round_up(size);
    if (!size) return NULL;
    spare found = {NULL, 0};
    if (spares) {
        pthread_mutex_lock(&spares->mutex);
        for (size_t i = spares->count; i-- > 0 && !found.memory;)
            if (spares->list[i].size == size) found = take_out(spares, i);
        pthread_mutex_unlock(&spares->mutex);
    }
    if (!found.memory) return allocate(size);
    ASAN_UNPOISON_MEMORY_REGION(found.memory, size);
    return found.memory;
}

void shd_spares_give(shd_spares *spares, void *memory, size_t size) {
    if (!memory) return;
    spare given = {memory, round_up(size)};
    if (!spares || given.size > spares->cap) {
        end_spare(given);
        return;
    }
    ASAN_POISON_MEMORY_REGION(memory, given.size);
    pthread_mutex_lock(&spares->mutex);
    spares->list[spares->count++] = given;
    spares->kept += given.size;
    while (spares->kept > spares->cap || spares->count > MOST) end_spare(take_out(spares, 0));
    pthread_mutex_unlock(&spares->mutex);
}

size_t shd_spares_kept(shd_spares *spares) {
    pthread_mutex_lock(&spares->mutex);
    size_t kept = spares->kept;
    pthread_mutex_unlock(&spares->mutex);
    return kept;
}
