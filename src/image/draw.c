#include "image/draw_list.h"

#include <string.h>

shd_drawing *shd_drawing_new(shd_arena *arena, double width, double height) {
    shd_drawing *drawing = shd_arena_alloc(arena, 1, sizeof *drawing);
    if (!drawing) return NULL;
    *drawing = (shd_drawing){.arena = arena, .width = width, .height = height};
    drawing->last = &drawing->first;
    return drawing;
}

bool shd_drawing_full(const shd_drawing *drawing) {
    return drawing->full;
}

/* With the mark and its points in one piece of memory: an arena's pieces are at least 64 bytes. */
static shd_mark *add_mark(shd_drawing *drawing, shd_mark_kind kind, shd_ink ink,
                          const shd_point *points, size_t count, bool closed) {
    const size_t all = count + closed;
    shd_mark *mark = shd_arena_alloc(drawing->arena, 1, sizeof *mark + all * sizeof *points);
    if (!mark) {
        drawing->full = true;
        return NULL;
    }
    *mark = (shd_mark){
        .kind = kind, .ink = ink, .points = (shd_point *)(void *)(mark + 1), .count = all};
    memcpy(mark->points, points, count * sizeof *points);
    if (closed) mark->points[count] = points[0];
    *drawing->last = mark;
    drawing->last = &mark->next;
    return mark;
}

void shd_draw_line(shd_drawing *drawing, shd_ink ink, const shd_point *points, size_t count,
                   bool closed) {
    add_mark(drawing, SHD_MARK_LINE, ink, points, count, closed);
}

void shd_draw_segment(shd_drawing *drawing, shd_ink ink, double x0, double y0, double x1,
                      double y1) {
    const shd_point points[2] = {{x0, y0}, {x1, y1}};
    add_mark(drawing, SHD_MARK_LINE, ink, points, 2, false);
}

void shd_draw_polygon(shd_drawing *drawing, shd_ink ink, const shd_point *points, size_t count) {
    add_mark(drawing, SHD_MARK_POLYGON, ink, points, count, false);
}

void shd_draw_box(shd_drawing *drawing, shd_ink ink, double x, double y, double width,
                  double height) {
    const shd_point points[4] = {{x, y}, {x + width, y}, {x + width, y + height}, {x, y + height}};
    add_mark(drawing, SHD_MARK_POLYGON, ink, points, 4, false);
}

static void add_round(shd_drawing *drawing, shd_mark_kind kind, shd_ink ink, double x, double y,
                      double radius) {
    const shd_point middle = {x, y};
    shd_mark *mark = add_mark(drawing, kind, ink, &middle, 1, false);
    if (mark) mark->size = radius;
}

void shd_draw_circle(shd_drawing *drawing, shd_ink ink, double x, double y, double radius) {
    add_round(drawing, SHD_MARK_CIRCLE, ink, x, y, radius);
}

void shd_draw_disc(shd_drawing *drawing, shd_ink ink, double x, double y, double radius) {
    add_round(drawing, SHD_MARK_DISC, ink, x, y, radius);
}

static void add_text(shd_drawing *drawing, shd_ink ink, shd_point place, double size,
                     shd_anchor anchor, bool upward, const char *text) {
    const char *copy = shd_arena_strdup(drawing->arena, text);
    shd_mark *mark = copy ? add_mark(drawing, SHD_MARK_TEXT, ink, &place, 1, false) : NULL;
    drawing->full = drawing->full || !mark;
    if (!mark) return;
    mark->size = size;
    mark->anchor = anchor;
    mark->upward = upward;
    mark->text = copy;
}

void shd_draw_text(shd_drawing *drawing, shd_ink ink, double x, double y, double size,
                   shd_anchor anchor, const char *text) {
    add_text(drawing, ink, (shd_point){x, y}, size, anchor, false, text);
}

void shd_draw_text_upward(shd_drawing *drawing, shd_ink ink, double x, double y, double size,
                          shd_anchor anchor, const char *text) {
    add_text(drawing, ink, (shd_point){x, y}, size, anchor, true, text);
}
