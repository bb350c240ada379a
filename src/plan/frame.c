/* The frame of f32 positions, and whether f32 is enough for them. */
#include "plan/parts.h"

/* Pairs of objects and lights that are looked at: with more, positions are split unseen. */
enum { MOST_PAIRS = 1 << 22 };

/* Nearer than this, in the frame's unit, a light's direction shows f32's rounding of positions:
 * 2^-25 of 1 is 6e-7 of it. */
static const double NEAR = 0.05;

/* Where positions are small: around the finite objects, or around the camera where there are
 * none. */
static void place_frame(shd_plan *plan) {
    const shd_scene *scene = plan->scene;
    shd_vec3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (size_t i = 0; i < scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        if (!object->bounded) continue;
        shd_vec3 c = object->center;
        double r = object->radius;
        low = (shd_vec3){fmin(low.x, c.x - r), fmin(low.y, c.y - r), fmin(low.z, c.z - r)};
        high = (shd_vec3){fmax(high.x, c.x + r), fmax(high.y, c.y + r), fmax(high.z, c.z + r)};
    }
    double size;
    if (low.x <= high.x) {
        plan->origin = shd_madd(shd_scale(low, 0.5), high, 0.5);
        size = shd_max_abs(shd_sub(shd_scale(high, 0.5), shd_scale(low, 0.5)));
    } else {
        plan->origin = scene->camera.position;
        size = shd_max_abs(scene->camera.position);
    }
    if (!shd_is_finite(plan->origin)) plan->origin = (shd_vec3){0, 0, 0};
    plan->scale = size > 1e-280 && size < 1e280 ? ldexp(1, -ilogb(size)) : 1;
}

/* At most the distance of a point from the object's surface, in the world's unit. Of boxes around
 * an object in its own frame: distances there shrink by the inverse's norm at most. */
static double least_distance(const shd_object *object, const shd_affine *inverse, double norm,
                             shd_vec3 low, shd_vec3 high, shd_vec3 point) {
    shd_vec3 p = shd_linear(inverse, shd_sub(point, object->transform.origin));
    if (object->shape == SHD_SPHERE) return fabs(shd_length(p) - object->radius) / norm;
    if (object->shape == SHD_PLANE) return fabs(p.y) / norm;
    shd_vec3 out = {fmax(fmax(low.x - p.x, p.x - high.x), 0),
                    fmax(fmax(low.y - p.y, p.y - high.y), 0),
                    fmax(fmax(low.z - p.z, p.z - high.z), 0)};
    double distance = shd_length(out);
    if (distance == 0 && object->shape == SHD_BOX) /* inside of it */
        distance = fmin(high.x - fabs(p.x), fmin(high.y - fabs(p.y), high.z - fabs(p.z)));
    return distance / norm;
}

static bool has_near_light(const shd_plan *plan, size_t index) {
    const shd_object *object = &plan->scene->objects[index];
    const shd_plan_object *bounds = &plan->objects[index];
    shd_affine linear = object->transform, inverse;
    linear.origin = (shd_vec3){0, 0, 0};
    shd_vec3 low, high;
    bool looked = false;
    double norm = 0;
    for (size_t i = 0; i < bounds->light_count; i++) {
        const shd_plan_light *light = &plan->lights[bounds->lights[i]];
        if (light->directional) continue;
        /* On a plane points may be as far out as the light, and rounded accordingly. */
        shd_vec3 from = shd_scale(shd_sub(light->position, plan->origin), plan->scale);
        double near = NEAR * (bounds->bounded ? 1 : fmax(1, shd_length(from))) / plan->scale;
        if (bounds->bounded) {
            shd_vec3 path = shd_sub(light->position, bounds->center);
            if (shd_length(path) - bounds->radius >= near) continue;
        }
        if (!looked) {
            if (!shd_invert(&linear, &inverse)) return true;
            norm = shd_norm(&inverse);
            shd_object_box(object, &low, &high);
            looked = true;
        }
        if (!(least_distance(object, &inverse, norm, low, high, light->position) >= near))
            return true;
    }
    return false;
}

static bool splits_positions(const shd_plan *plan) {
    size_t pairs = 0;
    for (size_t j = 0; j < plan->light_count; j++)
        if (plan->lights[j].steep) return true;
    for (size_t i = 0; i < plan->scene->object_count; i++) {
        const shd_plan_object *object = &plan->objects[i];
        const shd_plan_material *material = &plan->materials[object->material];
        for (size_t k = 0; object->light_count && k < material->lobe_count; k++)
            if (material->lobes[k].shininess < 1) return true;
        pairs += object->light_count;
        if (pairs > MOST_PAIRS || has_near_light(plan, i)) return true;
    }
    return false;
}

void shd_plan_frame(shd_plan *plan) {
    place_frame(plan);
    plan->split_positions = splits_positions(plan);
}
