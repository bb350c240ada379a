/* Lower bounds of the distance of a light from an object's surface, and from what is seen. */
#include "base/pattern.h"
#include "plan/parts.h"

shd_place shd_place_of(const shd_object *object, const shd_plan_object *bounds) {
    shd_place place = {.object = object, .bounds = bounds};
    shd_affine linear = object->transform;
    linear.origin = (shd_vec3){0, 0, 0};
    place.known = shd_invert(&linear, &place.inverse);
    if (place.known) place.norm = shd_norm(&place.inverse);
    shd_object_box(object, &place.low, &place.high);
    return place;
}

/* Signed, in the object's frame: negative inside. At most the distance to the surface, by size. The
 * larger of two distances from convex parts is no more than that from what they have in common. */
static double signed_distance(const shd_place *place, shd_vec3 p) {
    const shd_object *object = place->object;
    const double r = object->radius, h = object->height / 2;
    const shd_shape shape = object->interpolation != SHD_PHONG ? SHD_MESH : object->shape;
    if (shape == SHD_SPHERE) return shd_length(p) - r; /* there may be many */
    const double out = hypot(p.x, p.z);
    switch (shape) {
    case SHD_PLANE:
        return fabs(p.y);
    case SHD_DISC:
        return hypot(fmax(out - r, 0), p.y);
    case SHD_BOX:
        return shd_larger(shd_larger(fabs(p.x) - place->high.x, fabs(p.y) - place->high.y),
                          fabs(p.z) - place->high.z);
    case SHD_CYLINDER:
        return shd_larger(out - r, fabs(p.y) - h);
    case SHD_CONE:
        return shd_larger((2 * h * out + r * (p.y - h)) / hypot(r, 2 * h), -h - p.y);
    case SHD_TORUS:
        return hypot(out - r, p.y) - object->tube;
    case SHD_MESH:   /* and facets: that to the box, within which nothing is known */
    case SHD_SPHERE: /* above */
    case SHD_SHAPE_COUNT:
        break;
    }
    const shd_vec3 low = place->low, high = place->high;
    const shd_vec3 out_of = shd_vec3_max(shd_sub(low, p), shd_sub(p, high));
    return fmax(shd_larger(shd_larger(out_of.x, out_of.y), out_of.z), 0);
}

double shd_least_distance(const shd_place *place, shd_vec3 point) {
    const shd_plan_object *bounds = place->bounds;
    double least = 0;
    if (bounds->bounded) least = shd_length(shd_sub(point, bounds->center)) - bounds->radius;
    if (place->known) {
        shd_vec3 p = shd_linear(&place->inverse, shd_sub(point, place->object->transform.origin));
        least = fmax(least, fabs(signed_distance(place, p)) / place->norm);
    }
    return fmax(least, 0);
}

/* The pixel of `count` that the coordinate is in, or nearest to. */
static int pixel_of(double at, int count) {
    return (int)shd_smaller(shd_larger(at, 0), count - 1);
}

/* The nearest sample on the image plane is in the pixel that the point is in or nearest to, or
 * beside it, because all pixels have the same samples. */
double shd_ray_distance(const shd_scene *scene, shd_vec3 point) {
    const shd_camera *camera = &scene->camera;
    const shd_raster *raster = &scene->raster;
    const shd_vec3 from = shd_sub(point, camera->position);
    const bool far = camera->projection == SHD_ORTHOGRAPHIC;
    const double depth = far ? 1 : -shd_dot(from, camera->back);
    const double half = shd_half_height(camera);
    const double half_x = half * raster->width / raster->height, step = 2 * half / raster->height;
    const double x = (shd_dot(from, camera->right) / depth + half_x) / step,
                 y = (half - shd_dot(from, camera->up) / depth) / step;
    if (!(depth > 0) || !isfinite(x) || !isfinite(y)) return 0;
    const int column = pixel_of(x, raster->width), row = pixel_of(y, raster->height);
    double least = INFINITY;
    for (int i = 0; i < raster->samples; i++) {
        double dx, dy;
        shd_sample_offset(i, raster->samples, &dx, &dy);
        for (int k = 0; k < 9; k++) {
            const double across = column + k % 3 - 1 + dx - x, down = row + k / 3 - 1 + dy - y;
            least = shd_smaller(least, across * across + down * down);
        }
    }
    /* A ray to (a, b) on the plane at a depth of 1 is |(a, b, 1)| long. */
    const double slant = far ? 1 : sqrt(1 + half_x * half_x + half * half);
    const double distance = sqrt(least) * step * depth / slant;
    return shd_larger(distance * (1 - 1e-6) - 1e-9 * (shd_plan_length(from) + depth), 0);
}
