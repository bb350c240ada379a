/* What planning and proving know of environments. */
#pragma once

#include "plan/peaks.h"
#include "plan/spread.h"
#include "scene/surroundings.h"

/* No color of a map becomes a larger one in the working space than its largest channel times this.
 */
static inline double shd_around_gain(const shd_light *environment) {
    double most = 0;
    for (int k = 0; k < 3; k++) {
        double sum = 0;
        for (int c = 0; c < 3; c++) sum += fabs(environment->of_map[k][c]);
        most = shd_larger(most, sum);
    }
    return most;
}

/* Whether a term is a power of a cosine to one direction, cut by the horizon at most: Lambert's
 * light and Phong's lobes. */
static inline bool shd_is_symmetric(shd_model model, size_t term) {
    if (term == 0) return model != SHD_MODEL_OREN_NAYAR && model != SHD_MODEL_WESTIN;
    return model == SHD_MODEL_PHONG;
}

/* A table of an exponent n stands for others, too, as far as log(n + 1) is from theirs by this.
 * With y = -(n + 1) log x, a lobe (n + 1) x^n changes with that logarithm by 1 - y of itself. The
 * most that |1 - y| e^-y makes of any map is less than what e^-y does: no part of the sphere has
 * more of it than one as large has of e^-y in its middle, and all has 2 / e of it. So what is read
 * is off by this part of the most that the environment adds. */
static const double SHD_GLOW_WIDENED = 0x1p-9;

/* Whether the map may have to be walked for the term (shade/around.h). Phong's lobes are, by tiers
 * that have tables, where a point has another exponent than its material. */
static inline bool shd_may_be_walked(const shd_plan_material *m, size_t term) {
    return !shd_is_symmetric(m->model, term) || (term > 0 && m->pointwise);
}

/* Whether samples that see the material may share walks (render/tiles/smooth.h). */
static inline bool shd_may_share_walks(const shd_plan *plan, const shd_plan_material *m) {
    return !plan->bins && plan->glows && plan->moments && m->model != SHD_MODEL_PHONG &&
           !m->pointwise && !m->normal && !m->from->fresnel.f0_texture;
}

/* How wide a lobe is, in radians: of half vectors, or of directions. */
static inline double shd_around_width(shd_model model, double sharpness) {
    const double of_power = 1 / sqrt(shd_larger(sharpness, 1));
    const bool is_power = model == SHD_MODEL_PHONG || model == SHD_MODEL_PHONG_NORMALIZED;
    if (model == SHD_MODEL_COOK_TORRANCE) return shd_smaller(sharpness * sqrt(0.5), 0.4);
    if (model == SHD_MODEL_BLINN_PHONG) return shd_smaller(of_power, 0.4);
    return is_power ? shd_smaller(of_power, 0.6) : 0.8;
}

/* The most that a weight of (L.W)+^exponent is, in any channel: 1 / pi times the integral. */
static inline double shd_around_most(const shd_light *environment, double exponent) {
    return shd_around_gain(environment) * shd_surroundings_most(environment->map, exponent);
}

/* The same of any term, of which no direction has more than `peak`, if that is less than
 * shd_peak_of says: the brightest part of the map that is so large that the peak makes the whole.
 */
static inline double shd_around_most_of(const shd_light *environment, const shd_plan_material *m,
                                        size_t term, double peak) {
    if (shd_is_symmetric(m->model, term))
        return shd_around_most(environment, term ? shd_dullest(m, term - 1) : 1);
    const shd_peak own = shd_peak_of(m, term);
    const double most = shd_smaller(own.most, peak), gain = shd_around_gain(environment);
    if (!(most < INFINITY)) return gain * environment->map->most * own.whole;
    return gain * most / SHD_PI *
           shd_surroundings_brightest(environment->map, SHD_PI * own.whole / most);
}

/* By how much such a weight changes at most if W and the normal turn by `off`. The power's slope by
 * W is n (L.W)^(n-1) at most, and what the half sphere wins or loses, a strip all around it. */
static inline double shd_around_turned(const shd_light *environment, double exponent, double off) {
    const double strip = 4 * shd_around_gain(environment) * environment->map->most,
                 slope = exponent > 0 ? exponent * shd_around_most(environment, exponent - 1) : 0;
    return off * (strip + slope);
}

/* The most, and the slope by direction in radians, of what is seen behind all objects, in the
 * working space, whatever share of its bins is left; 0: there is no environment. */
static inline double shd_backdrop_scale(const shd_plan *plan) {
    const shd_light *light = plan->scene->backdrop;
    if (!light) return 0;
    return fabs(light->color[0]) * shd_around_gain(light) *
           (plan->tinted ? shd_lifted_most(plan->bins) : 1);
}
static inline double shd_backdrop_most(const shd_plan *plan) {
    const shd_light *light = plan->scene->backdrop;
    return light ? shd_backdrop_scale(plan) * light->seen->most : 0;
}
static inline double shd_backdrop_slope(const shd_plan *plan) {
    const shd_light *light = plan->scene->backdrop;
    return light ? shd_backdrop_scale(plan) * light->seen->slope : 0;
}
