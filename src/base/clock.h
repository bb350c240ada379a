/* Seconds. Any thread. */
#pragma once

#include <pthread.h>
#include <time.h>

static inline double shd_read_clock(clockid_t clock) {
    struct timespec now;
    clock_gettime(clock, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* The monotonic clock, for durations and deadlines and never for dates. It is read in 20 to 50 ns.
 */
static inline double shd_now(void) {
    return shd_read_clock(CLOCK_MONOTONIC);
}

/* Whole seconds since 1970. time() is by a coarser clock, and may still tell the second before. */
static inline long long shd_date(void) {
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    return (long long)now.tv_sec;
}

/* The calling thread's processor time. */
static inline double shd_thread_seconds(void) {
    return shd_read_clock(CLOCK_THREAD_CPUTIME_ID);
}

static inline struct timespec shd_timespec(double seconds) {
    struct timespec time = {.tv_sec = (time_t)seconds};
    time.tv_nsec = (long)((seconds - (double)time.tv_sec) * 1e9);
    return time;
}

/* A condition whose timed waits are by shd_now()'s clock. */
static inline void shd_cond_init(pthread_cond_t *cond) {
    pthread_condattr_t monotonic;
    pthread_condattr_init(&monotonic);
    pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
    pthread_cond_init(cond, &monotonic);
    pthread_condattr_destroy(&monotonic);
}
