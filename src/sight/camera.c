#include "sight/camera.h"

#include "sight/sight.h"

shd_lens shd_lens_make(const shd_camera *camera, const shd_raster *raster) {
    double half = shd_half_height(camera);
    return (shd_lens){camera, raster->width, raster->height, half * raster->width / raster->height,
                      half};
}

shd_vec3 shd_lens_view(const shd_lens *lens, shd_vec3 p) {
    shd_vec3 view = lens->camera->back;
    if (lens->camera->projection == SHD_PERSPECTIVE)
        shd_normalize(shd_sub(lens->camera->position, p), &view);
    return view;
}
