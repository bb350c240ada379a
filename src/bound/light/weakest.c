#include "bound/light/weakest.h"

#include "bound/light/pieces.h"

/* Powers of two, by which one pass over the lights sorts them well enough. */
enum { STEPS = 64 };

static int strength_step(double most, double tolerance) {
    if (!(most <= tolerance)) return STEPS; /* also if it is not a number */
    const double share = most / tolerance;
    if (share == 0) return 0; /* it has no exponent */
    int exponent;
    frexp(share, &exponent); /* (0, 1] has exponents up to 1 */
    int step = exponent + STEPS - 2;
    return step < 0 ? 0 : step;
}

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

/* Lights of which it is kept how much they add. */
enum { MOST_KNOWN = 256 };

typedef struct weighing {
    const shd_plan *plan;
    const shd_plan_material *material;
    shd_piece piece;
    const uint32_t *in;
    double most[MOST_KNOWN];
} weighing;

static double most_of_light(const weighing *w, size_t i) {
    const shd_plan_light *light = &w->plan->lights[w->in[i]];
    return shd_piece_most(w->plan->scene, &w->piece, w->material, light, 0);
}

/* Drops whole steps of lights as long as they fit, the weakest first, and then as many lights of
 * the next step as fit, in their order. */
static size_t keep_strongest(weighing *w, double tolerance, size_t count, uint32_t *out) {
    double sums[STEPS] = {0};
    for (size_t i = 0; i < count; i++) {
        const double most = most_of_light(w, i);
        if (i < MOST_KNOWN) w->most[i] = most;
        int step = strength_step(most, tolerance);
        if (step < STEPS) sums[step] += most;
    }
    int full = 0;
    double left = tolerance * (1 - 1e-9); /* for the sums' own rounding */
    while (full < STEPS && sums[full] <= left) left -= sums[full++];
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        const double most = i < MOST_KNOWN ? w->most[i] : most_of_light(w, i);
        int step = strength_step(most, tolerance);
        if (step < full) continue;
        if (step == full && step < STEPS && most <= left) {
            left -= most;
            continue;
        }
        out[kept++] = w->in[i];
    }
    return kept;
}

size_t shd_drop_weakest(const shd_plan *plan, size_t object, const shd_patch *patch,
                        double tolerance, uint32_t *lights, size_t count) {
    if (!(tolerance > 0)) return count;
    const shd_plan_material *material = &plan->materials[plan->objects[object].material];
    if (plan->drop_relative > 0)
        tolerance += plan->drop_relative * least_seen(plan, material, patch, lights, count);
    weighing w;
    w.plan = plan;
    w.material = material;
    w.in = lights;
    w.piece = shd_piece_of(plan->scene, patch);
    return keep_strongest(&w, tolerance, count, lights);
}
