#include "plan/plan.h"

bool shd_object_box(const shd_object *object, shd_vec3 *low, shd_vec3 *high) {
    double r = object->radius, h = object->height / 2;
    shd_vec3 half = {r, r, r};
    switch (object->shape) {
    case SHD_PLANE:
        return false;
    case SHD_SPHERE:
        break;
    case SHD_DISC:
        half = (shd_vec3){r, 0, r};
        break;
    case SHD_BOX:
        half = shd_scale(object->size, 0.5);
        break;
    case SHD_CYLINDER:
    case SHD_CONE:
        half = (shd_vec3){r, h, r};
        break;
    case SHD_TORUS:
        half = (shd_vec3){r + object->tube, object->tube, r + object->tube};
        break;
    case SHD_MESH: {
        const double *p = object->mesh->positions;
        *low = *high = (shd_vec3){p[0], p[1], p[2]};
        for (size_t i = 1; i < object->mesh->vertex_count; i++) {
            const double *q = p + 3 * i;
            *low = (shd_vec3){fmin(low->x, q[0]), fmin(low->y, q[1]), fmin(low->z, q[2])};
            *high = (shd_vec3){fmax(high->x, q[0]), fmax(high->y, q[1]), fmax(high->z, q[2])};
        }
        return true;
    }
    case SHD_SHAPE_COUNT:
        return false;
    }
    *low = shd_scale(half, -1);
    *high = half;
    return true;
}

bool shd_object_bounds(const shd_object *object, shd_vec3 *center, double *radius) {
    shd_vec3 low, high;
    if (!shd_object_box(object, &low, &high)) return false;
    shd_vec3 middle = shd_madd(shd_scale(low, 0.5), high, 0.5);
    *center = shd_transform(&object->transform, middle);
    *radius = 0;
    for (int corner = 0; corner < 8; corner++) {
        shd_vec3 p = {corner & 1 ? high.x : low.x, corner & 2 ? high.y : low.y,
                      corner & 4 ? high.z : low.z};
        shd_vec3 q = shd_transform(&object->transform, p);
        *radius = fmax(*radius, shd_length(shd_sub(q, *center)));
    }
    return true;
}
