/* Pixels of a drawing. Coverage of strokes is by distance from their middle line, which is their
 * share of a pixel but for its corners; that of areas by 16 lines a row, each exact across. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "image/draw_font.h"
#include "image/draw_list.h"

enum { LINES = 16, FINE = 256 };

typedef struct painter {
    int width, height;
    unsigned char *rgb;
    unsigned char *row; /* [width] coverage of the mark in the row */
    int *sums;          /* [width + 1] of areas, in LINES * FINE parts */
    int32_t *crossings; /* [room] of a polygon's edges with a line */
    int first, end;     /* what is set of the row */
    const atomic_bool *cancelled;
} painter;

static int hold_int(double x, int most) {
    return x <= 0 ? 0 : x >= most ? most : (int)x;
}

/* Grows what is set of the row to [first, end). */
static void clear_to(painter *p, int first, int end) {
    if (p->first >= p->end) {
        p->first = p->end = first;
    }
    if (first < p->first) {
        memset(p->row + first, 0, (size_t)(p->first - first));
        p->first = first;
    }
    if (end > p->end) {
        memset(p->row + p->end, 0, (size_t)(end - p->end));
        p->end = end;
    }
}

static void cover(painter *p, int x, double share) {
    const unsigned char parts = (unsigned char)(share * 255 + 0.5);
    if (parts > p->row[x]) p->row[x] = parts;
}

static double share_of(double distance, double half) {
    const double inside = (half > 0.5 ? half : 0.5) + 0.5 - distance;
    const double share = inside < 0 ? 0 : inside > 1 ? 1 : inside;
    return half < 0.5 ? share * 2 * half : share;
}

/* The row's share of a line with round ends. */
static void cover_segment(painter *p, int y, shd_point a, shd_point b, double half) {
    const double reach = (half > 0.5 ? half : 0.5) + 0.5, cy = y + 0.5;
    const double dx = b.x - a.x, dy = b.y - a.y, square = dx * dx + dy * dy;
    double from = 0, to = 1; /* the part of it that is near enough */
    if ((a.y < cy - reach && b.y < cy - reach) || (a.y > cy + reach && b.y > cy + reach)) return;
    if (fabs(dy) > 1e-9) {
        const double t0 = (cy - reach - a.y) / dy, t1 = (cy + reach - a.y) / dy;
        from = fmax(0, fmin(t0, t1));
        to = fmin(1, fmax(t0, t1));
    }
    const double x0 = a.x + from * dx, x1 = a.x + to * dx;
    const int first = hold_int(fmin(x0, x1) - reach, p->width);
    const int end = hold_int(fmax(x0, x1) + reach + 1, p->width);
    if (first >= end) return;
    clear_to(p, first, end);
    for (int x = first; x < end; x++) {
        const double px = x + 0.5 - a.x, py = cy - a.y;
        double t = square > 0 ? (px * dx + py * dy) / square : 0;
        t = t < 0 ? 0 : t > 1 ? 1 : t;
        const double ex = px - t * dx, ey = py - t * dy;
        cover(p, x, share_of(sqrt(ex * ex + ey * ey), half));
    }
}

static void blend_row(const painter *p, int y, const shd_ink *ink) {
    unsigned char *rgb = p->rgb + ((size_t)y * (size_t)p->width + (size_t)p->first) * 3;
    const int alpha = (int)(ink->alpha * 255 + 0.5);
    for (int x = p->first; x < p->end; x++, rgb += 3) {
        const int parts = p->row[x] * alpha; /* of 255 * 255 */
        for (int c = 0; c < 3 && parts; c++)
            rgb[c] =
                (unsigned char)((rgb[c] * (65025 - parts) + ink->rgb[c] * parts + 32512) / 65025);
    }
}

/* The rows that y from `top` to `bottom` may touch; false if the request is cancelled. */
static bool next_row(painter *p, int *y, double top, double bottom) {
    if (*y < 0) *y = hold_int(floor(top), p->height) - 1;
    p->first = p->end = 0;
    return ++*y < p->height && *y < bottom && !shd_is_cancelled(p->cancelled);
}

