#include "base/stock.h"

#include <assert.h>
#include <pthread.h>
#include <stdlib.h>
#include <sys/mman.h>

/* STEP units are touched at a time */
enum { SLAB = 2 << 20, UNITS = SLAB / SHD_STOCK_UNIT, PAGE = 4096, STEP = 8 };

_Static_assert(UNITS == 64, "a slab's units are the bits of a word");

typedef struct slab {
    unsigned char *memory; /* NULL: it is not mapped */
    uint64_t free;         /* bit i: unit i is free */
    uint64_t touched;      /* bit i: unit i has pages */
} slab;

struct shd_stock {
    pthread_mutex_t mutex;
    shd_budget *budget;
    size_t units; /* that the cap allows */
    size_t count; /* slabs that are or were mapped */
    size_t ready; /* units that are free and touched */
    slab slabs[]; /* [(units + UNITS - 1) / UNITS] */
};

static size_t slabs_of(size_t units) {
    return (units + UNITS - 1) / UNITS;
}

static uint64_t first_bits(size_t n) {
    return n < UNITS ? ((uint64_t)1 << n) - 1 : UINT64_MAX;
}

static size_t count_bits(uint64_t bits) {
    return (size_t)__builtin_popcountll(bits);
}

shd_stock *shd_stock_new(size_t cap, shd_budget *budget) {
    const size_t units = cap / SHD_STOCK_UNIT;
    shd_stock *stock = calloc(1, sizeof *stock + slabs_of(units) * sizeof stock->slabs[0]);
    if (!stock) return NULL;
    stock->units = units;
    stock->budget = budget;
    pthread_mutex_init(&stock->mutex, NULL);
    return stock;
}

static void unmap_slab(shd_stock *stock, slab *s) {
    if (!s->memory) return;
    munmap(s->memory, SLAB);
    shd_budget_give(stock->budget, SLAB);
    *s = (slab){.memory = NULL};
}

void shd_stock_drop(shd_stock *stock) {
    if (!stock) return;
    for (size_t i = 0; i < stock->count; i++) unmap_slab(stock, &stock->slabs[i]);
    pthread_mutex_destroy(&stock->mutex);
    free(stock);
}

/* ---- The mutex is held. ---- */

/* An aligned slab is a part of a region of twice its size. */
static unsigned char *map_slab(void) {
    unsigned char *memory =
        mmap(NULL, 2 * SLAB, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) return NULL;
    const size_t before = (SLAB - (uintptr_t)memory % SLAB) % SLAB;
    if (before) munmap(memory, before);
    munmap(memory + before + SLAB, SLAB - before);
#ifdef MADV_HUGEPAGE
    madvise(memory + before, SLAB, MADV_HUGEPAGE);
#endif
    return memory + before;
}

static slab *add_slab(shd_stock *stock) {
    size_t i = 0;
    while (i < stock->count && stock->slabs[i].memory) i++;
    if (i == slabs_of(stock->units) || !shd_budget_try(stock->budget, SLAB)) return NULL;
    unsigned char *memory = map_slab();
    if (!memory) {
        shd_budget_give(stock->budget, SLAB);
        return NULL;
    }
    slab *s = &stock->slabs[i];
    *s = (slab){.memory = memory, .free = first_bits(stock->units - i * UNITS)};
    if (i == stock->count) stock->count++;
    return s;
}

/* The bits i such that n bits from i on are set. */
static uint64_t find_runs(uint64_t bits, size_t n) {
    for (size_t have = 1; have < n;) {
        const size_t more = have < n - have ? have : n - have;
        bits &= bits >> more;
        have += more;
    }
    return bits;
}

/* Takes `n` units of the slab that `from` describes; 0 if there is no such run. */
static uint64_t take_units(shd_stock *stock, slab *s, uint64_t from, size_t n) {
    const uint64_t runs = find_runs(from, n);
    if (!runs) return 0;
    const uint64_t run = first_bits(n) << __builtin_ctzll(runs);
    assert(stock->ready >= count_bits(s->touched & run));
    stock->ready -= count_bits(s->touched & run);
    s->free &= ~run;
    return run;
}

static void *start_of(const slab *s, uint64_t run) {
    return s->memory + (size_t)__builtin_ctzll(run) * SHD_STOCK_UNIT;
}

/* ---- Any thread ---- */

void *shd_stock_take(shd_stock *stock, size_t size) {
    const size_t n = size / SHD_STOCK_UNIT;
    void *memory = NULL;
    pthread_mutex_lock(&stock->mutex);
    /* Units that have pages come first. */
    for (int fresh = 0; fresh < 2 && !memory; fresh++) {
        for (size_t i = 0; i < stock->count + (fresh ? 1 : 0) && !memory; i++) {
            slab *s = i < stock->count ? &stock->slabs[i] : add_slab(stock);
            if (!s) break;
            const uint64_t run = take_units(stock, s, fresh ? s->free : s->free & s->touched, n);
            if (run) memory = start_of(s, run);
            s->touched |= run;
        }
    }
    pthread_mutex_unlock(&stock->mutex);
    return memory;
}

void shd_stock_give(shd_stock *stock, void *memory, size_t size) {
    pthread_mutex_lock(&stock->mutex);
    for (size_t i = 0; i < stock->count; i++) {
        slab *s = &stock->slabs[i];
        const uintptr_t offset = (uintptr_t)memory - (uintptr_t)s->memory;
        if (!s->memory || offset >= SLAB) continue;
        const uint64_t run = first_bits(size / SHD_STOCK_UNIT) << offset / SHD_STOCK_UNIT;
        assert(offset % SHD_STOCK_UNIT == 0 && !(s->free & run));
        s->free |= run;
        stock->ready += size / SHD_STOCK_UNIT;
        break;
    }
    pthread_mutex_unlock(&stock->mutex);
}

size_t shd_stock_trim(shd_stock *stock, size_t bytes) {
    size_t given = 0;
    pthread_mutex_lock(&stock->mutex);
    for (size_t i = stock->count; i-- > 0 && given < bytes;) {
        slab *s = &stock->slabs[i];
        if (!s->memory || s->free != first_bits(stock->units - i * UNITS)) continue;
        stock->ready -= count_bits(s->free & s->touched);
        unmap_slab(stock, s);
        given += SLAB;
    }
    pthread_mutex_unlock(&stock->mutex);
    return given;
}

bool shd_stock_touch(shd_stock *stock) {
    slab *s = NULL;
    uint64_t run = 0;
    pthread_mutex_lock(&stock->mutex);
    const size_t most = SHD_STOCK_AHEAD / SHD_STOCK_UNIT;
    if (stock->ready < (stock->units / 8 < most ? stock->units / 8 : most)) {
        for (size_t i = 0; i < stock->count + 1 && !run; i++) {
            s = i < stock->count ? &stock->slabs[i] : add_slab(stock);
            if (!s) break;
            for (size_t n = STEP; n && !run; n /= 2)
                run = take_units(stock, s, s->free & ~s->touched, n);
        }
    }
    pthread_mutex_unlock(&stock->mutex);
    if (!run) return false;

    volatile unsigned char *at = start_of(s, run);
    const size_t units = count_bits(run);
    for (size_t k = 0; k < units * SHD_STOCK_UNIT; k += PAGE) at[k] = 0;

    pthread_mutex_lock(&stock->mutex);
    s->free |= run;
    s->touched |= run;
    stock->ready += units;
    pthread_mutex_unlock(&stock->mutex);
    return true;
}
