#include "plan/occluders.h"

/* Triples of two objects and a light that are looked at; with more, looking would take longer than
 * it saves. */
enum { MOST_TRIPLES = 1 << 24 };

/* Whether a ball touches the hull of two others: it touches one of those between them, whose
 * centers and radii go evenly from one to the other. |o - s a| <= r + s g is a quadratic in s. */
static bool touches_hull(shd_ball from, shd_ball to, shd_ball other) {
    const shd_vec3 a = shd_sub(to.center, from.center), o = shd_sub(other.center, from.center);
    const double grows = to.radius - from.radius, r = from.radius + other.radius,
                 reach = shd_max_abs(a) + shd_max_abs(o) + r + fabs(grows), slack = 1e-9;
    if (!isfinite(reach)) return true;
    const double unit = reach > 0 ? 1 / reach : 1;
    const shd_vec3 p = shd_scale(a, unit), q = shd_scale(o, unit);
    const double g = grows * unit, h = r * unit + slack;
    const double x = shd_dot(p, p) - g * g, y = shd_dot(p, q) + h * g, z = shd_dot(q, q) - h * h;
    /* x s^2 - 2 y s + z <= 0 for some s in [0, 1] */
    if (z <= 0 || x - 2 * y + z <= 0) return true;
    const double s = y / x;
    return x > 0 && s > 0 && s < 1 && z - y * s <= 0;
}

/* The same of what is on the way of parallel light. */
static bool is_on_the_way(shd_ball from, shd_vec3 toward, shd_ball other) {
    const shd_vec3 o = shd_sub(other.center, from.center);
    const double radius = (from.radius + other.radius) * (1 + 1e-9) +
                          1e-9 * (shd_max_abs(from.center) + shd_max_abs(other.center)),
                 along = shd_dot(o, toward);
    return along >= -radius && shd_length(shd_madd(o, toward, -along)) <= radius;
}

static shd_ball ball_of(const shd_plan_object *object) {
    return (shd_ball){object->center, object->radius};
}

static shd_ball light_ball(const shd_plan_light *light) {
    return (shd_ball){light->position, light->shape ? shd_light_reach(light->shape) : 0};
}

/* Whether a plane is between a ball and a light, or touches one of them. */
static bool plane_is_between(const shd_object *plane, shd_ball at, const shd_plan_light *light) {
    const double(*m)[3] = plane->transform.linear;
    shd_vec3 normal = {0, 1, 0};
    const shd_vec3 x = {m[0][0], m[1][0], m[2][0]}, z = {m[0][2], m[1][2], m[2][2]},
                   origin = plane->transform.origin;
    if (!shd_normalize(shd_cross(z, x), &normal)) return true;
    const double slack = 1e-9 * (shd_max_abs(at.center) + shd_max_abs(origin)),
                 height = shd_dot(normal, shd_sub(at.center, origin)), side = height > 0 ? 1 : -1;
    if (fabs(height) <= at.radius * (1 + 1e-9) + slack) return true;
    if (light->directional) return side * shd_dot(normal, light->toward) < 1e-9;
    const shd_ball end = light_ball(light);
    return side * shd_dot(normal, shd_sub(end.center, origin)) <=
           end.radius * (1 + 1e-9) + slack + 1e-9 * shd_max_abs(end.center);
}

bool shd_may_hide(shd_ball at, const shd_plan_light *light, shd_ball by) {
    if (light->environment) return false;
    if (light->directional) return is_on_the_way(at, light->toward, by);
    return touches_hull(light_ball(light), at, by);
}

bool shd_may_object_hide(const shd_plan *plan, shd_ball at, const shd_plan_light *light,
                         size_t by) {
    const shd_plan_object *object = &plan->objects[by];
    if (light->environment) return false;
    return object->bounded ? shd_may_hide(at, light, ball_of(object))
                           : plane_is_between(&plan->scene->objects[by], at, light);
}

bool shd_is_flat(const shd_object *object) {
    return object->shape == SHD_PLANE ||
           (object->shape == SHD_DISC && object->interpolation == SHD_PHONG);
}

bool shd_shades_itself(const shd_plan *plan, size_t object) {
    return !shd_is_flat(&plan->scene->objects[object]) ||
           plan->materials[plan->objects[object].material].normal;
}

/* Whether `other` may shadow a point of `object`. */
static bool may_shadow(const shd_plan *plan, size_t object, const shd_plan_light *light,
                       size_t other) {
    const shd_plan_object *at = &plan->objects[object];
    if (object == other) return shd_shades_itself(plan, object);
    if (!at->bounded) return true;
    return shd_may_object_hide(plan, ball_of(at), light, other);
}

/* Lists what may shadow an object from a light, behind list[used]. */
static shd_occluders list_occluders(const shd_plan *plan, size_t object,
                                    const shd_plan_light *light, uint32_t *list, uint32_t used) {
    shd_occluders found = {used, 0};
    for (uint32_t k = 0; k < plan->scene->object_count; k++) {
        if (!may_shadow(plan, object, light, k)) continue;
        if (found.count == SHD_OCCLUDERS_MOST)
            return (shd_occluders){used, (uint32_t)SHD_OCCLUDERS_ANY};
        list[used + found.count++] = k;
    }
    return found;
}

bool shd_find_occlusion(const shd_plan *plan, shd_arena *arena, shd_occlusion *out) {
    const size_t objects = plan->scene->object_count, lights = plan->light_count;
    *out = (shd_occlusion){.pair_count = objects * lights, .shadowed = objects * lights};
    if (!lights || (double)objects * (double)objects * (double)lights > MOST_TRIPLES) return true;
    shd_occluders *pairs = shd_arena_alloc(arena, objects * lights, sizeof *pairs);
    uint32_t *list = shd_arena_alloc(arena, objects * lights * SHD_OCCLUDERS_MOST, sizeof *list);
    if (!pairs || !list) return false;
    uint32_t used = 0;
    out->shadowed = 0;
    for (size_t i = 0; i < objects; i++) {
        if (shd_is_cancelled(plan->cancelled)) return false;
        for (size_t j = 0; j < lights; j++) {
            const shd_occluders o = pairs[i * lights + j] =
                list_occluders(plan, i, &plan->lights[j], list, used);
            if (o.count != (uint32_t)SHD_OCCLUDERS_ANY) used += o.count;
            out->shadowed += o.count > 0;
        }
    }
    out->pairs = pairs;
    out->list = list;
    return true;
}
