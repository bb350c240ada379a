#include "render/tiles/far.h"

#include "bound/light/pieces.h"
#include "bound/light/weakest.h"

/* Whether no point is near a spot's rim, so that its light is that of a point. */
static bool is_within_cone(const shd_plan_light *spot, const shd_lit *lit) {
    static const double CLEAR = 1e-5;
    return spot->exponent == 0 && 1 - lit->axis_low <= spot->inner - CLEAR;
}

/* Whether it shines alike to all points, and nothing that is below 0. */
static bool is_plain(const shd_plan_light *light, const shd_lit *lit) {
    return !light->shape && !light->environment && (!light->spot || is_within_cone(light, lit)) &&
           light->color[0] >= 0 && light->color[1] >= 0 && light->color[2] >= 0;
}

/* What is left out, in any channel, of a light that is taken; infinite: it may not be. N.L must be
 * above 0 at all points, for certain. *most: the most that it adds to any channel. */
static double cost_of(const shd_plan *plan, const shd_plan_material *material,
                      const shd_patch *patch, const shd_piece *piece, const shd_plan_light *light,
                      double *most) {
    static const double CLEAR = 1e-4, NEAREST = 1e-30, FARTHEST = 1e30;
    shd_lit lit;
    *most = 0;
    if (!shd_piece_lit(plan->scene, piece, light, 0, &lit)) return INFINITY;
    double shone[3] = {0, 0, 0}, rest = INFINITY, sum = 0;
    for (size_t k = 0; k < material->lobe_count; k++) {
        const shd_plan_lobe *lobe = &material->lobes[k];
        const double power = shd_shine_most(lit.shine_high, lobe->shininess);
        for (int c = 0; c < 3; c++) shone[c] += fabs(lobe->specular[c]) * power * lit.factor_high;
    }
    if (is_plain(light, &lit) && lit.facing_low > CLEAR) {
        const double distance =
            light->directional ? 1 : shd_plan_length(shd_sub(light->position, patch->center));
        const bool known = distance > NEAREST && distance < FARTHEST;
        rest = known ? shd_far_rest(light, distance, patch->radius) : (double)INFINITY;
        rest *=
            (light->directional ? 1 : shd_attenuation(light, distance)) * (1 + SHD_PIECE_MARGIN);
    }
    for (int c = 0; c < 3; c++) {
        const double kd = fabs(material->diffuse[c]), color = fabs(light->color[c]);
        sum = shd_larger(sum, color * (kd * rest + shone[c]));
        *most = shd_larger(*most, color * (kd * lit.facing_high * lit.factor_high + shone[c]));
    }
    return sum;
}

/* How much of the room all lights of the steps below the first that does not fit cost, and how many
 * of these there are. */
static size_t fill_room(const double *costs, size_t count, double room, int *end, double *left) {
    double sums[SHD_STRENGTH_STEPS] = {0};
    size_t counts[SHD_STRENGTH_STEPS] = {0}, taken = 0;
    for (size_t i = 0; i < count; i++) {
        const int step = shd_strength_step(costs[i], room);
        if (step == SHD_STRENGTH_STEPS) continue;
        sums[step] += costs[i];
        counts[step]++;
    }
    *end = 0;
    *left = room * (1 - 1e-9); /* for the sums' own rounding */
    for (; *end < SHD_STRENGTH_STEPS && sums[*end] <= *left; ++*end) {
        *left -= sums[*end];
        taken += counts[*end];
    }
    return taken;
}

size_t shd_far_gather(const shd_plan *plan, const shd_plan_material *material,
                      const shd_patch *patch, size_t points, double *room, uint32_t *lights,
                      size_t count, double *costs, shd_far *out) {
    out->lights = 0;
    if (!(*room > 0) || points < SHD_FAR_LEAST || count < SHD_FAR_LEAST || !material->has_diffuse ||
        !(patch->cos_spread > 0))
        return count;
    const shd_piece piece = shd_piece_of(plan->scene, patch);
    static const double SHARE = 0.9;
    double all = 0;
    for (size_t i = 0; i < count; i++) {
        double adds;
        costs[i] = cost_of(plan, material, patch, &piece, &plan->lights[lights[i]], &adds);
        all += adds;
    }
    /* The sum of both parts is rounded to f32 once more. */
    const double rounding = 0x1p-24 * all * (1 + SHD_PIECE_MARGIN), most = SHARE * *room - rounding;
    int end;
    double left;
    if (!(most > 0) || fill_room(costs, count, most, &end, &left) < SHD_FAR_LEAST) return count;
    *out = (shd_far){.center = patch->center, .channels = plan->grey_lights ? 1 : 3};
    size_t kept = 0;
    for (size_t i = 0; i < count; i++) {
        const int step = shd_strength_step(costs[i], most);
        const bool also = step == end && step < SHD_STRENGTH_STEPS && costs[i] <= left;
        if (also) left -= costs[i];
        if (also || step < end)
            shd_far_add(&plan->lights[lights[i]], out);
        else
            lights[kept++] = lights[i];
    }
    *room -= most - left + rounding;
    return kept;
}
