/* Camera rays. Inside of sight/. */
#pragma once

#include "scene/scene.h"

/* The picture as its rays see it. */
typedef struct shd_lens {
    const shd_camera *camera;
    double width, height;  /* of the picture, in pixels */
    double half_x, half_y; /* of the image plane: at distance 1, or of the view volume */
} shd_lens;

shd_lens shd_lens_make(const shd_camera *camera, const shd_raster *raster);

/* The unit vector from p toward the viewer. */
shd_vec3 shd_lens_view(const shd_lens *lens, shd_vec3 p);
