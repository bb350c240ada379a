/* The frame of f32 positions, and whether f32 is enough for them. */
#include "plan/bundles.h"

enum {
    MOST_PAIRS = 1 << 22, /* of objects and lights; with more, positions are split in any case */
    FEW_OBJECTS = 32      /* whose lights are looked at one by one: bundles cost as much as these */
};

/* If a light is nearer than this, in the frame's unit, its direction shows f32's rounding of
 * positions: 2^-25 is 6e-7 of it. */
static const double NEAR = 0.05;

/* Places the frame around the finite objects, or around the camera if there are none. */
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
    /* The scale and its inverse are normal numbers. */
    plan->scale = 1;
    if (size > 0 && size < INFINITY)
        plan->scale = ldexp(1, (int)shd_larger(shd_smaller(-ilogb(size), 1022), -1022));
}

/* Whether a point is clearly farther from the sphere around an object. Most are. */
static bool is_beyond(const shd_plan_object *object, shd_vec3 point, double distance) {
    const shd_vec3 path = shd_sub(point, object->center);
    const double reach = (object->radius + distance) * (1 + SHD_PIECE_MARGIN);
    return object->bounded && shd_dot(path, path) > reach * reach && reach > 1e-100;
}

/* Whether all lights are beyond. `bundles` may be empty, and tell of none. */
static bool are_all_beyond(const shd_bundles *bundles, const shd_plan_object *object,
                           double distance) {
    const shd_rows *rows = &bundles->placed;
    const shd_vec3 at = object->center;
    for (size_t k = 0; k < bundles->count;) {
        const shd_bundle *b = &bundles->list[k];
        /* Of the box, what is nearest. */
        const shd_vec3 nearest = shd_vec3_min(shd_vec3_max(at, b->low), b->high);
        const bool clear = is_beyond(object, nearest, distance);
        for (size_t i = b->first; !clear && b->count <= SHD_TOGETHER && i < b->first + b->count;
             i++)
            if (!is_beyond(object, (shd_vec3){rows->x[i], rows->y[i], rows->z[i]}, distance))
                return false;
        k = clear ? b->next : k + 1;
    }
    return bundles->list;
}

static bool has_near_light(const shd_plan *plan, const shd_bundles *bundles, size_t index) {
    const shd_plan_object *object = &plan->objects[index];
    if (are_all_beyond(bundles, object, NEAR / plan->scale)) return false;
    const shd_place place = shd_place_of(&plan->scene->objects[index], object);
    for (size_t i = 0; i < object->light_count; i++) {
        const shd_plan_light *light = &plan->lights[object->lights[i]];
        if (light->directional) continue;
        double near = NEAR * shd_plan_size(plan, object, light) / plan->scale;
        if (is_beyond(object, light->position, near)) continue;
        if (!(shd_least_distance(&place, light->position) >= near)) return true;
    }
    return false;
}

double shd_plan_size(const shd_plan *plan, const shd_plan_object *object,
                     const shd_plan_light *light) {
    if (object->bounded) return 1;
    return fmax(1, plan->scale * shd_length(shd_sub(light->position, plan->origin)));
}

static size_t count_pairs(const shd_plan *plan) {
    size_t pairs = 0;
    for (size_t i = 0; i < plan->scene->object_count; i++) pairs += plan->objects[i].light_count;
    return pairs;
}

static bool splits_positions(const shd_plan *plan, const shd_bundles *bundles) {
    for (size_t j = 0; j < plan->light_count; j++)
        if (plan->lights[j].steep || shd_has_hard_rim(&plan->lights[j])) return true;
    for (size_t i = 0; i < plan->scene->object_count; i++) {
        if (shd_is_cancelled(plan->cancelled)) return true;
        const shd_plan_object *object = &plan->objects[i];
        const shd_plan_material *material = &plan->materials[object->material];
        for (size_t k = 0; object->light_count && k < material->lobe_count; k++)
            if (shd_is_sheer(material->lobes[k].shininess)) return true;
        if (has_near_light(plan, bundles, i)) return true;
    }
    return false;
}

bool shd_plan_frame(shd_plan *plan, shd_bundles *bundles, shd_arena *arena) {
    place_frame(plan);
    const size_t pairs = count_pairs(plan);
    /* Where a pattern is, is told by all of f64, so that every tier has the same. */
    plan->split_positions = plan->textured || pairs > MOST_PAIRS;
    if (plan->split_positions) return true;
    if (pairs > FEW_OBJECTS * plan->light_count && !shd_bundles_need(plan, arena, bundles))
        return false;
    plan->split_positions = splits_positions(plan, bundles);
    return true;
}
