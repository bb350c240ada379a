#include "stuck.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

#include "base/clock.h"
#include "server/ops/log.h"

/* Seconds that a worker may take to notice. */
static const double grace = 1;

struct shd_stuck {
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    pthread_t thread;
    shd_watched ring; /* those that are watched, the first one cancelled first */
    bool ending;
};

static void log_worker(const char *what, shd_log_level level, const shd_watched *watched,
                       double now) {
    char seconds[32];
    shd_log line;
    snprintf(seconds, sizeof seconds, "%.1f", now - watched->since);
    shd_log_begin(&line, level, what);
    shd_log_text(&line, "request", watched->id);
    shd_log_text(&line, "seconds-since-cancelled", seconds);
    shd_log_end(&line);
}

/* Tells each one whose grace is over, once. Returns the next one that may have to be told. */
static shd_watched *tell_late(shd_stuck *stuck, double now) {
    shd_watched *w = stuck->ring.next;
    for (; w != &stuck->ring && w->since + grace <= now; w = w->next) {
        if (!w->told) log_worker("worker-stuck", SHD_LOG_ERROR, w, now);
        w->told = true;
    }
    return w;
}

static void *watch_all(void *context) {
    shd_stuck *stuck = context;
    pthread_mutex_lock(&stuck->mutex);
    while (!stuck->ending) {
        const shd_watched *next = tell_late(stuck, shd_now());
        if (next == &stuck->ring) {
            pthread_cond_wait(&stuck->changed, &stuck->mutex);
        } else {
            struct timespec until = shd_timespec(next->since + grace);
            pthread_cond_timedwait(&stuck->changed, &stuck->mutex, &until);
        }
    }
    pthread_mutex_unlock(&stuck->mutex);
    return NULL;
}

void shd_stuck_watch(shd_stuck *stuck, shd_watched *watched, const char *id) {
    pthread_mutex_lock(&stuck->mutex);
    shd_watched *last = stuck->ring.previous;
    *watched = (shd_watched){last, &stuck->ring, id, shd_now(), false};
    last->next = stuck->ring.previous = watched;
    pthread_cond_signal(&stuck->changed);
    pthread_mutex_unlock(&stuck->mutex);
}

void shd_stuck_forget(shd_stuck *stuck, shd_watched *watched) {
    pthread_mutex_lock(&stuck->mutex);
    if (watched->next) {
        watched->previous->next = watched->next;
        watched->next->previous = watched->previous;
        watched->next = watched->previous = NULL;
        if (watched->told) log_worker("worker-released", SHD_LOG_WARNING, watched, shd_now());
    }
    pthread_mutex_unlock(&stuck->mutex);
}

unsigned shd_stuck_count(shd_stuck *stuck) {
    unsigned count = 0;
    pthread_mutex_lock(&stuck->mutex);
    const double now = shd_now();
    for (const shd_watched *w = stuck->ring.next; w != &stuck->ring && w->since + grace <= now;
         w = w->next)
        count++;
    pthread_mutex_unlock(&stuck->mutex);
    return count;
}

shd_status shd_stuck_new(shd_stuck **out, shd_error *error) {
    shd_stuck *stuck = calloc(1, sizeof *stuck);
    if (!stuck) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    stuck->ring.previous = stuck->ring.next = &stuck->ring;
    pthread_mutex_init(&stuck->mutex, NULL);
    shd_cond_init(&stuck->changed);
    if (!pthread_create(&stuck->thread, NULL, watch_all, stuck)) {
        *out = stuck;
        return SHD_OK;
    }
    pthread_cond_destroy(&stuck->changed);
    pthread_mutex_destroy(&stuck->mutex);
    free(stuck);
    return shd_fail(error, SHD_EXHAUSTED, "", "the system refused to start a thread");
}

void shd_stuck_drop(shd_stuck *stuck) {
    if (!stuck) return;
    pthread_mutex_lock(&stuck->mutex);
    stuck->ending = true;
    pthread_cond_signal(&stuck->changed);
    pthread_mutex_unlock(&stuck->mutex);
    pthread_join(stuck->thread, NULL);
    pthread_cond_destroy(&stuck->changed);
    pthread_mutex_destroy(&stuck->mutex);
    free(stuck);
}
