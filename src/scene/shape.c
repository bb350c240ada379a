#include <string.h>

#include "scene/scene.h"

const char *shd_shape_name(shd_shape shape) {
    static const char *const names[SHD_SHAPE_COUNT] = {
        [SHD_SPHERE] = "sphere", [SHD_PLANE] = "plane",       [SHD_DISC] = "disc",
        [SHD_BOX] = "box",       [SHD_CYLINDER] = "cylinder", [SHD_CONE] = "cone",
        [SHD_TORUS] = "torus",   [SHD_MESH] = "mesh"};
    return names[shape];
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
    case SHD_PLANE:
    case SHD_MESH:
    case SHD_SHAPE_COUNT:
        break;
    }
    return 0;
}
