#include "scene/scene.h"

/* The scale of the unit form along each axis. */
static shd_vec3 unit_size(const shd_object *object) {
    const double r = object->radius;
    const shd_shape shape = object->shape;
    if (shape == SHD_PLANE || shape == SHD_MESH) return (shd_vec3){1, 1, 1};
    if (shape == SHD_BOX) return object->size;
    return (shd_vec3){r, shape == SHD_CYLINDER || shape == SHD_CONE ? object->height : r, r};
}

shd_affine shd_object_to_world(const shd_object *object) {
    const shd_vec3 s = unit_size(object);
    const double(*m)[3] = object->transform.linear;
    return (shd_affine){{{m[0][0] * s.x, m[0][1] * s.y, m[0][2] * s.z},
                         {m[1][0] * s.x, m[1][1] * s.y, m[1][2] * s.z},
                         {m[2][0] * s.x, m[2][1] * s.y, m[2][2] * s.z}},
                        object->transform.origin};
}

bool shd_object_frame(const shd_object *object, shd_affine *to_world, shd_affine *from_world) {
    shd_affine sized = *to_world = shd_object_to_world(object);
    sized.origin = (shd_vec3){0, 0, 0};
    return shd_invert(&sized, from_world);
}

size_t shd_tessellation_triangles(shd_shape shape, int segments) {
    const size_t slices = (size_t)segments, stacks = slices / 2 > 2 ? slices / 2 : 2;
    const size_t counts[SHD_SHAPE_COUNT] = {
        [SHD_SPHERE] = 2 * slices * (stacks - 1), /* the stacks at the poles are single triangles */
        [SHD_DISC] = slices,
        [SHD_BOX] = 12,
        [SHD_CYLINDER] = 4 * slices, /* two a slice around, one for each cap */
        [SHD_CONE] = 2 * slices,
        [SHD_TORUS] = 2 * slices * slices};
    return counts[shape];
}

bool shd_object_box(const shd_object *object, shd_vec3 *low, shd_vec3 *high) {
    const double r = object->radius, h = object->height / 2, tube = object->tube;
    const shd_vec3 halves[SHD_SHAPE_COUNT] = {[SHD_SPHERE] = {r, r, r},
                                              [SHD_DISC] = {r, 0, r},
                                              [SHD_BOX] = shd_scale(object->size, 0.5),
                                              [SHD_CYLINDER] = {r, h, r},
                                              [SHD_CONE] = {r, h, r},
                                              [SHD_TORUS] = {r + tube, tube, r + tube}};
    if (object->shape == SHD_PLANE) return false;
    *high = object->shape == SHD_MESH ? object->mesh->high : halves[object->shape];
    *low = object->shape == SHD_MESH ? object->mesh->low : shd_scale(*high, -1);
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
        *radius = shd_larger(shd_length(shd_sub(q, *center)), *radius);
    }
    return true;
}
