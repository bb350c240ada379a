#include "sight/shapes.h"

#include "sight/batch.h"

/* One ray fills a batch: slow, but the same code. */
bool shd_intersect(shd_shape shape, double tube, const shd_ray *ray, shd_surface *out) {
    shd_work w;
    shd_surfaces met;
    for (int i = 0; i < SHD_RAYS; i++) {
        w.ox[i] = ray->origin.x, w.dx[i] = ray->direction.x;
        w.oy[i] = ray->origin.y, w.dy[i] = ray->direction.y;
        w.oz[i] = ray->origin.z, w.dz[i] = ray->direction.z;
        w.near[i] = ray->near;
        w.shift[i] = 0;
        if (shape != SHD_PLANE) shd_approach(&w, i);
    }
    shd_find_surfaces_portable(shape, tube, &w);
    if (!(w.t[0] < INFINITY)) return false;
    shd_place_surfaces_portable(shape, tube, &w, &met);
    *out = (shd_surface){w.t[0] + w.shift[0],
                         {met.point[0][0], met.point[1][0], met.point[2][0]},
                         {met.normal[0][0], met.normal[1][0], met.normal[2][0]}};
    return true;
}
