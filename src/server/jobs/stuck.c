#include "stuck.h"

#include <assert.h>
#include <math.h>
#include <stdio.h>

#include "base/clock.h"
#include "server/ops/log.h"

/* Seconds that a worker may take to notice. */
static const double grace = 1;

static void log_worker(const char *what, shd_log_level level, const shd_watched *watched) {
    char seconds[32];
    shd_log line;
    snprintf(seconds, sizeof seconds, "%.1f", shd_now() - watched->since);
    shd_log_begin(&line, level, what);
    shd_log_text(&line, "request", watched->id);
    shd_log_text(&line, "seconds-since-cancelled", seconds);
    shd_log_end(&line);
}

void shd_stuck_watch(shd_watched *ring, shd_watched *watched, const char *id) {
    assert(!watched->next);
    *watched = (shd_watched){ring->previous, ring, id, shd_now(), false};
    ring->previous = ring->previous->next = watched;
}

void shd_stuck_forget(shd_watched *watched) {
    if (!watched->next) return;
    watched->previous->next = watched->next;
    watched->next->previous = watched->previous;
    watched->next = watched->previous = NULL;
    if (watched->told) log_worker("worker-released", SHD_LOG_WARNING, watched);
}

size_t shd_stuck_tell(shd_watched *ring, double *next) {
    const double now = shd_now();
    size_t held = 0;
    shd_watched *w = ring->next;
    for (; w != ring && w->since + grace <= now; w = w->next, held++) {
        if (!w->told) log_worker("worker-stuck", SHD_LOG_ERROR, w);
        w->told = true;
    }
    *next = w == ring ? INFINITY : w->since + grace;
    return held;
}
