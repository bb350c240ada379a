/* Seconds of a clock that is read in 20 to 50 ns: stages of tiles are timed with it. */
#ifndef SHD_RENDER_CLOCK_H
#define SHD_RENDER_CLOCK_H

#include <time.h>

#include "shaded.h"

static inline double shd_wall_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* One thread's stages, of which each begins where the last one ended. */
typedef struct shd_stopwatch {
    shd_times times;
    double since;
} shd_stopwatch;

static inline void shd_begin(shd_stopwatch *watch) {
    watch->since = shd_wall_seconds();
}

/* The time since then was `stage`'s, one of the watch's times. */
static inline void shd_end(shd_stopwatch *watch, double *stage) {
    const double now = shd_wall_seconds();
    *stage += now - watch->since;
    watch->since = now;
}

#endif
