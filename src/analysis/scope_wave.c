/* How bright it is, and where: waveform, parade and histogram. */
#include <math.h>
#include <stdio.h>

#include "analysis/scope_parts.h"

static const unsigned char GREY[3] = {206, 214, 224};
static const unsigned char CHANNELS[3][3] = {{255, 96, 88}, {96, 232, 120}, {104, 156, 255}};

/* Plots have room for 10 % beyond what can be displayed. What is farther is at the edge. */
static const double LOW = -0.1, HIGH = 1.1;

/* The values of what is displayed: from 0 to 1, or as wide around 0 for I and Q. */
static double level_of(const shd_scoped *scoped, int channel, double value) {
    return scoped->channels == SHD_YIQ && channel > 0 ? value / 1.2 + 0.5 : value;
}

static double held(double level) {
    return fmin(fmax(level, LOW), HIGH);
}

/* Luma, by the weights of Y: Rec. ITU-R BT.601 in NTSC's two digits. */
static double luma_of(const shd_scoped *scoped, const float *rgb) {
    if (scoped->channels == SHD_YIQ) return (double)rgb[0];
    return 0.30 * (double)rgb[0] + 0.59 * (double)rgb[1] + 0.11 * (double)rgb[2];
}

/* ---- By columns ---- */

static double height_of(shd_frame frame, double level) {
    return frame.y + frame.height * (HIGH - level) / (HIGH - LOW);
}

/* Counts a channel's values, or luma for -1, in a frame as wide as the picture is. */
static void count_levels(shd_trace_plot *plot, shd_frame frame, int channel) {
    const shd_scoped *s = plot->scoped;
    const size_t width = (size_t)s->width, pixels = width * (size_t)s->height;
    for (size_t k = 0; k < pixels && !shd_is_cancelled_at(plot->cancelled, k); k++) {
        const float *at = s->rgba + 4 * k;
        if (!shd_scope_sees(s, k)) continue;
        const double value =
            channel < 0 ? luma_of(s, at) : level_of(s, channel, (double)at[channel]);
        const double y = height_of(frame, held(value)), last = frame.y + frame.height - 1;
        shd_scope_hit(plot, frame.x + ((double)(k % width) + 0.5) / (double)width * frame.width,
                      fmin(y, last));
    }
}

static void draw_levels(shd_trace_plot *plot, shd_frame frame, bool labels) {
    if (plot->bare) return;
    for (int k = 0; k <= 4; k++) {
        const double level = k / 4.0, y = floor(height_of(frame, level)) + 0.5;
        char text[8];
        shd_draw_segment(plot->lines,
                         k == 0 || k == 4 ? shd_scope_line(plot) : shd_scope_faint(plot), frame.x,
                         y, frame.x + frame.width, y);
        if (!labels) continue;
        snprintf(text, sizeof text, "%d", 25 * k);
        shd_draw_text(plot->lines, SHD_SCOPE_TEXT, frame.x - 0.4 * plot->text, y + plot->text / 3,
                      plot->text, SHD_ANCHOR_END, text);
    }
}

static void draw_name(shd_trace_plot *plot, shd_frame frame, const char *name) {
    if (plot->text > 0)
        shd_draw_text(plot->lines, SHD_SCOPE_TEXT, frame.x + frame.width / 2,
                      frame.y + frame.height + 1.3 * plot->text, plot->text, SHD_ANCHOR_MIDDLE,
                      name);
}

void shd_scope_waveform(shd_trace_plot *plot, bool parade) {
    static const char *const rgb[] = {"R", "G", "B"}, *const yiq[] = {"Y", "I", "Q"};
    const shd_scoped *s = plot->scoped;
    const shd_frame frame = shd_scope_frame(s, plot->text);
    const int parts = parade ? 3 : 1;
    for (int c = 0; c < parts; c++) {
        const double width = frame.width / parts, gap = parade && width > 40 ? width / 40 : 0;
        const shd_frame part = {frame.x + c * width + gap, frame.y, width - 2 * gap, frame.height};
        const bool colored = parade && s->channels == SHD_RGB;
        count_levels(plot, part, parade ? c : -1);
        shd_scope_glow(plot, (int)floor(part.x), (int)fmin(ceil(part.x + part.width), s->width),
                       colored ? CHANNELS[c] : GREY, part.width * part.height / 12);
        draw_levels(plot, part, plot->text > 0 && c == 0);
        draw_name(plot, part, !parade ? "Y" : s->channels == SHD_RGB ? rgb[c] : yiq[c]);
    }
}

