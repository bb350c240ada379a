#include "base/spares.h"

#include <pthread.h>
#include <stdint.h>
#include <stdlib.h>
#include <sys/mman.h>

#include "base/poison.h"

enum { ALIGNMENT = 64, SMALLEST = 64 * 1024, HUGE_PAGE = 2 << 20 };

/* A kept block begins with its place in the ring. */
typedef struct spare {
    struct spare *newer, *older;
    size_t size;
} spare;

struct shd_spares {
    pthread_mutex_t mutex;
    spare ring; /* ring.older is what was given back last */
    size_t cap, kept;
};

shd_spares *shd_spares_new(size_t cap) {
    shd_spares *spares = calloc(1, sizeof *spares);
    if (!spares) return NULL;
    spares->ring.newer = spares->ring.older = &spares->ring;
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

static void unlink_spare(shd_spares *spares, spare *s) {
    s->newer->older = s->older;
    s->older->newer = s->newer;
    spares->kept -= s->size;
}

static void end_spare(spare *s) {
    ASAN_UNPOISON_MEMORY_REGION(s, s->size);
    free(s);
}

void shd_spares_drop(shd_spares *spares) {
    if (!spares) return;
    while (spares->ring.older != &spares->ring) {
        spare *s = spares->ring.older;
        unlink_spare(spares, s);
        end_spare(s);
    }
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
    if (spares) {
        pthread_mutex_lock(&spares->mutex);
        spare *s = spares->ring.older;
        while (s != &spares->ring && s->size != size) s = s->older;
        if (s != &spares->ring) unlink_spare(spares, s);
        pthread_mutex_unlock(&spares->mutex);
        if (s != &spares->ring) {
            ASAN_UNPOISON_MEMORY_REGION(s, size);
            return s;
        }
    }
    return allocate(size);
}

void shd_spares_give(shd_spares *spares, void *memory, size_t size) {
    if (!memory) return;
    spare *s = memory, *oldest = NULL;
    size = round_up(size);
    ASAN_UNPOISON_MEMORY_REGION(s, size);
    if (!spares || size > spares->cap) {
        free(memory);
        return;
    }
    s->size = size;
    ASAN_POISON_MEMORY_REGION(s + 1, size - sizeof *s);

    pthread_mutex_lock(&spares->mutex);
    s->newer = &spares->ring;
    s->older = spares->ring.older;
    s->older->newer = s;
    spares->ring.older = s;
    spares->kept += size;
    while (spares->kept > spares->cap) {
        spare *end = spares->ring.newer;
        unlink_spare(spares, end);
        end->newer = oldest;
        oldest = end;
    }
    pthread_mutex_unlock(&spares->mutex);

    /* The system takes its time: nobody waits for it. */
    while (oldest) {
        spare *next = oldest->newer;
        end_spare(oldest);
        oldest = next;
    }
}

size_t shd_spares_kept(shd_spares *spares) {
    pthread_mutex_lock(&spares->mutex);
    size_t kept = spares->kept;
    pthread_mutex_unlock(&spares->mutex);
    return kept;
}
