/* The microgeometry that shade/westin_simulate.c lights: a surface of triangles over a square grid
 * that repeats forever, and the straight ways over it. Only for shade/.
 *
 * All numbers come from sums, products, quotients and square roots in f64, which every machine
 * rounds alike: the same microgeometry is the same everywhere, to the bit. */
#pragma once

#include "scene/scene.h"

enum { SHD_RELIEF_MOST = 64 }; /* cells a side */

/* Heights over the corners of `size` by `size` square cells of side 1, a power of two. Each cell
 * is two triangles, on either side of the line from its corner (1, 0) to (0, 1). The x axis is the
 * material's tangent, +z is out of the surface. */
typedef struct shd_relief {
    int size;
    bool isotropic; /* it stands for all surfaces that it becomes by a turn about z */
    double lowest, highest;
    double height[SHD_RELIEF_MOST * SHD_RELIEF_MOST];   /* [y][x] */
    double area[2 * SHD_RELIEF_MOST * SHD_RELIEF_MOST]; /* of all triangles up to each one */
} shd_relief;

/* A point on a triangle. */
typedef struct shd_relief_point {
    double x, y, z;
    shd_vec3 normal; /* of the triangle, unit; normal.z > 0 */
} shd_relief_point;

void shd_relief_make(const shd_microgeometry *micro, shd_relief *out);

/* The point over (x, y), 0 <= x, y < size. */
shd_relief_point shd_relief_at(const shd_relief *relief, double x, double y);

/* The point of the surface for numbers in [0, 1): evenly spread numbers give points that are evenly
 * spread over its area. */
shd_relief_point shd_relief_pick(const shd_relief *relief, const double numbers[3]);

/* The slope dz/ds below which the way along the unit (dx, dy) is blocked, if that is more than
 * `least` > 0; else `least`. */
double shd_relief_horizon(const shd_relief *relief, const shd_relief_point *from, double dx,
                          double dy, double least);

/* Where the ray from a point along the unit `way` meets the surface again. False: it leaves. */
bool shd_relief_cast(const shd_relief *relief, const shd_relief_point *from, shd_vec3 way,
                     shd_relief_point *out);

/* The sine and cosine of `turns` full turns, |turns| < 1e6: 1e-15. */
void shd_relief_turn(double turns, double *sine, double *cosine);

/* A number in [0, 1) that depends on `seed` and `index` alone. */
double shd_relief_random(uint64_t seed, uint64_t index);
