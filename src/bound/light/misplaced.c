/* How far f64 puts points beside where exact arithmetic has them.
 *
 * With u = 2^-53, sight/tie.h adds up what rounding may do to a hit: 16 u times the lengths on its
 * way, off the surface. Along the ray that is 1 / N.V as much, and the point that is lit is beside
 * the true one by no more than that.
 *
 * Flat pieces. Where H is the height of the eye above the plane, N.V at the distance t is H / t.
 * The lengths are t and those of eye and object, S. So a point is moved by m = 16 u (S + t) t / H,
 * and a light at the distance d is turned by m / d.
 *
 * A plane goes on to its horizon, where m grows as t^2. There only as much of it counts as light
 * does: beyond T = 4 (|E - L| + H + h), with h the light's height, d is 3 t / 4 at least. Then R.V
 * is negative, for d^2 + t^2 - |E - L|^2 > 4 h H, so that nothing shines, and N.L = h / d is wrong
 * by no more than h m / d^2 <= 32 u (S / T + 1) h / H. What attenuation makes of m / d is twice
 * that.
 *
 * Round pieces. Let a surface bend by no more than k for each length. Where N.V is c at a point, it
 * is c - k s at least a length s along the ray from there, so that the ray gains c s - k s^2 / 2 of
 * height, and the e that is off within s = 2 e / c, if c^2 >= 2 k e. So normals are turned by 2 k e
 * / c at most, and a light at the distance d by 2 e / (c d). Nearer to the silhouette a ray that is
 * off by e may meet the surface anywhere or miss it: samples where c^2 < 2 k e lie on an edge to
 * within rounding, and those at which c is below 1e-4 count as that edge, too, as on meshes.
 *
 * A linear map M makes k |M| |M^-1|^2 of k, for it makes the second fundamental form that of M^-1 v
 * over the length of M^-T N. Cones bend without limit toward their apex, and triangles do not, but
 * the normals of their corners turn as if they did. Both are taken to bend as what is a tenth as
 * large as they are. Where they bend more, nearer to the apex and on small triangles, they count
 * where c is as much larger. */
#include "bound/light/misplaced.h"

/* The least N.V of round surfaces and meshes that counts. */
static const double GRAZING = 1e-4;

/* By how much the object's surface bends for each length. */
static double bend_of(const shd_place *place) {
    const shd_object *object = place->object;
    if (object->shape == SHD_MESH || !(place->norm > 0)) return 10 / place->bounds->radius;
    const double apex = object->shape == SHD_CONE ? 10 : 1,
                 radius = object->shape == SHD_TORUS ? object->tube : object->radius;
    return apex / radius * shd_norm(&object->transform) * place->norm * place->norm;
}

shd_misplaced shd_misplaced_of(const shd_scene *scene, const shd_place *place) {
    const shd_plan_object *bounds = place->bounds;
    const shd_object *object = place->object;
    const shd_vec3 eye = scene->camera.position,
                   center = bounds->bounded ? bounds->center : object->transform.origin;
    shd_misplaced out = {.plane = !bounds->bounded};
    out.span = shd_length(eye) + 2 * shd_length(shd_sub(center, eye)) + shd_length(center);
    if (scene->camera.projection == SHD_ORTHOGRAPHIC)
        out.span += scene->camera.height * (1 + (double)scene->raster.width / scene->raster.height);
    if (out.plane) {
        const shd_affine normals = shd_normal_map(&object->transform);
        out.point = object->transform.origin;
        shd_normalize(shd_linear(&normals, (shd_vec3){0, 1, 0}), &out.normal);
        return out;
    }
    out.span += bounds->radius;
    out.moved = SHD_HIT_ROUNDING * out.span;
    out.grazing = GRAZING;
    if (object->shape == SHD_DISC || object->shape == SHD_BOX) {
        out.flat =
            object->interpolation == SHD_PHONG && scene->materials[object->material].normal_texture;
        return out;
    }
    if (object->interpolation != SHD_PHONG || (object->shape == SHD_MESH && !object->mesh->normals))
        return out;
    out.smooth = object->shape == SHD_MESH;
    out.bend = bend_of(place);
    out.grazing = fmax(GRAZING, sqrt(2 * out.moved * out.bend));
    out.turned = fmin(2 * out.moved * out.bend / out.grazing, 1);
    return out;
}

double shd_misplaced_at(const shd_scene *scene, const shd_misplaced *m, const shd_piece *piece,
                        const shd_plan_light *light, double nearest, double *beyond) {
    const shd_camera *camera = &scene->camera;
    const bool orthographic = camera->projection == SHD_ORTHOGRAPHIC;
    *beyond = 0;
    if (light->directional) return 0;
    if (!m->plane && (m->smooth || (piece->spread.cosine < 1 && !m->flat))) {
        /* Of the mirrored view, and so of the view. */
        const shd_angle view = shd_angle_of(shd_dot(piece->axis, piece->mirror));
        const double facing = m->smooth ? 0 : shd_cosine_more(view, piece->glitter);
        return fmin(2 * m->moved / (fmax(facing, m->grazing) * nearest), 1);
    }
    /* Of many objects, pieces do not tell how they lie. */
    const shd_vec3 axis = m->plane ? m->normal : piece->axis,
                   point = m->plane ? m->point : piece->center;
    const double height = fabs(shd_dot(axis, shd_sub(point, camera->position)));
    double far = shd_length(shd_sub(piece->center, camera->position)) + piece->radius,
           steep = far / height;
    if (orthographic) {
        steep = 1 / fabs(shd_dot(axis, camera->back));
        far = (height + m->span) * steep;
    } else if (!(height > 4 * SHD_HIT_ROUNDING * m->span)) {
        /* A face from its edge is not seen, but by rounding. */
        return m->plane ? 1 : fmin(SHD_HIT_ROUNDING * m->span / nearest, 1);
    } else if (m->plane) {
        const double above = fabs(shd_dot(axis, shd_sub(light->position, point)));
        const double lit =
            4 * (shd_length(shd_sub(light->position, camera->position)) + height + above);
        if (far > lit) {
            *beyond = 3 * 2 * SHD_HIT_ROUNDING * (m->span / lit + 1) * above / height;
            far = lit;
            steep = far / height;
        }
    }
    return fmin(SHD_HIT_ROUNDING * (m->span + (m->plane ? far : 0)) * fmax(steep, 1) / nearest, 1);
}

/* Tangents of round shapes go around their own axis, which points count from 1e-4 of their size
 * away. Others are an axis laid onto the surface, 1e-3 of which is left at least, as of those
 * around an axis where a map turns normals. */
double shd_turned_around(const shd_place *place, bool mapped, double moved, double normal) {
    static const double LEFT = 1e-3, AWAY = 1e-4;
    const shd_object *object = place->object;
    const shd_shape shape = object->shape;
    if (shape != SHD_SPHERE && shape != SHD_CYLINDER && shape != SHD_CONE && shape != SHD_TORUS)
        return fmin((SHD_HIT_ROUNDING + normal) / LEFT, 4);
    const double across =
        shd_norm(&object->transform) * place->norm * moved / (AWAY * place->bounds->radius);
    return fmin((SHD_HIT_ROUNDING + across + normal) / (mapped ? LEFT : 1), 4);
}
