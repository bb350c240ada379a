/* The picture itself, marked: false color by stops, and what is out of gamut. */
#include <math.h>
#include <string.h>

#include "analysis/scope_parts.h"

enum { STOPS = 7 }; /* below and above mid grey; the last ones are all beyond */

/* From the dark to the light, mid grey in the middle. */
static const unsigned char bands[2 * STOPS + 1][3] = {
    {20, 10, 30},   {62, 26, 104},  {66, 54, 158},   {50, 90, 196},   {38, 128, 190},
    {30, 152, 156}, {44, 164, 100}, {128, 128, 128}, {166, 178, 62},  {214, 182, 46},
    {240, 152, 42}, {238, 108, 54}, {222, 58, 60},   {240, 116, 156}, {255, 255, 255}};

/* A band is a stop wide; mid grey is in the middle of its own. */
static int band_of(float stops) {
    const double band = floor((double)stops + 0.5);
    return STOPS + (int)fmin(fmax(band, -STOPS), STOPS);
}

static void paint_pixel(const shd_trace_plot *plot, size_t pixel, const unsigned char rgb[3]) {
    memcpy(plot->rgb + 3 * pixel, rgb, 3);
}

static unsigned char mark_at(const shd_scoped *scoped, size_t pixel) {
    const size_t x = pixel % (size_t)scoped->width, y = pixel / (size_t)scoped->width;
    return (x / 4 + y / 4) % 2 ? 34 : 26;
}

static const unsigned char NOT_FINITE[3] = {255, 0, 255};

/* Where nothing is displayed there is a dark checkerboard. */
static bool paint_unseen(const shd_trace_plot *plot, size_t k) {
    if (shd_scope_sees(plot->scoped, k)) return false;
    if (plot->scoped->rgba[4 * k + 3] > 0) {
        paint_pixel(plot, k, NOT_FINITE);
    } else {
        const unsigned char mark = mark_at(plot->scoped, k);
        paint_pixel(plot, k, (const unsigned char[3]){mark, mark, mark});
    }
    return true;
}

/* ---- Stops ---- */

/* Boxes of colors side by side along the picture's lower edge, if there is room for their names. */
static void draw_legend(shd_trace_plot *plot, const unsigned char (*colors)[3],
                        const char *const *names, int count) {
    const shd_scoped *s = plot->scoped;
    const double size = plot->text, high = ceil(1.5 * size), y = s->height - high;
    const double step = (double)s->width / count;
    if (!(size > 0)) return;
    for (int k = 0; k < count; k++)
        if (shd_text_width(names[k], size) > step) return;
    for (int k = 0; k < count; k++) {
        const unsigned char *c = colors[k];
        const unsigned char ink = c[0] * 0.3 + c[1] * 0.59 + c[2] * 0.11 > 120 ? 16 : 240;
        shd_draw_box(plot->lines, (shd_ink){{c[0], c[1], c[2]}, 1, 1}, floor(k * step), y,
                     ceil((k + 1) * step) - floor(k * step), high);
        shd_draw_text(plot->lines, (shd_ink){{ink, ink, ink}, 1, 1}, (k + 0.5) * step,
                      s->height - 0.4 * size, size, SHD_ANCHOR_MIDDLE, names[k]);
    }
}

void shd_scope_falsecolor(shd_trace_plot *plot) {
    static const char *const names[2 * STOPS + 1] = {
        "-7", "-6", "-5", "-4", "-3", "-2", "-1", "0 EV", "+1", "+2", "+3", "+4", "+5", "+6", "+7"};
    const shd_scoped *s = plot->scoped;
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    for (size_t k = 0; k < pixels && !shd_is_cancelled_at(plot->cancelled, k); k++) {
        if (paint_unseen(plot, k)) continue;
        if (isnan(s->stops[k]))
            paint_pixel(plot, k, NOT_FINITE);
        else
            paint_pixel(plot, k, bands[band_of(s->stops[k])]);
    }
    draw_legend(plot, bands, names, 2 * STOPS + 1);
}

/* ---- Gamut ---- */

static unsigned char grey_of(const float *at) {
    const double luma = 0.30 * (double)at[0] + 0.59 * (double)at[1] + 0.11 * (double)at[2];
    return (unsigned char)lround(40 + 150 * fmin(fmax(luma, 0), 1));
}

/* Red: above 1; blue: below 0; orange: both; magenta: not finite. Others are grey. */
void shd_scope_gamut(shd_trace_plot *plot) {
    static const char *const names[] = {"above 1", "below 0", "both", "not finite"};
    static const unsigned char legend[4][3] = {
        {238, 48, 44}, {40, 104, 255}, {255, 160, 0}, {255, 0, 255}};
    static const unsigned char marks[4][3] = {
        {0, 0, 0}, {238, 48, 44}, {40, 104, 255}, {255, 160, 0}};
    const shd_scoped *s = plot->scoped;
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    for (size_t k = 0; k < pixels && !shd_is_cancelled_at(plot->cancelled, k); k++) {
        const float *at = s->rgba + 4 * k;
        int mark = 0;
        if (paint_unseen(plot, k)) continue;
        for (int c = 0; c < 3; c++) mark |= (at[c] > 1 ? 1 : 0) | (at[c] < 0 ? 2 : 0);
        const unsigned char grey = grey_of(at);
        paint_pixel(plot, k, mark ? marks[mark] : (const unsigned char[3]){grey, grey, grey});
    }
    draw_legend(plot, legend, names, 4);
}
