/* What the stages of tiles take: wall time, as reading the clock of processor time would take a
 * share of it. */
#ifndef SHD_RENDER_TILES_STOPWATCH_H
#define SHD_RENDER_TILES_STOPWATCH_H

#include "base/clock.h"
#include "shaded.h"

/* One thread's stages, of which each begins where the last one ended. */
typedef struct shd_stopwatch {
    shd_times times;
    double since;
} shd_stopwatch;

static inline void shd_begin(shd_stopwatch *watch) {
    watch->since = shd_now();
}

/* The time since then was `stage`'s, one of the watch's times. */
static inline void shd_end(shd_stopwatch *watch, double *stage) {
    const double now = shd_now();
    *stage += now - watch->since;
    watch->since = now;
}

#endif
