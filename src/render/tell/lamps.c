#include "render/tell/lamps.h"

#include "plan/around.h"

/* Pairs of objects and lights that are looked at. With more, the worst is told. */
enum { MOST_PAIRS = 1 << 22 };

/* How near the object comes to a point, at least. */
static double distance_to(const shd_plan *plan, size_t index, shd_vec3 point) {
    const shd_plan_object *bounds = &plan->objects[index];
    if (bounds->bounded)
        return shd_larger(shd_length(shd_sub(point, bounds->center)) - bounds->radius, 0);
    const shd_affine *map = &plan->scene->objects[index].transform;
    const shd_affine normal_map = shd_normal_map(map);
    shd_vec3 normal;
    if (!shd_normalize(shd_linear(&normal_map, (shd_vec3){0, 1, 0}), &normal)) return 0;
    return fabs(shd_dot(normal, shd_sub(point, map->origin)));
}

/* Lists of lights ascend. */
static bool reaches(const shd_plan_object *object, uint32_t j) {
    size_t low = 0, high = object->light_count;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        if (object->lights[middle] == j) return true;
        if (object->lights[middle] < j)
            low = middle + 1;
        else
            high = middle;
    }
    return false;
}

shd_area_method shd_lamp_method(const shd_plan *plan, uint32_t j, double *off) {
    const shd_light *light = plan->lights[j].shape;
    shd_area_method worst = SHD_AREA_POINT;
    *off = SHD_AREA_TOLERANCE;
    if (plan->scene->object_count > MOST_PAIRS / plan->light_count) return SHD_AREA_QUADRATURE;
    *off = 0;
    for (size_t i = 0; i < plan->scene->object_count; i++) {
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        const shd_plan_object *object = &plan->objects[i];
        if (!reaches(object, j)) continue;
        const shd_plan_material *material = &plan->materials[object->material];
        double of_object;
        shd_area_method method =
            shd_area_choose(light, material->lobes, material->lobe_count,
                            distance_to(plan, i, light->position), plan->point_off, &of_object);
        if (material->model != SHD_MODEL_PHONG) {
            method = SHD_AREA_QUADRATURE;
            of_object = SHD_AREA_MODEL_TOLERANCE;
        }
        worst = method > worst ? method : worst;
        *off = shd_larger(of_object, *off);
    }
    return worst;
}

const char *shd_around_method(const shd_plan *plan, uint32_t j, double *off) {
    const shd_plan_light *light = &plan->lights[j];
    bool tables = true;
    *off = 0;
    for (size_t i = 0; i < plan->scene->object_count; i++) {
        if (shd_is_cancelled_at(plan->cancelled, i)) break;
        const shd_plan_material *m = &plan->materials[plan->objects[i].material];
        if (!reaches(&plan->objects[i], j)) continue;
        for (size_t t = m->has_diffuse ? 0 : 1; t < 1 + m->lobe_count; t++) {
            const shd_glow *glow = shd_find_glow(plan, m, light, t);
            if (!shd_is_symmetric(m->model, t)) {
                tables = false;
                *off = shd_larger(plan->glows ? SHD_QUICK_SHARE : SHD_AROUND_TOLERANCE, *off);
                continue;
            }
            if (plan->glows && shd_may_be_walked(m, t)) {
                tables = false;
                *off = shd_larger(SHD_QUICK_SHARE, *off);
            }
            const double exponent = t ? m->lobes[t - 1].shininess : 1,
                         most = shd_surroundings_most(light->environment->map, exponent);
            tables &= glow != NULL;
            *off = shd_larger(glow ? glow->error / most : SHD_ENVIRONMENT_TOLERANCE, *off);
        }
    }
    return tables ? "tables" : "quadrature";
}

const char *shd_lamp_method_name(shd_area_method method) {
    static const char *const names[] = {[SHD_AREA_POINT] = "point",
                                        [SHD_AREA_CLOSED] = "closed form",
                                        [SHD_AREA_QUADRATURE] = "quadrature"};
    return names[method];
}
