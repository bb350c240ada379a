/* Seconds on the monotonic clock: for durations and deadlines, never for dates. Any thread. */
#ifndef SHD_SERVER_CLOCK_H
#define SHD_SERVER_CLOCK_H

#include <time.h>

static inline double shd_now(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static inline struct timespec shd_timespec(double seconds) {
    struct timespec time = {.tv_sec = (time_t)seconds};
    time.tv_nsec = (long)((seconds - (double)time.tv_sec) * 1e9);
    return time;
}

#endif
