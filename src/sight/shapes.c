#include "sight/shapes.h"

shd_vec3 shd_unit_size(const shd_object *object) {
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
    case SHD_PLANE:
    case SHD_MESH:
    case SHD_SHAPE_COUNT:
        break;
    }
    return (shd_vec3){1, 1, 1};
}

/* Takes t as the nearest so far if it is one. */
static bool nearer(double t, const shd_ray *ray, double *best) {
    if (!(t > ray->near) || !(t < *best)) return false;
    *best = t;
    return true;
}

static shd_vec3 along(const shd_ray *ray, double t) {
    return shd_madd(ray->origin, ray->direction, t);
}

/* Roots of a t^2 + 2 b t + c without cancellation (Haines et al., "Precision Improvements for
 * Ray/Sphere Intersection", Ray Tracing Gems, chapter 7). Returns their number. */
static int quadratic(double a, double b, double c, double root[2]) {
    double discriminant = b * b - a * c;
    if (!(discriminant >= 0)) return 0;
    double q = b > 0 ? -b - sqrt(discriminant) : -b + sqrt(discriminant);
    int count = 0;
    if (q != 0) root[count++] = c / q;
    if (a != 0) root[count++] = q / a;
    return count;
}

static bool sphere(const shd_ray *ray, shd_surface *out) {
    /* The discriminant from the distance of the line to the centre: no cancellation. */
    double inverse = 1 / shd_dot(ray->direction, ray->direction);
    double middle = -shd_dot(ray->origin, ray->direction) * inverse;
    shd_vec3 closest = shd_madd(ray->origin, ray->direction, middle);
    double inside = 1 - shd_dot(closest, closest);
    if (!(inside >= 0)) return false;
    double half = sqrt(inside * inverse);
    double t = middle - half > ray->near ? middle - half : middle + half;
    if (!(t > ray->near) || !shd_normalize(along(ray, t), &out->point)) return false;
    out->t = t;
    out->normal = out->point;
    return true;
}

static bool plane(const shd_ray *ray, shd_surface *out) {
    double best = INFINITY;
    if (ray->direction.y == 0 || !nearer(-ray->origin.y / ray->direction.y, ray, &best))
        return false;
    out->t = best;
    out->point = along(ray, best);
    out->point.y = 0;
    out->normal = (shd_vec3){0, 1, 0};
    return shd_is_finite(out->point);
}

static bool disc(const shd_ray *ray, shd_surface *out) {
    return plane(ray, out) && out->point.x * out->point.x + out->point.z * out->point.z <= 1;
}

static bool box(const shd_ray *ray, shd_surface *out) {
    const double o[3] = {ray->origin.x, ray->origin.y, ray->origin.z};
    const double d[3] = {ray->direction.x, ray->direction.y, ray->direction.z};
    double enter = -INFINITY, leave = INFINITY;
    int enter_axis = 0, leave_axis = 0;
    for (int c = 0; c < 3; c++) {
        if (d[c] == 0) {
            if (fabs(o[c]) > 0.5) return false;
            continue;
        }
        double side = d[c] > 0 ? 0.5 : -0.5;
        double t0 = (-side - o[c]) / d[c], t1 = (side - o[c]) / d[c];
        if (t0 > enter) enter = t0, enter_axis = c;
        if (t1 < leave) leave = t1, leave_axis = c;
    }
    if (!(enter <= leave) || !(leave > ray->near)) return false;
    bool outside = enter > ray->near;
    int axis = outside ? enter_axis : leave_axis;
    out->t = outside ? enter : leave;
    shd_vec3 p = along(ray, out->t);
    double at[3] = {p.x, p.y, p.z}, n[3] = {0, 0, 0};
    double sign = (d[axis] > 0) == outside ? -1 : 1;
    at[axis] = 0.5 * sign;
    n[axis] = sign;
    for (int c = 0; c < 3; c++) at[c] = fmin(fmax(at[c], -0.5), 0.5);
    out->point = (shd_vec3){at[0], at[1], at[2]};
    out->normal = (shd_vec3){n[0], n[1], n[2]};
    return true;
}