/* `ends` may be NULL: all is one line. */
static void paint_lines(painter *p, const shd_ink *ink, const shd_point *points, size_t count,
                        const bool *ends, double width) {
    double top = points[0].y, bottom = top;
    for (size_t i = 1; i < count; i++) {
        top = fmin(top, points[i].y);
        bottom = fmax(bottom, points[i].y);
    }
    const double reach = (width > 1 ? width : 1) / 2 + 0.5;
    for (int y = -1; next_row(p, &y, top - reach, bottom + reach);) {
        for (size_t i = 0; i < count; i++) {
            const bool alone = (ends ? ends[i] : i + 1 == count);
            if (alone && i && !(ends && ends[i - 1])) continue; /* the end of a longer line */
            cover_segment(p, y, points[i], points[alone ? i : i + 1], width / 2);
        }
        blend_row(p, y, ink);
    }
}

static void paint_round(painter *p, const shd_mark *mark, double scale) {
    const double cx = mark->points[0].x * scale, cy = mark->points[0].y * scale,
                 radius = mark->size * scale, half = mark->ink.width * scale / 2;
    const bool disc = mark->kind == SHD_MARK_DISC;
    const double reach = radius + (disc ? 0.5 : (half > 0.5 ? half : 0.5) + 0.5);
    for (int y = -1; next_row(p, &y, cy - reach, cy + reach);) {
        const double dy = y + 0.5 - cy, across = sqrt(fmax(0, reach * reach - dy * dy)) + 1;
        const int first = hold_int(cx - across, p->width), end = hold_int(cx + across, p->width);
        if (first >= end) continue;
        clear_to(p, first, end);
        for (int x = first; x < end; x++) {
            const double dx = x + 0.5 - cx, distance = sqrt(dx * dx + dy * dy);
            const double inside = radius + 0.5 - distance;
            cover(p, x,
                  !disc ? share_of(fabs(distance - radius), half)
                        : (inside < 0   ? 0
                           : inside > 1 ? 1
                                        : inside));
        }
        blend_row(p, y, &mark->ink);
    }
}

/* Adds the line from x0 to x1, in parts of FINE, to differences of sums: what a pixel has of it. */
static void add_span(painter *p, int32_t x0, int32_t x1) {
    const int32_t most = p->width * FINE;
    x0 = x0 < 0 ? 0 : x0 > most ? most : x0;
    x1 = x1 < 0 ? 0 : x1 > most ? most : x1;
    if (x0 >= x1) return;
    for (int x = x0 / FINE; x * FINE < x1; x++) {
        const int32_t left = x * FINE, right = left + FINE;
        p->sums[x] += (x1 < right ? x1 : right) - (x0 > left ? x0 : left);
    }
    if (p->first >= p->end) p->first = x0 / FINE, p->end = p->first;
    if (x0 / FINE < p->first) p->first = x0 / FINE;
    if ((x1 + FINE - 1) / FINE > p->end) p->end = (x1 + FINE - 1) / FINE;
}

static int compare_crossings(const void *a, const void *b) {
    const int32_t x = *(const int32_t *)a, y = *(const int32_t *)b;
    return (x > y) - (x < y);
}

static void cover_line(painter *p, const shd_mark *mark, double scale, double y) {
    size_t found = 0;
    for (size_t i = 0; i < mark->count; i++) {
        const shd_point *u = &mark->points[i], *v = &mark->points[i + 1 < mark->count ? i + 1 : 0];
        const double ay = u->y * scale, by = v->y * scale;
        if ((ay <= y) == (by <= y)) continue;
        const double x = (u->x + (v->x - u->x) * ((y - ay) / (by - ay))) * scale;
        const double held = x < -1 ? -1 : x > p->width + 1 ? p->width + 1 : x;
        p->crossings[found++] = (int32_t)floor(held * FINE + 0.5);
    }
    qsort(p->crossings, found, sizeof *p->crossings, compare_crossings);
    for (size_t i = 0; i + 1 < found; i += 2) add_span(p, p->crossings[i], p->crossings[i + 1]);
}

