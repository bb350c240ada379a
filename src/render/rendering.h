/* What the making of one picture works with: the story hands it down instead of the request. One
 * thread at a time has it and runs the stages. Loops on the pool may read all but its times. */
#pragma once

#include "base/clock.h"
#include "plan/plan.h"
#include "render/engine.h"

typedef struct shd_rendering {
    shd_engine *engine;
    shd_arena *arena;               /* of all that is made */
    const shd_limits *limits;       /* the request's */
    const atomic_bool *cancelled;   /* the request's flag */
    shd_color_lease **lease;        /* of the request's transforms */
    struct shd_held_table **tables; /* the request's, of microgeometries */
    const shd_plan *plan;           /* NULL until shd_rendering_plan */
    shd_times times;
    uint64_t saturated; /* values that were held in a sample's range */
    uint64_t clipped;   /* color samples of integer pictures that were */
    uint64_t rays;      /* mirrored, refracted and straight ones beyond the eye's */
    double cut;         /* the most that a sample's rays left out: see trace/bounce.h */
    /* How far linear components are off at most, by the paths that these rays took: 0 without any.
     * Samples that a path loses on an edge are not counted there, but here. */
    double ray_error;
    uint64_t ray_edges;
    const char *codec; /* what lossy formats lost under a budget, for Shaded-Codec; or NULL */
    /* The stage that runs, in processor seconds: the thread's clock when it began, and what other
     * threads did for it minus what this one did for other requests. */
    double began, beside;
} shd_rendering;

/* ---- Stages: each begins where the last one ended, whose time goes to one of r->times. ---- */

static inline void shd_stage_begin(shd_rendering *r) {
    r->began = shd_thread_seconds();
    r->beside = 0;
}

static inline void shd_stage_end(shd_rendering *r, double *stage) {
    const double began = r->began, beside = r->beside;
    shd_stage_begin(r);
    *stage += r->began - began + beside;
}

/* Calls run(work, index, slot) as shd_pool_for does. The time of every thread is the stage's. */
void shd_stage_spread(shd_rendering *r, size_t count,
                      void (*run)(void *work, size_t index, unsigned slot), void *work);

/* The same for tiles, on one of many threads. This is wall time: reading the clock of processor
 * time would take a noticeable share of it. */
typedef struct shd_stopwatch {
    shd_times times;
    double since;
} shd_stopwatch;

static inline void shd_begin(shd_stopwatch *watch) {
    watch->since = shd_now();
}

static inline void shd_end(shd_stopwatch *watch, double *stage) {
    const double now = shd_now();
    *stage += now - watch->since;
    watch->since = now;
}

/* Takes what shadows took out of the stage that it is in, and begins to count anew. */
static inline void shd_end_shadows(shd_stopwatch *watch, double *shadowed) {
    watch->times.shade -= *shadowed;
    watch->times.shadow += *shadowed;
    *shadowed = 0;
}

void shd_times_add(shd_times *sum, const shd_times *times);

/* How a stage fails: the arena gave nothing while `what` ("picture", "comparison") was made. */
shd_status shd_rendering_full(const shd_rendering *r, const char *what, shd_error *error);
shd_status shd_rendering_cancelled(shd_error *error);