/* ---- The histogram ---- */

enum { BINS = 256 };

/* Bins of equal width from 0 to 1; what is beyond is in the first and the last. */
static void count_bins(shd_trace_plot *plot, uint64_t bins[3][BINS]) {
    const shd_scoped *s = plot->scoped;
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    for (size_t k = 0; k < pixels && !shd_is_cancelled_at(plot->cancelled, k); k++) {
        if (!shd_scope_sees(s, k)) continue;
        for (int c = 0; c < 3; c++) {
            const double level = level_of(s, c, (double)s->rgba[4 * k + (size_t)c]);
            bins[c][(size_t)fmin(fmax(floor(level * BINS), 0), BINS - 1)]++;
        }
    }
}

/* The largest of the bins within: what is clipped would make all others low. */
static uint64_t largest_of(uint64_t bins[3][BINS]) {
    uint64_t most = 1;
    for (int c = 0; c < 3; c++)
        for (size_t b = 1; b + 1 < BINS; b++) most = bins[c][b] > most ? bins[c][b] : most;
    return most;
}

/* Heights are roots, so that a few pixels can be seen beside many. Channels lie over each other,
 * and what all of them have is white. */
static void fill_bins(shd_trace_plot *plot, shd_frame frame, uint64_t bins[3][BINS]) {
    const shd_scoped *s = plot->scoped;
    const double most = (double)largest_of(bins);
    const int right = (int)(frame.x + frame.width), bottom = (int)(frame.y + frame.height);
    for (int x = (int)frame.x; x < right; x++) {
        const size_t bin = (size_t)((x - frame.x) / frame.width * BINS);
        for (int c = 0; c < 3; c++) {
            const double share = sqrt(fmin((double)bins[c][bin] / most, 1));
            const int top = bottom - (int)ceil(share * frame.height);
            for (int y = top; y < bottom; y++) {
                unsigned char *at = plot->rgb + 3 * ((size_t)y * (size_t)s->width + (size_t)x);
                for (int k = 0; k < 3; k++) {
                    const int sum = at[k] + (s->channels == SHD_RGB ? CHANNELS[c][k] : 90) * 5 / 8;
                    at[k] = (unsigned char)(sum < 236 ? sum : 236);
                }
            }
        }
    }
}

bool shd_scope_histogram(shd_trace_plot *plot) {
    const shd_frame frame = shd_scope_frame(plot->scoped, plot->text);
    uint64_t(*bins)[BINS] = shd_arena_zalloc(plot->scratch, 3, sizeof *bins);
    if (!bins) return false;
    count_bins(plot, bins);
    fill_bins(plot, frame, bins);
    if (plot->bare) return true;
    for (int k = 0; k <= 4; k++) {
        const double x = floor(frame.x + frame.width * k / 4) + (k < 4 ? 0.5 : -0.5);
        char text[8];
        shd_draw_segment(plot->lines,
                         k == 0 || k == 4 ? shd_scope_line(plot) : shd_scope_faint(plot), x,
                         frame.y, x, frame.y + frame.height);
        if (!(plot->text > 0)) continue;
        snprintf(text, sizeof text, "%d", 25 * k);
        shd_draw_text(plot->lines, SHD_SCOPE_TEXT, x, frame.y + frame.height + 1.3 * plot->text,
                      plot->text, k == 4 ? SHD_ANCHOR_END : SHD_ANCHOR_MIDDLE, text);
    }
    return true;
}
