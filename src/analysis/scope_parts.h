/* What scopes share. Only for analysis/. */
#pragma once

#include "analysis/scopes.h"
#include "image/draw.h"

typedef struct shd_trace_plot {
    const shd_scoped *scoped;
    unsigned char *rgb;
    uint32_t *hits; /* [height][width] */
    uint64_t seen;  /* pixels that are seen and finite */
    shd_drawing *lines;
    double text;  /* the size of labels; 0: there is no room */
    double width; /* of lines */
    bool bare;    /* the picture is too small for a graticule */
    int cell;     /* pixels of a cell of chroma, each way */
    shd_arena *scratch;
    const atomic_bool *cancelled;
} shd_trace_plot;

/* A box of the picture. */
typedef struct shd_frame {
    double x, y, width, height;
} shd_frame;

static const shd_ink SHD_SCOPE_TEXT = {{196, 204, 216}, 1, 1};

/* Lines of the graticule, which are as wide as the picture is large. */
shd_ink shd_scope_line(const shd_trace_plot *plot);
shd_ink shd_scope_faint(const shd_trace_plot *plot);

/* Whether the pixel is displayed and finite. */
bool shd_scope_sees(const shd_scoped *scoped, size_t pixel);

/* The plot's frame, with room for labels at its left and below. */
shd_frame shd_scope_frame(const shd_scoped *scoped, double text);

/* Counts a hit in the cell of the place, if it is in the picture. A cell is counted in its first
 * pixel. */
void shd_scope_hit(shd_trace_plot *plot, double x, double y);

/* Paints the hits of the columns [from, to) in a color. `cells`: those that the trace could fill,
 * by which its brightness is measured. */
void shd_scope_glow(shd_trace_plot *plot, int from, int to, const unsigned char color[3],
                    double cells);

void shd_scope_vector(shd_trace_plot *plot);
void shd_scope_chromaticity(shd_trace_plot *plot);
void shd_scope_waveform(shd_trace_plot *plot, bool parade);
bool shd_scope_histogram(shd_trace_plot *plot); /* false: the arena is full */
void shd_scope_falsecolor(shd_trace_plot *plot);
void shd_scope_gamut(shd_trace_plot *plot);
