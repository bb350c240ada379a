/* What shines from all around, infinitely far away: radiance by direction.
 *
 * A map is a grid of texels over longitude and latitude. Column u = (i + 1/2) / width and row
 * v = (j + 1/2) / height belong to the direction
 *
 *     x = sin(pi v) sin(2 pi (u - 1/2)),  y = cos(pi v),  z = -sin(pi v) cos(2 pi (u - 1/2)),
 *
 * so that the middle of the map is what a camera sees that looks along -z. Between the middles of
 * texels radiance is linear in u and in v, around in u; beyond the first and the last row it is
 * that of the row. A map is constant, and any thread may read it. */
#pragma once

#include "base/vec3.h"

enum { SHD_SURROUNDINGS_LEVELS = 48 };

typedef struct shd_surroundings {
    const char *name;
    int width, height;
    const float *texels; /* [height][width][3], none below 0; linear Rec.709 */
    double most;         /* the largest value of any channel */
    double slope;        /* no channel changes by more over an angle, a radian */
    /* The sphere in parts by how bright they are, the brightest first: levels[k] is no less than
     * any channel in part k, whose solid angle is angles[k]. */
    double levels[SHD_SURROUNDINGS_LEVELS], angles[SHD_SURROUNDINGS_LEVELS];
} shd_surroundings;

/* The maps that are built in, by name, made when they are first asked for and constant from then
 * on: "sky", a clear one with a soft sun, and "studio", soft boxes in a dark room
 * (docs/model.md tells their equations). NULL: there is none, or no memory. */
const shd_surroundings *shd_surroundings_find(const char *name);

/* Their names, ended by NULL. */
extern const char *const shd_surroundings_names[];

/* Radiance from a unit direction, in linear Rec.709. */
void shd_surroundings_at(const shd_surroundings *map, shd_vec3 direction, double rgb[3]);

/* What (x.W)+^exponent makes of any map of these levels, at most, whatever W: the integral over the
 * sphere, divided by pi. */
double shd_surroundings_most(const shd_surroundings *map, double exponent);