/* The caps of a cylinder or cone: discs of radius 1 at y = -1/2 and, with `both`, y = 1/2. */
static bool caps(const shd_ray *ray, bool both, double *best, shd_surface *out) {
    bool hit = false;
    for (int k = 0; k < (both ? 2 : 1); k++) {
        double y = k ? 0.5 : -0.5;
        if (ray->direction.y == 0) return false;
        double t = (y - ray->origin.y) / ray->direction.y;
        shd_vec3 p = along(ray, t);
        if (p.x * p.x + p.z * p.z > 1 || !nearer(t, ray, best)) continue;
        *out = (shd_surface){t, {p.x, y, p.z}, {0, y, 0}};
        hit = true;
    }
    return hit;
}

static bool cylinder(const shd_ray *ray, shd_surface *out) {
    const shd_vec3 o = ray->origin, d = ray->direction;
    double best = INFINITY, root[2];
    bool hit = caps(ray, true, &best, out);
    int roots =
        quadratic(d.x * d.x + d.z * d.z, o.x * d.x + o.z * d.z, o.x * o.x + o.z * o.z - 1, root);
    for (int k = 0; k < roots; k++) {
        shd_vec3 p = along(ray, root[k]);
        double radius = sqrt(p.x * p.x + p.z * p.z);
        if (!(fabs(p.y) <= 0.5) || !(radius > 0) || !nearer(root[k], ray, &best)) continue;
        shd_vec3 n = {p.x / radius, 0, p.z / radius};
        *out = (shd_surface){root[k], {n.x, p.y, n.z}, n};
        hit = true;
    }
    return hit;
}

static bool cone(const shd_ray *ray, shd_surface *out) {
    const shd_vec3 o = ray->origin, d = ray->direction;
    double best = INFINITY, root[2];
    bool hit = caps(ray, false, &best, out);
    double k = 0.5 - o.y; /* x^2 + z^2 = (1/2 - y)^2 */
    int roots = quadratic(d.x * d.x + d.z * d.z - d.y * d.y, o.x * d.x + o.z * d.z + k * d.y,
                          o.x * o.x + o.z * o.z - k * k, root);
    for (int i = 0; i < roots; i++) {
        shd_vec3 p = along(ray, root[i]);
        if (!(fabs(p.y) <= 0.5) || !nearer(root[i], ray, &best)) continue;
        double radius = sqrt(p.x * p.x + p.z * p.z), wanted = 0.5 - p.y;
        if (radius > 0) {
            p.x *= wanted / radius;
            p.z *= wanted / radius;
        }
        shd_vec3 n = {p.x, wanted, p.z};
        if (!(shd_max_abs(n) > 0)) n = (shd_vec3){0, 1, 0}; /* the apex has no normal: up */
        *out = (shd_surface){root[i], p, n};
        hit = true;
    }
    return hit;
}

/* Shapes of finite size are met from where the ray is closest to their centre; what is left of
 * the coordinates is then of the shape's own size. */
static double move_closer(shd_ray *ray) {
    double shift = -shd_dot(ray->origin, ray->direction) / shd_dot(ray->direction, ray->direction);
    ray->origin = along(ray, shift);
    ray->near -= shift;
    return shift;
}

bool shd_intersect(shd_shape shape, double tube, const shd_ray *ray, shd_surface *out) {
    if (shape == SHD_PLANE) return plane(ray, out);
    shd_ray near = *ray;
    double shift = move_closer(&near);
    bool hit = false;
    switch (shape) {
    case SHD_SPHERE:
        hit = sphere(&near, out);
        break;
    case SHD_DISC:
        hit = disc(&near, out);
        break;
    case SHD_BOX:
        hit = box(&near, out);
        break;
    case SHD_CYLINDER:
        hit = cylinder(&near, out);
        break;
    case SHD_CONE:
        hit = cone(&near, out);
        break;
    case SHD_TORUS:
        hit = shd_intersect_torus(tube, &near, out);
        break;
    case SHD_PLANE:
    case SHD_MESH:
    case SHD_SHAPE_COUNT:
        break;
    }
    if (hit) out->t += shift;
    return hit;
}
