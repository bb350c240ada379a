/* Where colors are: NTSC's vectorscope, and the CIE 1976 chromaticity diagram. */
#include <math.h>
#include <stdio.h>

#include "analysis/axes.h"
#include "analysis/scope_parts.h"
#include "base/spectrum_tables.h"

#define DEGREE (3.14159265358979323846 / 180)

/* ---- I and Q ---- */

/* The angle of Q from B-Y, which NTSC's subcarrier has to the right: I is 90 degrees further. */
static const double Q_ANGLE = 33 * DEGREE;

/* The chroma of red and cyan at 100 %, hypot(0.60, 0.21), at this share of half the picture. */
static const double FULL_SHARE = 0.84, FULL_CHROMA = 0.6357;

static double vector_gain(int width, int height) {
    return FULL_SHARE * (width < height ? width : height) / 2 / FULL_CHROMA;
}

void shd_vectorscope_place(int width, int height, double i, double q, double *x, double *y) {
    const double gain = vector_gain(width, height);
    *x = width / 2.0 + gain * (q * cos(Q_ANGLE) - i * sin(Q_ANGLE));
    *y = height / 2.0 - gain * (q * sin(Q_ANGLE) + i * cos(Q_ANGLE));
}

static void chroma_of(const shd_scoped *scoped, const float *rgb, double *i, double *q) {
    double yiq[3] = {(double)rgb[0], (double)rgb[1], (double)rgb[2]};
    if (scoped->channels == SHD_RGB) shd_yiq_of(rgb, yiq);
    *i = yiq[1];
    *q = yiq[2];
}

/* A box around a bar's chroma: the amplitude's and the angle's tolerance. */
static void draw_target(shd_trace_plot *plot, shd_ink ink, const double middle[2], double share,
                        double turn) {
    const shd_scoped *s = plot->scoped;
    enum { STEPS = 6 };
    shd_point points[2 * (STEPS + 1)];
    for (int side = 0; side < 2; side++)
        for (int k = 0; k <= STEPS; k++) {
            const double size = side ? 1 + share : 1 - share,
                         angle = turn * (2.0 * k / STEPS - 1) * (side ? -1 : 1);
            const double i = size * (middle[0] * cos(angle) - middle[1] * sin(angle)),
                         q = size * (middle[0] * sin(angle) + middle[1] * cos(angle));
            shd_point *at = &points[side * (STEPS + 1) + k];
            shd_vectorscope_place(s->width, s->height, i, q, &at->x, &at->y);
        }
    shd_draw_line(plot->lines, ink, points, 2 * (STEPS + 1), true);
}

/* The boxes of color bars at 75 %: within 2.5 degrees and 2.5 IRE, and, as receivers are judged,
 * within 10 degrees and 20 % (NTSC, FCC 1953). */
static void draw_targets(shd_trace_plot *plot) {
    static const struct {
        float rgb[3];
        const char *name;
    } bars[] = {{{1, 0, 0}, "R"},  {{1, 0, 1}, "Mg"}, {{0, 0, 1}, "B"},
                {{0, 1, 1}, "Cy"}, {{0, 1, 0}, "G"},  {{1, 1, 0}, "Yl"}};
    const shd_scoped *s = plot->scoped;
    for (size_t k = 0; k < sizeof bars / sizeof bars[0]; k++) {
        double yiq[3], x, y;
        shd_yiq_of(bars[k].rgb, yiq);
        const double middle[2] = {0.75 * yiq[1], 0.75 * yiq[2]}, size = hypot(middle[0], middle[1]);
        draw_target(plot, shd_scope_line(plot), middle, 0.025 / size, 2.5 * DEGREE);
        draw_target(plot, shd_scope_faint(plot), middle, 0.2, 10 * DEGREE);
        shd_vectorscope_place(s->width, s->height, 0.62 * middle[0], 0.62 * middle[1], &x, &y);
        if (plot->text > 0)
            shd_draw_text(plot->lines, SHD_SCOPE_TEXT, x, y + plot->text / 3, plot->text,
                          SHD_ANCHOR_MIDDLE, bars[k].name);
    }
}

static void draw_axis(shd_trace_plot *plot, double i, double q, const char *name) {
    const shd_scoped *s = plot->scoped;
    double x0, y0, x1, y1;
    shd_vectorscope_place(s->width, s->height, -i, -q, &x0, &y0);
    shd_vectorscope_place(s->width, s->height, i, q, &x1, &y1);
    shd_draw_segment(plot->lines, shd_scope_faint(plot), x0, y0, x1, y1);
    shd_vectorscope_place(s->width, s->height, 1.07 * i, 1.07 * q, &x1, &y1);
    if (plot->text > 0)
        shd_draw_text(plot->lines, SHD_SCOPE_TEXT, x1, y1 + plot->text / 3, plot->text,
                      SHD_ANCHOR_MIDDLE, name);
}

