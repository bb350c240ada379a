#include "render/tell/lobe_plot.h"

#include <math.h>
#include <stdio.h>

#define DEGREE (SHD_PI / 180)

static const shd_ink BLACK = {{34, 38, 46}, 1, 1.6}, FAINT = {{34, 38, 46}, 0.25, 1},
                     QUIET = {{90, 96, 108}, 1, 1}, LIGHT = {{214, 138, 0}, 1, 2.2};
static const unsigned char CHANNELS[3][3] = {{206, 44, 44}, {26, 140, 66}, {40, 88, 214}};

/* The ink of a channel; of all three if they are equal. */
static shd_ink ink_of(int channel, bool grey) {
    if (grey) return (shd_ink){{34, 38, 46}, 1, 2};
    const unsigned char *rgb = CHANNELS[channel];
    return (shd_ink){{rgb[0], rgb[1], rgb[2]}, 0.9, 2};
}

enum { STEPS = 720 }; /* of the half circle */

/* pi f_r toward `view` degrees from the normal, which is negative on the light's side. */
static void lobe_at(const shd_reflectance *r, double angle, double view, double out[3]) {
    shd_reflectance_at(r, shd_polar(angle * DEGREE, SHD_PI),
                       shd_polar(fabs(view) * DEGREE, view < 0 ? SHD_PI : 0), out);
    for (int c = 0; c < 3; c++) out[c] *= SHD_PI;
}

/* 1, 2 or 5 times a power of ten that is at least `value`. */
static double round_up(double value) {
    const double power = pow(10, floor(log10(value)));
    return value <= power * 1.0001 ? power
           : value <= 2 * power    ? 2 * power
           : value <= 5 * power    ? 5 * power
                                   : 10 * power;
}

static void print_number(char *text, size_t size, double value) {
    snprintf(text, size, "%.3g", value);
}

static void draw_rings(shd_drawing *d, double x, double y, double radius, double most) {
    for (int ring = 1; ring <= 2; ring++) {
        const double size = radius * ring / 2;
        shd_point arc[91];
        for (int i = 0; i <= 90; i++)
            arc[i] = (shd_point){x + size * cos(2 * i * DEGREE), y - size * sin(2 * i * DEGREE)};
        shd_draw_line(d, FAINT, arc, 91, false);
        char text[32];
        print_number(text, sizeof text, most * ring / 2);
        shd_draw_text(d, QUIET, x + size, y + 15, 12, SHD_ANCHOR_MIDDLE, text);
    }
    shd_draw_segment(d, BLACK, x - radius - 10, y, x + radius + 10, y);
    shd_draw_segment(d, FAINT, x, y, x, y - radius - 6);
    shd_draw_text(d, QUIET, x + 5, y - radius - 8, 13, SHD_ANCHOR_START, "N");
}

static void draw_arrow(shd_drawing *d, shd_ink ink, double x, double y, double angle, double from,
                       double to, const char *name) {
    const double sine = sin(angle * DEGREE), cosine = cos(angle * DEGREE);
    const double x0 = x + from * sine, y0 = y - from * cosine, x1 = x + to * sine,
                 y1 = y - to * cosine;
    const double back = from > to ? 1 : -1, head = 9;
    shd_draw_segment(d, ink, x0, y0, x1, y1);
    for (int side = -1; side <= 1; side += 2) {
        const double turn = angle * DEGREE + side * 0.4;
        shd_draw_segment(d, ink, x1, y1, x1 + back * head * sin(turn),
                         y1 - back * head * cos(turn));
    }
    const double end = (from > to ? from : to) + 12;
    shd_draw_text(d, ink, x + end * sine, y - end * cosine + 4, 13, SHD_ANCHOR_MIDDLE, name);
}

static bool is_grey(const shd_reflectance *r) {
    for (size_t i = 0; i < SHD_ALBEDO_ANGLES; i++)
        for (int c = 1; c < 3; c++)
            if (fabs(r->albedo[i][c] - r->albedo[i][0]) > 1e-6) return false;
    return true;
}

