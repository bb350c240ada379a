/* The inside of a drawing, which painters and writers share. */
#pragma once

#include "image/draw.h"

typedef enum shd_mark_kind {
    SHD_MARK_LINE,
    SHD_MARK_POLYGON,
    SHD_MARK_CIRCLE,
    SHD_MARK_DISC,
    SHD_MARK_TEXT
} shd_mark_kind;

typedef struct shd_mark {
    struct shd_mark *next;
    shd_mark_kind kind;
    shd_ink ink;
    shd_point *points; /* the line, the polygon; or one: the middle, the text's place */
    size_t count;
    double size; /* the radius, the font's size */
    shd_anchor anchor;
    bool upward;
    const char *text;
} shd_mark;

struct shd_drawing {
    shd_arena *arena;
    double width, height;
    shd_mark *first, **last;
    bool full;
};
