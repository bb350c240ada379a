/* What the stages of tiles take. It is wall time, because reading the clock of processor time would
 * take a noticeable share of it. */
#ifndef SHD_RENDER_STOPWATCH_H
#define SHD_RENDER_STOPWATCH_H

#include "base/clock.h"
#include "shaded.h"

/* One thread's stages. Each begins when the last one ended. */
typedef struct shd_stopwatch {
    shd_times times;
    double since;
} shd_stopwatch;

static inline void shd_begin(shd_stopwatch *watch) {
    watch->since = shd_now();
}

/* The time since then counts as `stage`, which is one of the watch's times. */
static inline void shd_end(shd_stopwatch *watch, double *stage) {
    const double now = shd_now();
    *stage += now - watch->since;
    watch->since = now;
}

/* Adds `times` to `sum`. */
static inline void shd_times_add(shd_times *sum, const shd_times *times) {
    sum->parse += times->parse;
    sum->plan += times->plan;
    sum->visibility += times->visibility;
    sum->shade += times->shade;
    sum->color += times->color;
    sum->encode += times->encode;
}

#endif
