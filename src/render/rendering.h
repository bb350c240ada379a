/* What the making of one picture works with. The story hands it down instead of the request. One
 * thread at a time has it, which runs the stages. Loops on the pool may read all but its times. */
#pragma once

#include "base/cancel.h"
#include "base/clock.h"
#include "plan/plan.h"
#include "render/engine.h"
#include "scene/scene.h"

typedef struct shd_rendering {
    shd_engine *engine;
    shd_arena *arena;             /* of all that is made */
    const shd_limits *limits;     /* the request's */
    const atomic_bool *cancelled; /* the request's flag */
    const shd_plan *plan;         /* NULL until shd_rendering_plan */
    shd_times times;
    uint64_t saturated; /* values that were held in a sample's range */
    /* The stage that runs, in processor seconds: the thread's clock when it began, and what other
     * threads did for it minus what this one did for other requests. */
    double began, beside;
} shd_rendering;

/* Another one for the same request, in an arena of its own: nothing is planned or counted yet. */
shd_rendering shd_rendering_beside(const shd_rendering *r, shd_arena *arena);

/* Adds the times and the saturated values of `part`. */
void shd_rendering_add(shd_rendering *whole, const shd_rendering *part);

/* ---- Stages: the next one begins where the last one ended. ---- */

static inline void shd_stage_begin(shd_rendering *r) {
    r->began = shd_thread_seconds();
    r->beside = 0;
}

/* `stage` is one of r->times. */
static inline void shd_stage_end(shd_rendering *r, double *stage) {
    const double began = r->began, beside = r->beside;
    shd_stage_begin(r);
    *stage += r->began - began + beside;
}

/* Calls run(work, index, slot) as shd_pool_for does. The time of every thread is the stage's. */
void shd_stage_spread(shd_rendering *r, size_t count,
                      void (*run)(void *work, size_t index, unsigned slot), void *work);

/* In the middle of a long stage: runs a small job that waits, if this one is large
 * (shd_pool_lend). */
void shd_stage_lend(shd_rendering *r);

/* The stages of tiles, on one of many threads. This is wall time, because reading the clock of
 * processor time would take a noticeable share of it. */
typedef struct shd_stopwatch {
    shd_times times;
    double since;
} shd_stopwatch;

static inline void shd_begin(shd_stopwatch *watch) {
    watch->since = shd_now();
}

/* `stage` is one of watch->times. The next one begins. */
static inline void shd_end(shd_stopwatch *watch, double *stage) {
    const double now = shd_now();
    *stage += now - watch->since;
    watch->since = now;
}

/* Adds `times` to `sum`. */
void shd_times_add(shd_times *sum, const shd_times *times);

/* ---- How a stage fails. ---- */

/* The arena gave nothing, while `what` ("picture", "comparison") was made. */
shd_status shd_rendering_full(const shd_rendering *r, const char *what, shd_error *error);

shd_status shd_rendering_cancelled(shd_error *error);
