/* SVG 1.1 of a drawing. Numbers have two digits after the point, and no locale. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "image/draw_list.h"

/* Runs twice: without room it only counts. */
typedef struct writer {
    char *text;
    size_t length;
} writer;

static void put(writer *w, const char *text) {
    const size_t length = strlen(text);
    if (w->text) memcpy(w->text + w->length, text, length);
    w->length += length;
}

static void put_number(writer *w, double value) {
    char text[32];
    const long long parts = llround(value * 100), whole = (parts < 0 ? -parts : parts) / 100,
                    rest = (parts < 0 ? -parts : parts) % 100;
    const char *sign = parts < 0 ? "-" : "";
    if (rest == 0)
        snprintf(text, sizeof text, "%s%lld", sign, whole);
    else if (rest % 10 == 0)
        snprintf(text, sizeof text, "%s%lld.%lld", sign, whole, rest / 10);
    else
        snprintf(text, sizeof text, "%s%lld.%02lld", sign, whole, rest);
    put(w, text);
}

static void put_attribute(writer *w, const char *name, double value) {
    put(w, " ");
    put(w, name);
    put(w, "=\"");
    put_number(w, value);
    put(w, "\"");
}

static void put_escaped(writer *w, const char *text) {
    for (; *text; text++) {
        const char one[2] = {*text, 0};
        put(w, *text == '&' ? "&amp;" : *text == '<' ? "&lt;" : *text == '>' ? "&gt;" : one);
    }
}

static void put_color(writer *w, const char *what, const shd_ink *ink) {
    char text[64];
    snprintf(text, sizeof text, " %s=\"#%02x%02x%02x\"", what, ink->rgb[0], ink->rgb[1],
             ink->rgb[2]);
    put(w, text);
    if (ink->alpha >= 1) return;
    put(w, " ");
    put(w, what);
    put(w, "-opacity=\"");
    put_number(w, ink->alpha);
    put(w, "\"");
}

static void put_stroke(writer *w, const shd_ink *ink) {
    put(w, " fill=\"none\"");
    put_color(w, "stroke", ink);
    put_attribute(w, "stroke-width", ink->width);
}

static void put_points(writer *w, const shd_mark *mark) {
    put(w, " points=\"");
    for (size_t i = 0; i < mark->count; i++) {
        if (i) put(w, " ");
        put_number(w, mark->points[i].x);
        put(w, ",");
        put_number(w, mark->points[i].y);
    }
    put(w, "\"");
}

static void put_text(writer *w, const shd_mark *mark) {
    static const char *const anchors[] = {"start", "middle", "end"};
    put(w, "<text");
    if (mark->upward) {
        put(w, " transform=\"translate(");
        put_number(w, mark->points[0].x);
        put(w, ",");
        put_number(w, mark->points[0].y);
        put(w, ") rotate(-90)\"");
    } else {
        put_attribute(w, "x", mark->points[0].x);
        put_attribute(w, "y", mark->points[0].y);
    }
    put_attribute(w, "font-size", mark->size);
    put(w, " text-anchor=\"");
    put(w, anchors[mark->anchor]);
    put(w, "\"");
    put_color(w, "fill", &mark->ink);
    put(w, ">");
    put_escaped(w, mark->text);
    put(w, "</text>\n");
}

static void put_mark(writer *w, const shd_mark *mark) {
    if (mark->kind == SHD_MARK_TEXT) {
        put_text(w, mark);
        return;
    }
    const bool is_dot = mark->kind == SHD_MARK_LINE && mark->count == 1;
    if (mark->kind == SHD_MARK_CIRCLE || mark->kind == SHD_MARK_DISC || is_dot) {
        put(w, "<circle");
        put_attribute(w, "cx", mark->points[0].x);
        put_attribute(w, "cy", mark->points[0].y);
        put_attribute(w, "r", is_dot ? mark->ink.width / 2 : mark->size);
    } else {
        put(w, mark->kind == SHD_MARK_POLYGON ? "<polygon" : "<polyline");
        put_points(w, mark);
    }
    if (mark->kind == SHD_MARK_CIRCLE || (mark->kind == SHD_MARK_LINE && !is_dot))
        put_stroke(w, &mark->ink);
    else
        put_color(w, "fill", &mark->ink);
    put(w, "/>\n");
}

static void put_document(writer *w, const shd_drawing *drawing, const char *title) {
    put(w, "<svg xmlns=\"http://www.w3.org/2000/svg\" role=\"img\"");
    put_attribute(w, "width", drawing->width);
    put_attribute(w, "height", drawing->height);
    put(w, " viewBox=\"0 0 ");
    put_number(w, drawing->width);
    put(w, " ");
    put_number(w, drawing->height);
    put(w, "\" font-family=\"sans-serif\" fill-rule=\"evenodd\" stroke-linecap=\"round\" "
           "stroke-linejoin=\"round\">\n<title>");
    put_escaped(w, title);
    put(w, "</title>\n");
    for (const shd_mark *mark = drawing->first; mark; mark = mark->next) put_mark(w, mark);
    put(w, "</svg>\n");
}

char *shd_drawing_svg(const shd_drawing *drawing, const char *title, shd_arena *arena,
                      size_t *length) {
    writer count = {NULL, 0};
    put_document(&count, drawing, title);
    writer out = {shd_arena_alloc(arena, count.length + 1, 1), 0};
    if (!out.text) return NULL;
    put_document(&out, drawing, title);
    out.text[out.length] = 0;
    *length = out.length;
    return out.text;
}
