/* How the camera sees a point: what footprints are made of. Any thread. */
#pragma once

#include "shade/chart.h"

typedef struct shd_image_plane {
    const shd_camera *camera;
    double side; /* of a pixel on the image plane, at distance 1 or of the view volume */
    int samples;
} shd_image_plane;

shd_image_plane shd_image_plane_of(const shd_scene *scene);

/* The ray of the pattern's sample that meets the point. */
shd_seen_by shd_see_point(const shd_image_plane *plane, shd_vec3 position, int sample);
