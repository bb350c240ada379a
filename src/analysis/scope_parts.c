#include "analysis/scope_parts.h"

#include <math.h>

bool shd_scope_sees(const shd_scoped *scoped, size_t pixel) {
    const float *at = scoped->rgba + 4 * pixel;
    return at[3] > 0 && isfinite(at[0]) && isfinite(at[1]) && isfinite(at[2]);
}

shd_frame shd_scope_frame(const shd_scoped *scoped, double text) {
    const double edge = text > 0 ? ceil(0.7 * text) : 0, left = text > 0 ? ceil(2.6 * text) : 0,
                 low = text > 0 ? ceil(1.8 * text) : 0;
    return (shd_frame){left, edge, scoped->width - left - edge, scoped->height - edge - low};
}

shd_ink shd_scope_line(const shd_trace_plot *plot) {
    return (shd_ink){{150, 160, 176}, 0.42, plot->width};
}

shd_ink shd_scope_faint(const shd_trace_plot *plot) {
    return (shd_ink){{150, 160, 176}, 0.2, plot->width};
}

void shd_scope_hit(shd_trace_plot *plot, double x, double y) {
    const shd_scoped *s = plot->scoped;
    if (!(x >= 0 && y >= 0 && x < s->width && y < s->height)) return;
    const size_t cell = (size_t)plot->cell, row = (size_t)y / cell * cell,
                 column = (size_t)x / cell * cell;
    plot->hits[row * (size_t)s->width + column]++;
}

void shd_scope_glow(shd_trace_plot *plot, int from, int to, const unsigned char color[3],
                    double cells) {
    const shd_scoped *s = plot->scoped;
    const double gain = plot->seen ? 1.5 * cells / (double)plot->seen : 0;
    for (int y = 0; y < s->height && !shd_is_cancelled(plot->cancelled); y++)
        for (int x = from; x < to; x++) {
            const size_t width = (size_t)s->width, at = (size_t)y * width + (size_t)x;
            const uint32_t hits = plot->hits[(size_t)(y / plot->cell * plot->cell) * width +
                                             (size_t)(x / plot->cell * plot->cell)];
            const double dose = gain * hits, glow = 0.25 + 0.75 * dose / (1 + dose);
            for (size_t c = 0; hits && c < 3; c++)
                plot->rgb[3 * at + c] =
                    (unsigned char)lround(plot->rgb[3 * at + c] * (1 - glow) + color[c] * glow);
        }
}
