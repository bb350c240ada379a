#include "base/budget.h"

#include <assert.h>
#include <stdlib.h>

#include "base/clock.h"

struct shd_budget {
    pthread_mutex_t mutex;
    pthread_cond_t given;
    unsigned owners;
    shd_budget_load load;
    struct {
        shd_give_way *give_way; /* NULL: there is none */
        void *context;
    } ranks[SHD_RANKS];
};

shd_budget *shd_budget_new(uint64_t cap) {
    shd_budget *budget = calloc(1, sizeof *budget);
    if (!budget) return NULL;
    budget->load.cap = cap;
    budget->owners = 1;
    pthread_mutex_init(&budget->mutex, NULL);
    shd_cond_init(&budget->given);
    return budget;
}

shd_budget *shd_budget_keep(shd_budget *budget) {
    if (!budget) return NULL;
    pthread_mutex_lock(&budget->mutex);
    budget->owners++;
    pthread_mutex_unlock(&budget->mutex);
    return budget;
}

void shd_budget_drop(shd_budget *budget) {
    if (!budget) return;
    pthread_mutex_lock(&budget->mutex);
    assert(budget->owners > 0);
    const bool last = --budget->owners == 0;
    pthread_mutex_unlock(&budget->mutex);
    if (!last) return;
    pthread_cond_destroy(&budget->given);
    pthread_mutex_destroy(&budget->mutex);
    free(budget);
}

void shd_budget_yield(shd_budget *budget, shd_rank rank, shd_give_way *give_way, void *context) {
    if (!budget) return;
    budget->ranks[rank].give_way = give_way;
    budget->ranks[rank].context = context;
}

/* ---- The mutex is held ---- */

static bool is_free(const shd_budget *budget, size_t bytes) {
    const shd_budget_load *load = &budget->load;
    return load->used <= load->cap && bytes <= load->cap - load->used;
}

static bool take_free(shd_budget *budget, size_t bytes) {
    if (!is_free(budget, bytes)) return false;
    budget->load.used += bytes;
    return true;
}

static uint64_t most_bytes(const shd_budget_load *load) {
    return load->cap > load->fixed ? load->cap - load->fixed : 0;
}

/* Asks those that give way, one after the other, until enough is free or, if the caller waits,
 * promised. The mutex is held before and after, and is free while they are asked. */
static void ask_for(shd_budget *budget, size_t bytes, bool waits) {
    size_t promised = 0;
    for (size_t i = 0; i < SHD_RANKS && !is_free(budget, bytes); i++) {
        if (!budget->ranks[i].give_way) continue;
        const size_t missing = (size_t)(budget->load.used + bytes - budget->load.cap);
        if (waits && promised >= missing) break;
        pthread_mutex_unlock(&budget->mutex);
        promised += budget->ranks[i].give_way(budget->ranks[i].context,
                                              waits ? missing - promised : missing);
        pthread_mutex_lock(&budget->mutex);
    }
}

/* ---- Any thread ---- */

bool shd_budget_try(shd_budget *budget, size_t bytes) {
    if (!budget) return true;
    pthread_mutex_lock(&budget->mutex);
    const bool taken = take_free(budget, bytes);
    pthread_mutex_unlock(&budget->mutex);
    return taken;
}

bool shd_budget_wait(shd_budget *budget, size_t bytes, double seconds) {
    if (!budget) return true;
    const double until = shd_now() + seconds;
    pthread_mutex_lock(&budget->mutex);
    const bool possible = bytes <= most_bytes(&budget->load);
    bool taken = take_free(budget, bytes);
    while (!taken && possible) {
        ask_for(budget, bytes, seconds > 0);
        taken = take_free(budget, bytes);
        const double now = shd_now();
        if (taken || now >= until) break;
        /* If nobody gives way, other work may end. What was promised may also go to somebody else,
         * so that nothing is left; then those that give way are asked again. */
        const struct timespec again = shd_timespec(now + 0.05 < until ? now + 0.05 : until);
        pthread_cond_timedwait(&budget->given, &budget->mutex, &again);
        taken = take_free(budget, bytes);
    }
    budget->load.refused += !taken;
    pthread_mutex_unlock(&budget->mutex);
    return taken;
}

bool shd_budget_take(shd_budget *budget, size_t bytes) {
    return shd_budget_wait(budget, bytes, 0);
}

static void add_bytes(shd_budget *budget, size_t used, size_t fixed) {
    if (!budget) return;
    pthread_mutex_lock(&budget->mutex);
    budget->load.used += used;
    budget->load.fixed += fixed;
    pthread_mutex_unlock(&budget->mutex);
}

void shd_budget_count(shd_budget *budget, size_t bytes) {
    add_bytes(budget, bytes, 0);
}

void shd_budget_fix(shd_budget *budget, size_t bytes) {
    add_bytes(budget, bytes, bytes);
}

void shd_budget_give(shd_budget *budget, size_t bytes) {
    if (!budget || !bytes) return;
    pthread_mutex_lock(&budget->mutex);
    assert(budget->load.used >= bytes);
    budget->load.used -= bytes;
    pthread_cond_broadcast(&budget->given);
    pthread_mutex_unlock(&budget->mutex);
}

shd_budget_load shd_budget_load_of(shd_budget *budget) {
    if (!budget) return (shd_budget_load){.cap = UINT64_MAX};
    pthread_mutex_lock(&budget->mutex);
    const shd_budget_load load = budget->load;
    pthread_mutex_unlock(&budget->mutex);
    return load;
}

uint64_t shd_budget_most(shd_budget *budget) {
    const shd_budget_load load = shd_budget_load_of(budget);
    return most_bytes(&load);
}
