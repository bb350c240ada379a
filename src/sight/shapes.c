#include "sight/shapes.h"

#include "sight/batch.h"

/* The torus is met from where the ray is closest to its centre, like all shapes of finite
 * size. */
static bool torus(double tube, const shd_ray *ray, shd_surface *out) {
    shd_ray near = *ray;
    double shift = -shd_dot(ray->origin, ray->direction) / shd_dot(ray->direction, ray->direction);
    near.origin = shd_madd(ray->origin, ray->direction, shift);
    near.near -= shift;
    if (!shd_intersect_torus(tube, &near, out)) return false;
    out->t += shift;
    return true;
}

/* One ray fills a batch: slow, but the same code. */
bool shd_intersect(shd_shape shape, double tube, const shd_ray *ray, shd_surface *out) {
    if (shape == SHD_TORUS) return torus(tube, ray, out);
    shd_rays rays;
    shd_surfaces met;
    double limit[SHD_RAYS];
    for (int i = 0; i < SHD_RAYS; i++) {
        rays.origin[0][i] = ray->origin.x, rays.direction[0][i] = ray->direction.x;
        rays.origin[1][i] = ray->origin.y, rays.direction[1][i] = ray->direction.y;
        rays.origin[2][i] = ray->origin.z, rays.direction[2][i] = ray->direction.z;
        rays.near[i] = ray->near;
        limit[i] = INFINITY;
    }
    if (!shd_intersect_rays_portable(shape, &rays, limit, &met)) return false;
    *out = (shd_surface){met.t[0],
                         {met.point[0][0], met.point[1][0], met.point[2][0]},
                         {met.normal[0][0], met.normal[1][0], met.normal[2][0]}};
    return true;
}
