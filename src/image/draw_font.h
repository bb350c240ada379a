/* The font of drawings: each sign is a few strokes, so that it has any size. Pure, any thread. */
#pragma once

#include "image/draw.h"

/* Strokes that are as long as the most intricate sign's, flattened. */
enum { SHD_GLYPH_POINTS = 256 };

/* A text that is set in pixels: signs begin on whole pixels, and the heights of capitals and of
 * small letters, the depth of what hangs and the width of each sign are whole pixels, too. So
 * upright and level strokes of signs lie in rows and columns of pixels. */
typedef struct shd_typeface {
    double unit;                    /* pixels of a unit of the font */
    double capital, small, hanging; /* pixels */
    double gap;                     /* between signs */
    double stroke;                  /* the strokes' width */
} shd_typeface;

shd_typeface shd_typeface_of(double size);

/* The next sign of *text, which moves on; false at its end. Its strokes are lines between points of
 * which each but the last is followed by another one, unless it is an end: y is downward from the
 * base line, and both begin at 0. *advance is how far the next sign is. */
typedef struct shd_glyph {
    size_t count;
    shd_point points[SHD_GLYPH_POINTS];
    bool ends[SHD_GLYPH_POINTS]; /* a stroke ends here */
    double advance;
} shd_glyph;

bool shd_glyph_next(const shd_typeface *face, const char **text, shd_glyph *out);
