/* What a pixel sees of patterns, anew from docs/textures.md: a pixel's parallelogram is cut at
 * every edge of a pattern, piece by piece. Of charts it knows those that are linear: of planes,
 * discs, boxes and meshes. Noise, which is not integrated, is anything between its colors. */
#ifndef SHD_ATTACK_PRINTS_H
#define SHD_ATTACK_PRINTS_H

#include "attack/document.h"

/* A pixel's rays to the right and down by a pixel, from that through its middle. Rays of a
 * perspective camera change their way, those of an orthographic one their origin. */
typedef struct gaze {
    point origin, way, right, down;
    bool orthographic;
} gaze;

/* Where a surface is met: its plane's normal in its own frame and in the world, which are of any
 * length; of a mesh the triangle. */
typedef struct printed_place {
    point at, normal;
    size_t triangle;
} printed_place;

/* The thing's stuff as the pixel sees it there, of the least and the most that its coefficients may
 * be; the largest exponents count as the least, as they do in models whose lobes are powers. False:
 * it has no patterns, and nothing is written. */
bool printed_stuff(const thing *t, const gaze *g, const printed_place *place, stuff *low,
                   stuff *high);

#endif
