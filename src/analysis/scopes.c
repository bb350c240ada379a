#include "analysis/scopes.h"

#include <math.h>
#include <string.h>

#include "analysis/scope_parts.h"

enum { LABELLED = 160, RULED = 48, ONE_CELL = 600 }; /* the shorter side, pixels */

static int shorter_side(const shd_scoped *scoped) {
    return scoped->width < scoped->height ? scoped->width : scoped->height;
}

/* At least 10 pixels; 0 if labels would be larger than what they tell. */
static double text_size(const shd_scoped *scoped) {
    const int least = shorter_side(scoped);
    return least < LABELLED ? 0 : floor(fmax(least / 32.0, 10));
}

static void count_seen(shd_trace_plot *plot) {
    const size_t pixels = (size_t)plot->scoped->width * (size_t)plot->scoped->height;
    for (size_t i = 0; i < pixels && !shd_is_cancelled_at(plot->cancelled, i); i++)
        plot->seen += shd_scope_sees(plot->scoped, i);
}

static bool paint_plot(shd_scope scope, shd_trace_plot *plot) {
    switch (scope) {
    case SHD_SCOPE_VECTOR:
        shd_scope_vector(plot);
        return true;
    case SHD_SCOPE_CHROMATICITY:
        shd_scope_chromaticity(plot);
        return true;
    case SHD_SCOPE_WAVEFORM:
    case SHD_SCOPE_PARADE:
        shd_scope_waveform(plot, scope == SHD_SCOPE_PARADE);
        return true;
    case SHD_SCOPE_HISTOGRAM:
        return shd_scope_histogram(plot);
    case SHD_SCOPE_FALSECOLOR:
        shd_scope_falsecolor(plot);
        return true;
    default:
        shd_scope_gamut(plot);
        return true;
    }
}

static bool has_hits(shd_scope scope) {
    return scope != SHD_SCOPE_HISTOGRAM && scope < SHD_SCOPE_FALSECOLOR;
}

size_t shd_scope_scratch(shd_scope scope, size_t pixels) {
    return has_hits(scope) ? pixels * sizeof(uint32_t) : 0;
}

bool shd_scope_paint(shd_scope scope, const shd_scoped *scoped, unsigned char *rgb,
                     shd_arena *scratch, const atomic_bool *cancelled) {
    static const unsigned char ground[3] = {16, 18, 22};
    const size_t pixels = (size_t)scoped->width * (size_t)scoped->height;
    shd_trace_plot plot = {.scoped = scoped,
                           .rgb = rgb,
                           .lines = shd_drawing_new(scratch, scoped->width, scoped->height),
                           .text = text_size(scoped),
                           .width = fmax(shorter_side(scoped) / (double)ONE_CELL, 1),
                           .bare = shorter_side(scoped) < RULED,
                           .cell = 1,
                           .scratch = scratch,
                           .cancelled = cancelled};
    if (has_hits(scope)) plot.hits = shd_arena_zalloc(scratch, pixels, sizeof *plot.hits);
    if (!plot.lines || (has_hits(scope) && !plot.hits)) return false;
    for (size_t i = 0; i < pixels; i++) memcpy(rgb + 3 * i, ground, sizeof ground);
    if (scope == SHD_SCOPE_VECTOR || scope == SHD_SCOPE_CHROMATICITY)
        plot.cell = 1 + shorter_side(scoped) / ONE_CELL;
    count_seen(&plot);
    return paint_plot(scope, &plot) && !shd_is_cancelled(cancelled) &&
           !shd_drawing_full(plot.lines) &&
           shd_drawing_paint(plot.lines, 1, scoped->width, scoped->height, rgb, scratch, cancelled);
}
