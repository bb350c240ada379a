/* Maps of normals: what a picture's or a pattern's normals make of a surface's own, and of its
 * highlights.
 *
 * A texel is a unit vector (x, y, z) of the frame (T, B, N): N is the normal of the surface's front
 * (of a mesh with normals the interpolated one), unit. T is the direction in which the picture's s
 * grows along the surface, at right angles to N: that of dP/ds less its part along N. B = h N x T,
 * with h = 1 where (T, B, N) is right-handed as (s, t, N) is there, and -1 where the chart or the
 * transform mirrors it. So x goes to the picture's right and y to its top (OpenGL's green, which
 * glTF and three.js have). dP/ds is that of the point's own place on a shape's chart, and the
 * triangle's on a mesh: tangents are those of MikkTSpace, but for no mean of them at vertices.
 *
 * What a pixel sees of the map is the mean vector m of its texels over the pixel, as of any
 * picture (shade/picture.h), or of a pattern's normals, each of which is that of a mix of two
 * colors and unit. The normal that is lit is N' = x T + y B + z N of m, made unit; where the
 * surface's back is seen it is -N', as that of a relief from behind is. Where T is nowhere (a pole
 * of the chart, a triangle whose uvs have no area) and where m is 0, it is N.
 *
 * Toksvig's factor. If normals spread by the variance v = (1 - |m|) / |m| across each axis, then a
 * lobe (N.H)^n becomes one of n' = n / (1 + n v) = n |m| / (|m| + n (1 - |m|)), (n' + 1) / (n + 1)
 * times as bright. Lobes of R.V are around W, which turns twice as far: 4 v. Exponents are not
 * lowered below 1. Facets of RMS slope r, whose lobe is that of n = 2 / r^2, have r'^2 = r^2 + 2 v,
 * 1 at most. Lengths within 2^-22 of 1, which is what f32 makes of texels, have v = 0.
 *
 * Any thread. Sources: M. Toksvig, "Mipmapping Normal Maps", Journal of Graphics Tools 10(3), 2005;
 * M. Mikkelsen, "Simulation of Wrinkled Surfaces Revisited", 2008. */
#pragma once

#include "plan/plan.h"
#include "shade/beam.h"
#include "shade/bend.h"
#include "shade/lighting.h"

typedef struct shd_bump {
    shd_vec3 normal; /* N', unit, on the side of the point's normal */
    double length;   /* |m|, in [0, 1] */
} shd_bump;

/* What the map makes of the point, whose normal is unit, of a footprint on the chart. */
shd_bump shd_bump_at(const shd_texture *map, const shd_chart *chart, const shd_charted_point *point,
                     const shd_footprint *uv);

/* What a lobe becomes where the mean normal has this length. Of 1 it is the lobe itself, to the
 * bit. */
shd_sharpness shd_toksvig(shd_model model, double shininess, double length);

/* Room for a point's rows of shd_points64.sharp. */
enum { SHD_SHARP_ROWS = 2 * (1 + SHD_LOBES_MOST) + 3 };
typedef struct shd_sharp_point {
    double values[SHD_SHARP_ROWS];
    const double *rows[SHD_SHARP_ROWS];
} shd_sharp_point;

/* Turns the normal and the mirrored view of a surface, which a beam meets, by the map of its
 * material, if it has one, and gives it rows in `room`. */
void shd_bump_beam(const shd_scene *scene, const shd_beam *beam, shd_sharp_point *room,
                   shd_surface *at);