static void draw_polar(shd_drawing *d, double x, double y, const shd_reflectance *r, double angle) {
    const double radius = 170;
    const bool grey = is_grey(r);
    double most = 0;
    for (int i = 0; i <= STEPS; i++) {
        double f[3];
        lobe_at(r, angle, -90 + 180.0 * i / STEPS, f);
        for (int c = 0; c < 3; c++) most = fmax(most, f[c]);
    }
    most = most > 0 ? round_up(most) : 1;
    draw_rings(d, x, y, radius, most);
    for (int c = 0; c < (grey ? 1 : 3); c++) {
        shd_point points[STEPS + 1];
        for (int i = 0; i <= STEPS; i++) {
            double f[3];
            const double view = -90 + 180.0 * i / STEPS;
            lobe_at(r, angle, view, f);
            const double size = radius * f[c] / most;
            points[i] = (shd_point){x + size * sin(view * DEGREE), y - size * cos(view * DEGREE)};
        }
        shd_draw_line(d, ink_of(c, grey), points, STEPS + 1, true);
    }
    draw_arrow(d, LIGHT, x, y, -angle, radius + 4, 24, "L");
    const shd_ink mirror = {{90, 96, 108}, 0.8, 1.2};
    draw_arrow(d, mirror, x, y, angle, 0, radius + 4, "R");
}

static void draw_albedo(shd_drawing *d, double x, double y, const shd_reflectance *r) {
    const double width = 360, height = 130;
    const bool grey = is_grey(r);
    double most = 1;
    for (size_t i = 0; i < SHD_ALBEDO_ANGLES; i++)
        for (int c = 0; c < 3; c++) most = fmax(most, r->albedo[i][c]);
    most = most > 1.0001 ? round_up(most) : 1;
    for (int tick = 0; tick <= 90; tick += 30) {
        char text[16];
        const double at = x + width * tick / 90;
        shd_draw_segment(d, FAINT, at, y, at, y - height);
        snprintf(text, sizeof text, "%d°", tick);
        shd_draw_text(d, QUIET, at, y + 16, 12, SHD_ANCHOR_MIDDLE, text);
    }
    shd_draw_segment(d, BLACK, x, y, x + width, y);
    const double one = y - height / most;
    shd_draw_segment(d, FAINT, x, one, x + width, one);
    shd_draw_text(d, QUIET, x - 6, one + 4, 12, SHD_ANCHOR_END, "1");
    if (most > 1) {
        char text[32];
        print_number(text, sizeof text, most);
        shd_draw_text(d, QUIET, x - 6, y - height + 4, 12, SHD_ANCHOR_END, text);
    }
    for (int c = 0; c < (grey ? 1 : 3); c++) {
        shd_point points[SHD_ALBEDO_ANGLES];
        for (size_t i = 0; i < SHD_ALBEDO_ANGLES; i++)
            points[i] = (shd_point){x + width * shd_albedo_angles[i] / 90,
                                    y - height * fmax(r->albedo[i][c], 0) / most};
        shd_draw_line(d, ink_of(c, grey), points, SHD_ALBEDO_ANGLES, false);
    }
    shd_draw_text(d, QUIET, x, y - height - 10, 12, SHD_ANCHOR_START,
                  "share of light sent on, by its angle from N");
}

void shd_draw_lobe(shd_drawing *drawing, double x, double y, const shd_reflectance *r,
                   const char *name, double angle) {
    char title[96], told[64];
    const shd_ink paper = {{255, 255, 255}, 1, 1};
    shd_draw_box(drawing, paper, x, y, SHD_LOBE_PLOT_WIDTH, SHD_LOBE_PLOT_HEIGHT);
    snprintf(title, sizeof title, "%.40s%s%s", name, *name ? ", " : "",
             shd_model_names[r->material->model]);
    shd_draw_text(drawing, BLACK, x + 24, y + 32, 17, SHD_ANCHOR_START, title);
    snprintf(told, sizeof told, "pi f_r in the plane of incidence, light at %.0f°", angle);
    shd_draw_text(drawing, QUIET, x + 24, y + 52, 12, SHD_ANCHOR_START, told);
    draw_polar(drawing, x + SHD_LOBE_PLOT_WIDTH / 2.0, y + 286, r, angle);
    draw_albedo(drawing, x + 44, y + 482, r);
}
