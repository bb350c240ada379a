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
 * Round pieces. A surface of the radius of curvature r is met at most sqrt(2 e r) beside the true
 * point, e being what is off: at the silhouette, where the ray touches it. Elsewhere e / N.V. Over
 * r, that turns its normal. It turns a light that is farther away than r by less than that, and one
 * that is nearer by up to 1 / N.V of e / d: of these e / d is counted, and no proof is given that
 * it is enough, nor for meshes and whole objects, whose pieces are not flat; `./dev attack` holds
 * them.
 */
#include "bound/light/misplaced.h"

#include "plan/tier.h"

/* 1 / N.V of all points of round surfaces that are seen but those on a silhouette: single samples,
 * as on other edges. */
static const double GRAZING = 1e4;

shd_misplaced shd_misplaced_of(const shd_scene *scene, const shd_place *place) {
    const shd_plan_object *bounds = place->bounds;
    const shd_object *object = place->object;
    const shd_vec3 eye = scene->camera.position,
                   center = bounds->bounded ? bounds->center : object->transform.origin;
    shd_misplaced out = {.plane = !bounds->bounded};
    out.span = shd_length(eye) + 2 * shd_length(shd_sub(center, eye)) + shd_length(center);
    if (scene->camera.projection == SHD_ORTHOGRAPHIC)
        out.span += scene->camera.height * (1 + (double)scene->raster.width / scene->raster.height);
    if (out.plane) return out;
    out.span += bounds->radius;
    const bool mesh = object->shape == SHD_MESH;
    const double off = SHD_HIT_ROUNDING * out.span;
    out.moved = off;
    if (object->shape == SHD_DISC || object->shape == SHD_BOX) return out;
    if (object->interpolation != SHD_PHONG || (mesh && !object->mesh->normals)) return out;
    /* A surface turns by 1 / radius for each length, and as much between a mesh's normals, which
     * are taken for those of something a tenth as large as it is: as other meshes have them,
     * `./dev attack` holds. */
    const shd_vec3 size = shd_sub(place->high, place->low);
    double narrow = bounds->radius / 10;
    if (!mesh && place->known) narrow = fmin(fmin(size.x, size.y), size.z) / 2 / place->norm;
    const double turn = off / narrow;
    out.turned = narrow > 0 ? fmin(fmin(sqrt(2 * turn), GRAZING * turn), 1) : 1;
    return out;
}

double shd_misplaced_at(const shd_scene *scene, const shd_misplaced *m, const shd_piece *piece,
                        const shd_plan_light *light, double nearest, double *beyond) {
    const shd_camera *camera = &scene->camera;
    const bool orthographic = camera->projection == SHD_ORTHOGRAPHIC;
    *beyond = 0;
    if (light->directional) return 0;
    if (piece->spread.cosine < 1) return fmin(m->moved / nearest, 1);
    const shd_vec3 path = shd_sub(piece->center, camera->position);
    const double height = fabs(shd_dot(piece->axis, path));
    double far = shd_length(path) + piece->radius, steep = far / height;
    if (orthographic) {
        steep = 1 / fabs(shd_dot(piece->axis, camera->back));
        far = (height + m->span) * steep;
    } else if (!(height > 4 * SHD_HIT_ROUNDING * m->span)) {
        /* A face from its edge is not seen, but by rounding. */
        return m->plane ? 1 : fmin(SHD_HIT_ROUNDING * m->span / nearest, 1);
    } else if (m->plane) {
        const double above = fabs(shd_dot(piece->axis, shd_sub(light->position, piece->center)));
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
