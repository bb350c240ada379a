/* Directions to a light with a shape, and a model's weights of light from them, in vectors. The
 * weights are those of shade/brdf.h and of Westin tables (westin.h). Only for shade/. */
#pragma once

#include "shade/area.h"
#include "shade/area_seen.h"
#include "shade/packed.h"
#include "shade/westin_table.h"

/* A colored Westin table from one view: what is made of it once pays for many lights. */
typedef struct shd_westin_seen {
    bool made;
    double rho[3][SHD_WESTIN_RISES][SHD_WESTIN_ROW]; /* [channel], as in shd_westin_colored */
} shd_westin_seen;

/* A point and what is known of its material. */
typedef struct shd_way_point {
    const shd_surface *at;
    const shd_packed_energy *energies; /* [lobe]; NULL but for normalized Phong lobes */
    const shd_westin_colored *westin;  /* NULL: it is no microgeometry */
    shd_vec3 tangent;                  /* of microgeometry: unit, perpendicular to the normal */
    shd_westin_seen *seen;             /* scratch of it, not made yet */
} shd_way_point;

/* shd_area_sum_function of a shd_way_point: rows are those of shd_brdf_weigh. Sums are the same
 * bits on every machine. */
shd_area_sum_function shd_sum_ways_portable, shd_sum_ways_avx2, shd_sum_ways_avx512;

/* What cells are made of (area_cells.c): a fan of directions between an apex and a piece of what is
 * seen, of which t goes along the piece, and h from the apex (0) to it (1). */
typedef struct shd_fan {
    const shd_seen *seen;
    const shd_stretch *piece;
    shd_vec3 apex;
    double foot, near, from, to; /* t = foot + near sinh(from + s (to - from)), s from 0 to 1 */
} shd_fan;

/* Fills ways with 7 by 7 directions of the cell s[0] .. s[1], h[0] .. h[1], whose first weights are
 * those of 7 points both ways, the second of 3 along the piece, the third of 3 the other way. If it
 * is `rough`, it has 3 points both ways, and these weights alone. */
typedef void shd_fan_ways_function(const shd_fan *fan, const double s[2], const double h[2],
                                   bool rough, shd_ways *out);
shd_fan_ways_function shd_fan_ways_portable, shd_fan_ways_avx2, shd_fan_ways_avx512;
