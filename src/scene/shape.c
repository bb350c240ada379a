#include "scene/scene.h"

/* The scale of the unit form along each axis. */
static shd_vec3 unit_size(const shd_object *object) {
    double r = object->radius;
    switch (object->shape) {
    case SHD_BOX:
        return object->size;
    case SHD_CYLINDER:
    case SHD_CONE:
        return (shd_vec3){r, object->height, r};
    case SHD_SPHERE:
    case SHD_DISC:
    case SHD_TORUS:
        return (shd_vec3){r, r, r};
    default:
        return (shd_vec3){1, 1, 1};
    }
}

bool shd_object_frame(const shd_object *object, shd_affine *to_world, shd_affine *from_world) {
    shd_vec3 size = unit_size(object);
    shd_affine sized = object->transform;
    for (int r = 0; r < 3; r++) {
        sized.linear[r][0] *= size.x;
        sized.linear[r][1] *= size.y;
        sized.linear[r][2] *= size.z;
    }
    *to_world = sized;
    sized.origin = (shd_vec3){0, 0, 0};
    return shd_invert(&sized, from_world);
}

size_t shd_tessellation_triangles(shd_shape shape, int segments) {
    size_t slices = (size_t)segments, stacks = slices / 2 > 2 ? slices / 2 : 2;
    switch (shape) {
    case SHD_SPHERE:
        return 2 * slices * (stacks - 1); /* the stacks at the poles are single triangles */
    case SHD_DISC:
        return slices;
    case SHD_BOX:
        return 12;
    case SHD_CYLINDER:
        return 4 * slices; /* two a slice around, one for each cap */
    case SHD_CONE:
        return 2 * slices;
    case SHD_TORUS:
        return 2 * slices * slices;
    default:
        return 0;
    }
}

bool shd_object_box(const shd_object *object, shd_vec3 *low, shd_vec3 *high) {
    double r = object->radius, h = object->height / 2;
    shd_vec3 half = {r, r, r};
    switch (object->shape) {
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
    case SHD_MESH:
        *low = object->mesh->low;
        *high = object->mesh->high;
        return true;
    default:
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
        shd_vec3 q = shd_transform(&object->transform, shd_box_corner(low, high, corner));
        *radius = fmax(*radius, shd_length(shd_sub(q, *center)));
    }
    return true;
}
