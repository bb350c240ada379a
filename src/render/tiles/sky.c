#include "render/tiles/sky.h"

#include "base/pattern.h"
#include "shade/backdrop.h"

/* The direction of a ray through a point of the picture, in pixels. */
static shd_vec3 direction_through(const shd_scene *scene, double x, double y) {
    const shd_camera *camera = &scene->camera;
    const double half_w = scene->raster.width / 2.0, half_h = scene->raster.height / 2.0,
                 step = tan(camera->fov / 2) / half_h;
    shd_vec3 way = shd_scale(camera->back, -1);
    if (camera->projection == SHD_ORTHOGRAPHIC) return way;
    way = shd_madd(way, camera->right, (x - half_w) * step);
    way = shd_madd(way, camera->up, (half_h - y) * step);
    shd_normalize(way, &way);
    return way;
}

void shd_sky_add(const shd_scene *scene, shd_tile tile, const float *cover,
                 float (*pixels)[SHD_TILE_PIXELS]) {
    const int samples = scene->raster.samples;
    for (int y = tile.y; y < tile.y + tile.h; y++)
        for (int x = tile.x; x < tile.x + tile.w; x++) {
            const size_t cell = (size_t)(y % SHD_TILE * SHD_TILE + x % SHD_TILE);
            const float rest = 1 - cover[cell];
            double sum[3] = {0, 0, 0};
            if (!(rest > 0)) continue;
            for (int k = 0; k < samples; k++) {
                double dx, dy, rgb[3];
                shd_sample_offset(k, samples, &dx, &dy);
                shd_backdrop_at(scene->backdrop, direction_through(scene, x + dx, y + dy), rgb);
                for (int c = 0; c < 3; c++) sum[c] += rgb[c];
            }
            for (int c = 0; c < 3; c++) pixels[c][cell] += rest * (float)(sum[c] / samples);
        }
}
