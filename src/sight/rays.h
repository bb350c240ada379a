/* Camera rays by lanes. Inside of sight/'s kernels. */
#pragma once

#include "sight/batch.h"

#define SHD_EACH_LANE(i) for (int i = 0; i < SHD_RAYS; i++)
#define SHD_ALWAYS       static inline __attribute__((always_inline))

/* Finds where shots go through the picture, in pixels. Lanes beyond the last shot repeat it. */
static inline void shd_read_shots(const shd_sight *sight, const shd_shots *shots, size_t first,
                                  int used, double *restrict px, double *restrict py) {
    const int32_t *x = shots->x + first, *y = shots->y + first;
    const uint8_t *sample = shots->sample + first;
    if (used == SHD_RAYS) {
        int other = 0;
        SHD_EACH_LANE(i) other |= sample[i] ^ sample[0];
        if (!other) {
            const double dx = sight->offset_x[sample[0]], dy = sight->offset_y[sample[0]];
            SHD_EACH_LANE(i) {
                px[i] = x[i] + dx;
                py[i] = y[i] + dy;
            }
            return;
        }
    }
    for (int i = 0; i < SHD_RAYS; i++) {
        int from = i < used ? i : used - 1;
        px[i] = x[from] + sight->offset_x[sample[from]];
        py[i] = y[from] + sight->offset_y[sample[from]];
    }
}

/* What all rays of a camera share. The image plane's vectors are unit and at right angles, so that
 * nothing can overflow. They begin at the picture's center, so that mirrored pixels get mirrored
 * rays. */
typedef struct shd_fan {
    double middle_x, middle_y, step_x, step_y;
    shd_vec3 right, up, back;
} shd_fan;

static inline shd_fan shd_fan_of(const shd_lens *lens) {
    const shd_camera *camera = lens->camera;
    const double middle_x = 0.5 * lens->width, middle_y = 0.5 * lens->height;
    return (shd_fan){
        middle_x,   middle_y,    lens->half_x / middle_x, lens->half_y / middle_y, camera->right,
        camera->up, camera->back};
}

/* The unit direction of a perspective camera's ray through a point, in pixels from the top left
 * corner. */
SHD_ALWAYS shd_vec3 shd_fan_direction(const shd_fan *fan, double px, double py) {
    double p = (px - fan->middle_x) * fan->step_x, q = (fan->middle_y - py) * fan->step_y;
    double x = fan->right.x * p + fan->up.x * q - fan->back.x,
           y = fan->right.y * p + fan->up.y * q - fan->back.y,
           z = fan->right.z * p + fan->up.z * q - fan->back.z;
    double scale = shd_inverse_root(x * x + y * y + z * z);
    return (shd_vec3){x * scale, y * scale, z * scale};
}

/* The start of an orthographic camera's ray through a point, from the camera's position. */
SHD_ALWAYS shd_vec3 shd_fan_start(const shd_fan *fan, double px, double py) {
    double p = (px - fan->middle_x) * fan->step_x, q = (fan->middle_y - py) * fan->step_y;
    return (shd_vec3){fan->right.x * p + fan->up.x * q, fan->right.y * p + fan->up.y * q,
                      fan->right.z * p + fan->up.z * q};
}

/* Makes a batch's rays from its x and y. */
static inline void shd_make_rays(const shd_lens *lens, shd_batch *restrict b) {
    const shd_fan fan = shd_fan_of(lens);
    b->orthographic = lens->camera->projection == SHD_ORTHOGRAPHIC;
    if (!b->orthographic) {
        SHD_EACH_LANE(i) {
            const shd_vec3 u = shd_fan_direction(&fan, b->x[i], b->y[i]);
            b->direction[0][i] = u.x;
            b->direction[1][i] = u.y;
            b->direction[2][i] = u.z;
        }
        return;
    }
    SHD_EACH_LANE(i) {
        const shd_vec3 start = shd_fan_start(&fan, b->x[i], b->y[i]);
        b->start[0][i] = start.x;
        b->start[1][i] = start.y;
        b->start[2][i] = start.z;
        b->direction[0][i] = -fan.back.x;
        b->direction[1][i] = -fan.back.y;
        b->direction[2][i] = -fan.back.z;
    }
}
