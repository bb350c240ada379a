/* Seconds of a clock that is read in 20 ns: stages of tiles are timed with it. */
#ifndef SHD_RENDER_CLOCK_H
#define SHD_RENDER_CLOCK_H

#include <time.h>

static inline double shd_wall_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

#endif
