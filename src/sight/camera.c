#include "sight/camera.h"

#include "sight/sight.h"

shd_lens shd_lens_make(const shd_camera *camera, const shd_raster *raster) {
    double half = camera->projection == SHD_PERSPECTIVE ? tan(camera->fov / 2) : camera->height / 2;
    return (shd_lens){camera, raster->width, raster->height, half * raster->width / raster->height,
                      half};
}

shd_vec3 shd_lens_view(const shd_lens *lens, shd_vec3 p) {
    shd_vec3 view = lens->camera->back;
    if (lens->camera->projection == SHD_PERSPECTIVE)
        shd_normalize(shd_sub(lens->camera->position, p), &view);
    return view;
}

static double van_der_corput(unsigned i) {
    double value = 0, half = 0.5;
    for (; i; i >>= 1, half /= 2)
        if (i & 1) value += half;
    return value;
}

void shd_sample_offset(int i, int n, double *x, double *y) {
    double spacing = 1;
    for (int reach = 1; reach < n; reach *= 2) spacing /= 2;
    *x = (i + 0.5) / n;
    *y = van_der_corput((unsigned)i) + spacing / 2;
}