static void paint_polygon(painter *p, const shd_mark *mark, double scale) {
    double top = mark->points[0].y, bottom = top;
    for (size_t i = 1; i < mark->count; i++) {
        top = fmin(top, mark->points[i].y);
        bottom = fmax(bottom, mark->points[i].y);
    }
    for (int y = -1; next_row(p, &y, top * scale, bottom * scale);) {
        for (int line = 0; line < LINES; line++)
            cover_line(p, mark, scale, y + (line + 0.5) / LINES);
        for (int x = p->first; x < p->end; x++) {
            p->row[x] = (unsigned char)((p->sums[x] * 255 + LINES * FINE / 2) / (LINES * FINE));
            p->sums[x] = 0;
        }
        blend_row(p, y, &mark->ink);
    }
}

/* Strokes' middles are in the middles of pixels, as odd widths want it. */
static void paint_text(painter *p, const shd_mark *mark, double scale) {
    const shd_typeface face = shd_typeface_of(mark->size * scale);
    const double width = shd_text_width(mark->text, mark->size * scale) - face.stroke;
    const double back = mark->anchor == SHD_ANCHOR_START    ? 0
                        : mark->anchor == SHD_ANCHOR_MIDDLE ? width / 2
                                                            : width;
    double x = mark->points[0].x * scale, y = mark->points[0].y * scale;
    *(mark->upward ? &y : &x) += mark->upward ? back : -back;
    const shd_point base = {floor(x) + 0.5, floor(y - 0.5) + 0.5};
    const char *text = mark->text;
    shd_glyph glyph;
    for (double at = 0; shd_glyph_next(&face, &text, &glyph); at += glyph.advance) {
        for (size_t i = 0; i < glyph.count; i++) {
            const shd_point q = glyph.points[i];
            glyph.points[i] = mark->upward ? (shd_point){base.x + q.y, base.y - at - q.x}
                                           : (shd_point){base.x + at + q.x, base.y + q.y};
        }
        if (glyph.count)
            paint_lines(p, &mark->ink, glyph.points, glyph.count, glyph.ends, face.stroke);
    }
}

static void paint_line(painter *p, const shd_mark *mark, double scale, shd_point *scaled) {
    for (size_t i = 0; i < mark->count; i++)
        scaled[i] = (shd_point){mark->points[i].x * scale, mark->points[i].y * scale};
    paint_lines(p, &mark->ink, scaled, mark->count, NULL, mark->ink.width * scale);
}

static void paint_mark(painter *p, const shd_mark *mark, double scale, shd_point *scaled) {
    switch (mark->kind) {
    case SHD_MARK_LINE:
        paint_line(p, mark, scale, scaled);
        break;
    case SHD_MARK_POLYGON:
        paint_polygon(p, mark, scale);
        break;
    case SHD_MARK_CIRCLE:
    case SHD_MARK_DISC:
        paint_round(p, mark, scale);
        break;
    case SHD_MARK_TEXT:
        paint_text(p, mark, scale);
        break;
    }
}

bool shd_drawing_paint(const shd_drawing *drawing, double scale, int width, int height,
                       unsigned char *rgb, shd_arena *scratch, const atomic_bool *cancelled) {
    size_t longest = 1;
    for (const shd_mark *m = drawing->first; m; m = m->next)
        longest = m->count > longest ? m->count : longest;
    const shd_arena_mark here = shd_arena_mark_here(scratch);
    painter p = {.width = width, .height = height, .rgb = rgb, .cancelled = cancelled};
    p.row = shd_arena_alloc(scratch, (size_t)width, 1);
    p.sums = shd_arena_zalloc(scratch, (size_t)width + 1, sizeof *p.sums);
    p.crossings = shd_arena_alloc(scratch, longest, sizeof *p.crossings);
    shd_point *scaled = shd_arena_alloc(scratch, longest, sizeof *scaled);
    const bool enough = p.row && p.sums && p.crossings && scaled;
    for (const shd_mark *m = drawing->first; enough && m && !shd_is_cancelled(cancelled);
         m = m->next)
        paint_mark(&p, m, scale, scaled);
    shd_arena_return(scratch, here);
    return enough && !shd_is_cancelled(cancelled);
}
