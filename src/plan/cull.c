/* Lights that do not reach a patch of surface. */
#include <string.h>

#include "plan/parts.h"

shd_cone shd_light_cone(const shd_plan_light *light) {
    if (!light->spot) return (shd_cone){-1, 0};
    double cosine = 1 - light->outer;
    if (light->exponent > 0 && cosine < 0) cosine = 0;
    return (shd_cone){cosine, sqrt(fmax(0, 1 - cosine * cosine))};
}

bool shd_outside_cone(shd_cone cone, shd_vec3 axis, shd_vec3 path, double radius) {
    /* From the light to the center: -path. */
    double squared = shd_dot(path, path), along = -shd_dot(path, axis);
    double away = sqrt(fmax(0, squared - along * along));
    return away * cone.cosine - along * cone.sine >
           radius + SHD_PLAN_MARGIN * (sqrt(squared) + radius);
}

/* Whether N.L <= 0 for all points and normals of the patch. N.(l - p) is at most |l - center|
 * cos(the least angle) + radius. */
static bool is_behind_patch(const shd_plan_light *light, const shd_patch *patch, double sine,
                            shd_vec3 path) {
    if (!(patch->cos_spread > 0)) return false;
    double radius = light->directional ? 0 : patch->radius;
    double squared = shd_dot(path, path), length = sqrt(squared);
    double along = shd_dot(path, patch->axis);
    if (!(along < length * patch->cos_spread)) return false;
    double away = sqrt(fmax(0, squared - along * along));
    return along * patch->cos_spread + away * sine + radius <= -SHD_PLAN_MARGIN * (length + radius);
}

size_t shd_plan_cull(const shd_plan *plan, const shd_patch *patch, const uint32_t *in, size_t count,
                     uint32_t *out) {
    size_t kept = 0;
    if (plan->sweep->whole) {
        memmove(out, in, count * sizeof *out);
        return count;
    }
    const double cosine = patch->cos_spread, sine = sqrt(fmax(0, 1 - cosine * cosine));
    for (size_t i = 0; i < count; i++) {
        const shd_plan_light *light = &plan->lights[in[i]];
        const shd_vec3 path =
            light->directional ? light->toward : shd_sub(light->position, patch->center);
        if (is_behind_patch(light, patch, sine, path)) continue;
        if (light->spot &&
            shd_outside_cone(plan->sweep->cones[in[i]], light->axis, path, patch->radius))
            continue;
        out[kept++] = in[i];
    }
    return kept;
}
