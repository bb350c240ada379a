/* What is seen: the G-buffer of a tile, one entry a sample, f64, world frame.
 *
 * Entry i belongs to pixel i / samples (row by row within the tile) and to sample i % samples of
 * the pattern. Where `object` is SHD_NOTHING nothing was hit and the other values are undefined. */
#ifndef SHD_SIGHT_GBUFFER_H
#define SHD_SIGHT_GBUFFER_H

#include <stddef.h>
#include <stdint.h>

enum { SHD_NOTHING = -1 };

typedef struct shd_gbuffer {
    size_t count;        /* pixels of the tile times samples */
    double *position[3]; /* [count] each: the surface point */
    double *normal[3];   /* N: unit, turned to the viewer where the material is two-sided */
    double *view[3];     /* V: unit, toward the viewer */
    double *depth;       /* distance along the camera's axis */
    int32_t *object;     /* index in shd_scene.objects, or SHD_NOTHING */
    /* Of faceted objects (flat, gouraud): the triangle, and the barycentric weights of its
     * second and third corner. */
    uint32_t *triangle;
    double *u, *v;
} shd_gbuffer;

#endif
