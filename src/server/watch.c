#include "watch.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <time.h>

#include "clock.h"

struct shd_watch {
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    pthread_t thread;
    shd_watched list; /* ring; its first entry is due first */
    double wakes;     /* while the thread waits: when it looks next, infinity where it does not */
    bool stopped;     /* every job is to end */
    bool ending;      /* the thread is to end */
};

static void cancel(shd_watched *entry, shd_verdict verdict) {
    if (entry->verdict == SHD_IN_TIME) entry->verdict = verdict;
    if (entry->request) shd_request_cancel(entry->request);
}

static struct timespec to_timespec(double seconds) {
    struct timespec time = {.tv_sec = (time_t)seconds};
    time.tv_nsec = (long)((seconds - (double)time.tv_sec) * 1e9);
    return time;
}

/* Overdue entries stay in the ring, where remove expects them, but need no more watching. */
static void *run(void *context) {
    shd_watch *watch = context;
    pthread_mutex_lock(&watch->mutex);
    while (!watch->ending) {
        double now = shd_now();
        shd_watched *entry = watch->list.next;
        for (; entry != &watch->list && entry->deadline <= now; entry = entry->next)
            if (entry->verdict == SHD_IN_TIME) cancel(entry, SHD_EXPIRED);
        if (entry == &watch->list) {
            watch->wakes = INFINITY;
            pthread_cond_wait(&watch->changed, &watch->mutex);
        } else {
            struct timespec until = to_timespec(entry->deadline);
            watch->wakes = entry->deadline;
            pthread_cond_timedwait(&watch->changed, &watch->mutex, &until);
        }
    }
    pthread_mutex_unlock(&watch->mutex);
    return NULL;
}

shd_status shd_watch_new(shd_watch **out, shd_error *error) {
    shd_watch *watch = calloc(1, sizeof *watch);
    if (!watch) return shd_fail(error, SHD_MEMORY, "", "no memory for the deadlines");
    watch->list.previous = watch->list.next = &watch->list;
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_mutex_init(&watch->mutex, NULL);
    pthread_cond_init(&watch->changed, &monotonic);
    pthread_condattr_destroy(&monotonic);
    if (pthread_create(&watch->thread, NULL, run, watch)) {
        pthread_cond_destroy(&watch->changed);
        pthread_mutex_destroy(&watch->mutex);
        free(watch);
        return shd_fail(error, SHD_MEMORY, "", "the system refused to start a thread");
    }
    *out = watch;
    return SHD_OK;
}

void shd_watch_drop(shd_watch *watch) {
    if (!watch) return;
    pthread_mutex_lock(&watch->mutex);
    watch->ending = true;
    pthread_cond_signal(&watch->changed);
    pthread_mutex_unlock(&watch->mutex);
    pthread_join(watch->thread, NULL);
    pthread_cond_destroy(&watch->changed);
    pthread_mutex_destroy(&watch->mutex);
    free(watch);
}

void shd_watch_add(shd_watch *watch, shd_watched *entry, double deadline) {
    pthread_mutex_lock(&watch->mutex);
    *entry =
        (shd_watched){.deadline = deadline, .verdict = watch->stopped ? SHD_STOPPED : SHD_IN_TIME};
    /* Deadlines mostly come in order: the place is near the end. */
    shd_watched *after = watch->list.previous;
    while (after != &watch->list && after->deadline > deadline) after = after->previous;
    entry->previous = after;
    entry->next = after->next;
    entry->previous->next = entry;
    entry->next->previous = entry;
    /* The thread may still wait for the deadline of a job that is done long since: then it need
     * not be called for a later one, which on a quiet server is every one. */
    if (deadline < watch->wakes) pthread_cond_signal(&watch->changed);
    pthread_mutex_unlock(&watch->mutex);
}

bool shd_watch_attach(shd_watch *watch, shd_watched *entry, shd_request *request) {
    pthread_mutex_lock(&watch->mutex);
    bool in_time = entry->verdict == SHD_IN_TIME && entry->deadline > shd_now();
    if (in_time)
        entry->request = request;
    else
        cancel(entry, SHD_EXPIRED);
    pthread_mutex_unlock(&watch->mutex);
    return in_time;
}

shd_verdict shd_watch_remove(shd_watch *watch, shd_watched *entry) {
    pthread_mutex_lock(&watch->mutex);
    entry->previous->next = entry->next;
    entry->next->previous = entry->previous;
    shd_verdict verdict = entry->verdict;
    pthread_mutex_unlock(&watch->mutex);
    return verdict;
}

void shd_watch_stop(shd_watch *watch) {
    pthread_mutex_lock(&watch->mutex);
    watch->stopped = true;
    for (shd_watched *entry = watch->list.next; entry != &watch->list; entry = entry->next)
        cancel(entry, SHD_STOPPED);
    pthread_mutex_unlock(&watch->mutex);
}
