/* Rays in batches, component by component, for loops that vectorize. Inside of sight/.
 *
 * A lane's result does not depend on the other lanes, to the bit, so that batches may begin
 * anywhere. Variants of the kernels (base/cpu.h) give the same bits. */
#ifndef SHD_SIGHT_BATCH_H
#define SHD_SIGHT_BATCH_H

#include "base/cpu.h"
#include "sight/item.h"

enum { SHD_RAYS = 32 }; /* lanes of a batch; arrays of them are never shorter */

/* Rays in a shape's frame; directions need not be unit. Only t > near counts. */
typedef struct shd_rays {
    double origin[3][SHD_RAYS], direction[3][SHD_RAYS], near[SHD_RAYS];
} shd_rays;

/* As shd_surface; t is infinity where nothing was hit, and the rest undefined there. */
typedef struct shd_surfaces {
    double t[SHD_RAYS];
    double point[3][SHD_RAYS], normal[3][SHD_RAYS];
} shd_surfaces;

typedef struct shd_cast_kernel {
    /* The nearest surfaces with near < t < limit of a shape other than torus and mesh. Returns
     * whether there is any; else `point` and `normal` are not written. */
    bool (*intersect)(shd_shape shape, const shd_rays *rays, const double *limit,
                      shd_surfaces *out);
    /* Fills the G-buffer of a tile from the objects that may be seen. Returns the hits. */
    size_t (*cast)(const shd_sight *sight, shd_tile tile, const size_t *candidates,
                   size_t candidate_count, shd_gbuffer *out);
} shd_cast_kernel;

extern const shd_cast_kernel shd_cast_kernel_portable, shd_cast_kernel_avx2, shd_cast_kernel_avx512;

/* The intersect of each kernel, by name. */
bool shd_intersect_rays_portable(shd_shape shape, const shd_rays *rays, const double *limit,
                                 shd_surfaces *out);
bool shd_intersect_rays_avx2(shd_shape shape, const shd_rays *rays, const double *limit,
                             shd_surfaces *out);
bool shd_intersect_rays_avx512(shd_shape shape, const shd_rays *rays, const double *limit,
                               shd_surfaces *out);

#endif
