#include "render/rendering.h"

void shd_times_add(shd_times *sum, const shd_times *times) {
    sum->parse += times->parse;
    sum->plan += times->plan;
    sum->build += times->build;
    sum->visibility += times->visibility;
    sum->shade += times->shade;
    sum->shadow += times->shadow;
    sum->trace += times->trace;
    sum->color += times->color;
    sum->encode += times->encode;
}

/* ---- Stages. ---- */

typedef struct spread_loop {
    void (*run)(void *work, size_t index, unsigned slot);
    void *work;
    atomic_uint_least64_t nanoseconds; /* of threads that help */
} spread_loop;

static void run_spread(void *context, size_t index, unsigned slot) {
    spread_loop *loop = context;
    const double began = slot ? shd_thread_seconds() : 0;
    loop->run(loop->work, index, slot);
    if (slot)
        atomic_fetch_add(&loop->nanoseconds, (uint64_t)((shd_thread_seconds() - began) * 1e9));
}

void shd_stage_spread(shd_rendering *r, size_t count,
                      void (*run)(void *work, size_t index, unsigned slot), void *work) {
    spread_loop loop = {.run = run, .work = work};
    r->beside -= shd_pool_for(r->engine->pool, count, run_spread, &loop);
    r->beside += 1e-9 * (double)atomic_load(&loop.nanoseconds);
}

/* ---- Failures. ---- */

shd_status shd_rendering_full(const shd_rendering *r, const char *what, shd_error *error) {
    return shd_fail(error, SHD_MEMORY, "/image",
                    "the limit `memory` (%llu bytes) is reached by this %s",
                    (unsigned long long)r->limits->memory, what);
}

shd_status shd_rendering_cancelled(shd_error *error) {
    return shd_fail(error, SHD_CANCELLED, "", "the render was cancelled");
}
