/* Lights that do not reach a patch of surface. */
#include <assert.h>
#include <string.h>

#include "plan/parts.h"

bool shd_outside_cone(const shd_plan_light *light, shd_vec3 path, double radius) {
    assert(light->spot);
    /* From the light to the center: -path. The cone's side is a line: a point that is y along the
     * axis and x away from it is x cosine - y sine away from the side. */
    double squared = shd_dot(path, path), along = -shd_dot(path, light->axis);
    double away = sqrt(fmax(0, squared - along * along));
    return away * light->cone.cosine - along * light->cone.sine >
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
    if (plan->whole) {
        memmove(out, in, count * sizeof *out);
        return count;
    }
    const double cosine = patch->cos_spread, sine = sqrt(fmax(0, 1 - cosine * cosine));
    for (size_t i = 0; i < count; i++) {
        const shd_plan_light *light = &plan->lights[in[i]];
        if (light->shape || light->environment) { /* It is not where its middle is. */
            out[kept++] = in[i];
            continue;
        }
        const shd_vec3 path =
            light->directional ? light->toward : shd_sub(light->position, patch->center);
        if (!is_behind_patch(light, patch, sine, path) &&
            !(light->spot && shd_outside_cone(light, path, patch->radius)))
            out[kept++] = in[i];
    }
    return kept;
}
