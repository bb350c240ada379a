/* Maps of normals, and patterns of exponents, on faceted objects (flat, gouraud), which are lit
 * once a face or a corner.
 *
 * The light that is found at a point is shown by weights: 1 on its face, or 1 at its corner,
 * falling to 0 at the far side of each triangle that has it. What the map is to the point is its
 * mean by these weights. Of each such triangle that is the mean over a parallelogram with the mean
 * place and the covariance that the weights have on it; shd_bump_at carries it to the world around
 * the point's normal, and the vectors of all triangles are added by their areas. So neither a
 * camera nor a pixel changes what a corner sees, and normals that differ around it widen its
 * highlights.
 *
 * Of weights w over a triangle with the sides p and q from the corner c, places are c + b p + d q
 * with (b, d) of Dirichlet's distribution: of parameters (2, 1, 1) for a corner, the mean is
 * c + (p + q) / 4 and the covariance (s s' / 80 + r r' / 40) with s = p + q, r = p - q; for a face,
 * of (1, 1, 1), c + (p + q) / 3 and (s s' / 72 + r r' / 24). A parallelogram of sides x and y has
 * (x x' + y y') / 12. Numbers of lobes are added by the triangles' areas in the same way. */
#pragma once

#include "shade/bump.h"
#include "sight/sight.h"

typedef struct shd_mapped_facets {
    const shd_sight *sight;
    const shd_facets *facets;
    const shd_plan_material *material;
    size_t object;
    bool flat;
    shd_chart chart;
    /* corners[begins[p] .. begins[p + 1]): the corners, 3 triangle + k, that are point p; of flat
     * faces one of each triangle. */
    const uint32_t *begins, *corners;
} shd_mapped_facets;

/* The object is faceted, and its material has a map, or `gloss`. The lists live in `arena`, the
 * rest is borrowed. False: the arena is full. */
bool shd_mapped_facets_make(const shd_plan *plan, const shd_sight *sight, size_t object,
                            shd_arena *arena, shd_mapped_facets *out);

/* What the map makes of a point; without one the point's own normal. Any thread. */
shd_bump shd_mapped_point(const shd_mapped_facets *m, size_t point);

/* The exponent or roughness of a lobe at a point: the mean of its texture. Any thread. */
double shd_mapped_gloss(const shd_mapped_facets *m, size_t point, size_t lobe);
