/* Diagrams: a list of lines, areas, circles and texts, which becomes the pixels of an 8-bit sRGB
 * picture or the text of an SVG document.
 *
 * Coordinates are pixels of a drawing of width x height, x to the right and y downward from the top
 * left corner; the middle of the first pixel is (0.5, 0.5). Colors are sRGB codes. Marks lie over
 * each other in the order in which they are drawn, and are blended as SVG does by default, in
 * encoded sRGB. Both results depend on nothing but the list: arithmetic in f64, coverage in steps
 * of 1/255. Different drawings may be used by different threads. */
#pragma once

#include "base/arena.h"
#include "base/cancel.h"

typedef struct shd_drawing shd_drawing;

typedef struct shd_ink {
    unsigned char rgb[3];
    double alpha; /* 0..1 */
    double width; /* of lines, > 0; a line thinner than a pixel is drawn paler */
} shd_ink;

typedef struct shd_point {
    double x, y;
} shd_point;

typedef enum shd_anchor { SHD_ANCHOR_START, SHD_ANCHOR_MIDDLE, SHD_ANCHOR_END } shd_anchor;

/* All that is drawn comes from `arena`. NULL if it is full. */
shd_drawing *shd_drawing_new(shd_arena *arena, double width, double height);

/* Whether the arena was full when something was drawn. That is left out, and the drawing is no
 * good any more. */
bool shd_drawing_full(const shd_drawing *drawing);

/* Each copies what it is given. Coordinates are finite, and below 1e6 in magnitude. */

/* A line through `count` > 0 points with round ends and joints; a single point is a dot. `closed`:
 * it returns to its first point. */
void shd_draw_line(shd_drawing *drawing, shd_ink ink, const shd_point *points, size_t count,
                   bool closed);
void shd_draw_segment(shd_drawing *drawing, shd_ink ink, double x0, double y0, double x1,
                      double y1);
/* The area within a closed line; where it crosses itself, by the even-odd rule. */
void shd_draw_polygon(shd_drawing *drawing, shd_ink ink, const shd_point *points, size_t count);
void shd_draw_box(shd_drawing *drawing, shd_ink ink, double x, double y, double width,
                  double height);
void shd_draw_circle(shd_drawing *drawing, shd_ink ink, double x, double y, double radius);
void shd_draw_disc(shd_drawing *drawing, shd_ink ink, double x, double y, double radius);

/* `text` is UTF-8 of the font's signs: ASCII and those that draw_font.c adds; others become boxes.
 * (x, y) is on its base line; `size` is the font's, whose capitals are 0.7 of it high. `upward`:
 * it is turned left by a quarter, and reads from below. */
void shd_draw_text(shd_drawing *drawing, shd_ink ink, double x, double y, double size,
                   shd_anchor anchor, const char *text);
void shd_draw_text_upward(shd_drawing *drawing, shd_ink ink, double x, double y, double size,
                          shd_anchor anchor, const char *text);

/* The width of such a text, in pixels. In pixels, signs stand on whole pixels, so that they are
 * crisp: this is what they take there. */
double shd_text_width(const char *text, double size);

/* Paints over `rgb`, [height][width][3], of any size: coordinates are multiplied by `scale`.
 * Working memory comes from `scratch`. False: it is full, or the request was cancelled. */
bool shd_drawing_paint(const shd_drawing *drawing, double scale, int width, int height,
                       unsigned char *rgb, shd_arena *scratch, const atomic_bool *cancelled);

/* The drawing as an SVG 1.1 document, of `arena`; its length without the 0 at its end is in
 * *length. `title` is told to those who do not see it. NULL: the arena is full. */
char *shd_drawing_svg(const shd_drawing *drawing, const char *title, shd_arena *arena,
                      size_t *length);
