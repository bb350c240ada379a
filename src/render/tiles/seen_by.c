#include "render/tiles/seen_by.h"

#include "base/pattern.h"

shd_image_plane shd_image_plane_of(const shd_scene *scene) {
    const shd_raster *raster = &scene->raster;
    return (shd_image_plane){&scene->camera, 2 * shd_half_height(&scene->camera) / raster->height,
                             raster->samples};
}

shd_seen_by shd_see_point(const shd_image_plane *plane, shd_vec3 position, int sample) {
    const shd_camera *camera = plane->camera;
    shd_seen_by ray = {.way = shd_scale(camera->back, -1),
                       .perspective = camera->projection == SHD_PERSPECTIVE};
    shd_sample_offset(sample, plane->samples, &ray.aside, &ray.below);
    ray.aside = 0.5 - ray.aside;
    ray.below = 0.5 - ray.below;
    double side = plane->side;
    if (ray.perspective) {
        ray.way = shd_sub(position, camera->position);
        side *= -shd_dot(ray.way, camera->back); /* the depth */
    }
    ray.right = shd_scale(camera->right, side);
    ray.down = shd_scale(camera->up, -side);
    return ray;
}
