/* Camera rays. Compiled once an instruction set. */
#include "sight/batch.h"

/* Finds where shots go through the picture, in pixels. Lanes beyond the last shot repeat it. */
static void read_shots(const shd_sight *sight, const shd_shots *shots, size_t first, int used,
                       double *restrict px, double *restrict py) {
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
    SHD_EACH_LANE(i) {
        const int from = i < used ? i : used - 1;
        px[i] = x[from] + sight->offset_x[sample[from]];
        py[i] = y[from] + sight->offset_y[sample[from]];
    }
}

/* Where a point of the picture, in pixels, is on the image plane. */
SHD_INLINE shd_vec3 aside_of(const shd_lens *lens, const shd_camera *camera, double x, double y) {
    const double p = (x - lens->middle_x) * lens->step_x, q = (lens->middle_y - y) * lens->step_y;
    return shd_madd(shd_scale(camera->right, p), camera->up, q);
}

/* Makes a batch's rays from its x and y. */
static void make_rays(const shd_sight *sight, shd_batch *restrict b) {
    const shd_lens lens = sight->lens;
    const shd_camera camera = *lens.camera;
    b->orthographic = camera.projection == SHD_ORTHOGRAPHIC;
    b->scale = sight->plan->scale;
    if (b->orthographic) {
        SHD_EACH_LANE(i) {
            shd_set_lane(b->start, i, aside_of(&lens, &camera, b->x[i], b->y[i]));
            shd_set_lane(b->direction, i, shd_scale(camera.back, -1));
        }
        return;
    }
    SHD_EACH_LANE(i) {
        const shd_vec3 way = shd_sub(aside_of(&lens, &camera, b->x[i], b->y[i]), camera.back);
        shd_set_lane(b->direction, i, shd_scale(way, shd_inverse_root(shd_dot(way, way))));
    }
}

void SHD_VARIANT(shd_set_cosines)(const shd_sight *sight, shd_batch *restrict b) {
    const shd_vec3 back = sight->lens.camera->back;
    SHD_EACH_LANE(i) b->cosine[i] = -shd_dot(shd_lane(b->direction, i), back);
}

void SHD_VARIANT(shd_make_rays)(const shd_sight *sight, const shd_shots *shots, size_t first,
                                int used, shd_batch *b) {
    read_shots(sight, shots, first, used, b->x, b->y);
    make_rays(sight, b);
}
