/* How far f64 puts points beside where exact arithmetic has them. */
#include <float.h>

#include "plan/parts.h"

/* Half ulps of the largest length on a point's way: the ray's direction, the camera's axes, the
 * object's map and its inverse, and the place on the ray. */
static const double ROUNDINGS = 16;

/* 1 / N.V of all points that are seen but those on a silhouette: single samples, as on other edges.
 * Of this and the 16 no proof is given; `./dev attack` holds them. */
static const double GRAZING = 1e4;

shd_misplaced shd_misplaced_of(const shd_scene *scene, const shd_place *place) {
    const shd_plan_object *bounds = place->bounds;
    shd_misplaced out = {0, 0};
    if (!bounds->bounded) return out;
    const shd_vec3 eye = scene->camera.position, center = bounds->center;
    const double span = shd_length(eye) + 2 * shd_length(shd_sub(center, eye)) +
                        shd_length(center) + bounds->radius;
    out.moved = ROUNDINGS * (DBL_EPSILON / 2) * span;
    const shd_object *object = place->object;
    const bool mesh = object->shape == SHD_MESH;
    if (object->shape == SHD_DISC || object->shape == SHD_BOX) return out;
    if (object->interpolation != SHD_PHONG || (mesh && !object->mesh->normals)) return out;
    /* A surface turns by 1 / radius for each length, and as much between a mesh's normals, which
     * are those of something a tenth as large as it is, or of less. */
    const shd_vec3 size = shd_sub(place->high, place->low);
    double narrow = bounds->radius / 10;
    if (!mesh && place->known) narrow = fmin(fmin(size.x, size.y), size.z) / 2 / place->norm;
    const double turn = out.moved / narrow;
    out.turned = narrow > 0 ? fmin(fmin(sqrt(2 * turn), GRAZING * turn), 1) : 1;
    return out;
}