void shd_scope_vector(shd_trace_plot *plot) {
    static const unsigned char glow[3] = {120, 236, 168};
    const shd_scoped *s = plot->scoped;
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    for (size_t k = 0; k < pixels && !shd_is_cancelled_at(plot->cancelled, k); k++) {
        double i, q, x, y;
        if (!shd_scope_sees(s, k)) continue;
        chroma_of(s, s->rgba + 4 * k, &i, &q);
        shd_vectorscope_place(s->width, s->height, i, q, &x, &y);
        shd_scope_hit(plot, x, y);
    }
    const double radius = vector_gain(s->width, s->height) * FULL_CHROMA;
    shd_scope_glow(plot, 0, s->width, glow, 0.1 * radius * radius / (plot->cell * plot->cell));
    if (plot->bare) return;
    for (int k = 1; k <= 4; k++)
        shd_draw_circle(plot->lines, k == 4 ? shd_scope_line(plot) : shd_scope_faint(plot),
                        s->width / 2.0, s->height / 2.0, radius * k / 4);
    draw_axis(plot, FULL_CHROMA, 0, "I");
    draw_axis(plot, 0, FULL_CHROMA, "Q");
    draw_targets(plot);
}

/* ---- u'v' ---- */

enum { LOCUS = 33, LOCUS_FROM = 380, LOCUS_STEP = 10 }; /* to 700 nm */

/* The place of light of one wavelength, as the CIE 1931 observer sees it. */
static void find_locus(size_t k, double uv[2]) {
    const size_t i = (LOCUS_FROM + LOCUS_STEP * k - SHD_WIDE_FROM) / SHD_TABLE_STEP;
    const double x = shd_observer[0][i], y = shd_observer[1][i], z = shd_observer[2][i],
                 sum = x + 15 * y + 3 * z;
    uv[0] = 4 * x / sum;
    uv[1] = 9 * y / sum;
}

/* u' from -0.03 to 0.66 and v' from -0.03 to 0.63, as large as fits, in the middle. */
void shd_chromaticity_place(int width, int height, const double uv[2], double *x, double *y) {
    const double gain = fmin(width / 0.69, height / 0.66);
    *x = width / 2.0 + gain * (uv[0] - 0.315);
    *y = height / 2.0 - gain * (uv[1] - 0.3);
}

static void draw_places(shd_trace_plot *plot, shd_ink ink, const double (*uv)[2], size_t count) {
    shd_point points[LOCUS];
    for (size_t k = 0; k < count; k++)
        shd_chromaticity_place(plot->scoped->width, plot->scoped->height, uv[k], &points[k].x,
                               &points[k].y);
    shd_draw_line(plot->lines, ink, points, count, true);
}

static double uv_gain(const shd_scoped *s) {
    return fmin(s->width / 0.69, s->height / 0.66);
}

static void draw_grid(shd_trace_plot *plot) {
    const shd_scoped *s = plot->scoped;
    const double gain = uv_gain(s);
    for (int k = 0; k <= 6; k++) {
        const double at = k / 10.0;
        const double ends[4][2] = {{at, 0}, {at, 0.6}, {0, at}, {0.62, at}};
        double x[4], y[4];
        char text[8];
        for (int e = 0; e < 4; e++)
            shd_chromaticity_place(s->width, s->height, ends[e], &x[e], &y[e]);
        shd_draw_segment(plot->lines, shd_scope_faint(plot), x[0], y[0], x[1], y[1]);
        shd_draw_segment(plot->lines, shd_scope_faint(plot), x[2], y[2], x[3], y[3]);
        if (!(plot->text > 0) || k == 0 || 0.03 * gain < plot->text) continue;
        snprintf(text, sizeof text, "%.1f", at);
        shd_draw_text(plot->lines, SHD_SCOPE_TEXT, x[0], y[0] + 1.2 * plot->text, plot->text,
                      SHD_ANCHOR_MIDDLE, text);
        shd_draw_text(plot->lines, SHD_SCOPE_TEXT, x[2] - 4, y[2] + plot->text / 3, plot->text,
                      SHD_ANCHOR_END, text);
    }
}

void shd_scope_chromaticity(shd_trace_plot *plot) {
    static const unsigned char glow[3] = {120, 236, 168};
    const shd_scoped *s = plot->scoped;
    const size_t pixels = (size_t)s->width * (size_t)s->height;
    for (size_t k = 0; k < pixels && !shd_is_cancelled_at(plot->cancelled, k); k++) {
        const double uv[2] = {(double)s->places[k][0], (double)s->places[k][1]};
        double x, y;
        if (isnan(uv[0]) || !shd_scope_sees(s, k)) continue;
        shd_chromaticity_place(s->width, s->height, uv, &x, &y);
        shd_scope_hit(plot, x, y);
    }
    const double gain = uv_gain(s);
    shd_scope_glow(plot, 0, s->width, glow, 0.01 * gain * gain / (plot->cell * plot->cell));
    if (plot->bare) return;
    const shd_ink gold = {{236, 200, 120}, 0.8, 1.2 * plot->width};
    double locus[LOCUS][2];
    for (size_t k = 0; k < LOCUS; k++) find_locus(k, locus[k]);
    draw_grid(plot);
    draw_places(plot, shd_scope_line(plot), (const double(*)[2])locus, LOCUS);
    draw_places(plot, gold, s->primaries, 3);
    double x, y;
    shd_chromaticity_place(s->width, s->height, s->primaries[3], &x, &y);
    shd_draw_circle(plot->lines, gold, x, y, 3 * plot->width);
}
