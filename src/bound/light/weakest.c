#include "bound/light/weakest.h"

#include "bound/light/pieces.h"

enum {
    STEPS = SHD_STRENGTH_STEPS,
    MOST_KNOWN = 256 /* lights of which it is kept how much they add */
};

/* The least that is seen of the patch, in any channel, by constant terms and diffuse light. */
static double least_seen(const shd_plan *plan, const shd_plan_material *material,
                         const shd_patch *patch, const uint32_t *in, size_t count) {
    const double cosine = patch->cos_spread, sine = sqrt(fmax(0, 1 - cosine * cosine));
    double light[3] = {0, 0, 0}, least = INFINITY;
    for (size_t i = 0; i < count && cosine > 0; i++) {
        const shd_plan_light *from = &plan->lights[in[i]];
        if (from->spot) continue; /* it may not reach all of the patch */
        shd_vec3 path = shd_sub(from->position, patch->center);
        double radius = patch->radius;
        if (from->directional) path = from->toward, radius = 0;
        double squared = shd_dot(path, path), length = sqrt(squared);
        double along = shd_dot(path, patch->axis), away = sqrt(fmax(0, squared - along * along));
        double facing = (along * cosine - away * sine - radius) / (length + radius);
        if (!(facing > 0)) continue;
        const double factor = shd_attenuation(from, length + radius);
        for (int c = 0; c < 3; c++) light[c] += factor * facing * from->color[c];
    }
    for (int c = 0; c < 3; c++)
        least = fmin(least, material->constant[c] + material->diffuse[c] * light[c]);
    return least > 0 ? least * (1 - 1e-3) : 0; /* less the picture's own errors */
}

double shd_patch_room(const shd_plan *plan, size_t object, const shd_patch *patch, double tolerance,
                      const uint32_t *lights, size_t count) {
    const shd_plan_material *material = &plan->materials[plan->objects[object].material];
    if (tolerance > 0 && plan->drop_relative > 0)
        tolerance += plan->drop_relative * least_seen(plan, material, patch, lights, count);
    return tolerance;
}

/* Drops whole steps of lights as long as they fit, the weakest first, and then as many lights of
 * the next step as fit, in their order. */
size_t shd_drop_weakest(const shd_plan *plan, size_t object, const shd_patch *patch, double room,
                        uint32_t *lights, size_t count) {
    if (!(room > 0)) return count;
    const shd_plan_material *material = &plan->materials[plan->objects[object].material];
    const shd_piece piece = shd_piece_of(plan->scene, patch);
    double known[MOST_KNOWN], sums[STEPS] = {0};
    for (size_t i = 0; i < count; i++) {
        const double most =
            shd_piece_most(plan->scene, &piece, material, &plan->lights[lights[i]], 0);
        if (i < MOST_KNOWN) known[i] = most;
        const int step = shd_strength_step(most, room);
        if (step < STEPS) sums[step] += most;
    }
    int full = 0;
    double left = room * (1 - 1e-9); /* for the sums' own rounding */
    while (full < STEPS && sums[full] <= left) left -= sums[full++];
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        const shd_plan_light *light = &plan->lights[lights[i]];
        const double most =
            i < MOST_KNOWN ? known[i] : shd_piece_most(plan->scene, &piece, material, light, 0);
        const int step = shd_strength_step(most, room);
        if (step == full && step < STEPS && most <= left)
            left -= most;
        else if (step >= full)
            lights[kept++] = lights[i];
    }
    return kept;
}
