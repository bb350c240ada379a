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

#include "base/cancel.h"
#include "base/texels.h"
#include "base/vec3.h"

enum { SHD_SURROUNDINGS_LEVELS = 48 };

typedef struct shd_surroundings {
    const char *name; /* as documents have it */
    const char *key;  /* of maps of other texels it is another; that of a picture is a digest */
    int width, height;
    const float *texels; /* [height][width][3], none below 0; linear Rec.709, unless `working` */
    bool working;        /* whether they are in the scene's working space */
    size_t held;         /* components of a picture that were no radiance */
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

/* Radiance from a unit direction, in the map's colors. */
void shd_surroundings_at(const shd_surroundings *map, shd_vec3 direction, double rgb[3]);

/* The same at the place (u, v) of the map, within [0, 1]. */
void shd_surroundings_between(const shd_surroundings *map, double u, double v, double rgb[3]);

/* How many rows the map of a picture has, which is twice as wide as it is high: its own, or as many
 * as `wanted` of a finer one, and a whole multiple of a very coarse one's, at least
 * SHD_SURROUNDINGS_LEAST. Light is made of SHD_SURROUNDINGS_MOST rows at most. */
enum { SHD_SURROUNDINGS_LEAST = 64, SHD_SURROUNDINGS_MOST = 256 };
int shd_surroundings_rows(int height, int wanted);

/* Fills the texels [map->height][map->width][3] of a map with those of a picture, without its
 * alpha. If they are fewer, each is the mean of the picture's over its solid angle, so that all
 * light is there; if they are more, radiance is the picture's everywhere. Then the row at each pole
 * becomes its mean. What is below 0 becomes 0, and what a curve has made more than 10^6 that.
 * False: cancelled, or no memory. */
bool shd_surroundings_fill(const shd_texels *picture, const atomic_bool *cancelled,
                           shd_surroundings *map, float *texels);

/* Finds `most`, `slope` and, if light is made of it, the levels. False: cancelled, or no memory. */
bool shd_surroundings_measure(shd_surroundings *map, bool levels, const atomic_bool *cancelled);

/* What (x.W)+^exponent makes of any map of these levels, at most, whatever W: the integral over the
 * sphere, divided by pi. */
double shd_surroundings_most(const shd_surroundings *map, double exponent);

/* The most that any part of the map of this solid angle, no larger than a half sphere, shines: the
 * integral of the brightest radiance of any channel. */
double shd_surroundings_brightest(const shd_surroundings *map, double angle);
