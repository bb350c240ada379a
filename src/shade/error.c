#include "shade/error.h"

/* Half an ulp of f32 and f64, relative. */
static const double U32 = 0x1p-24, U64 = 0x1p-53;

static double unit_of(shd_tier tier) {
    return tier == SHD_EXACT ? U64 : U32;
}

/* Of L and W together, as chords. In f32 W is rounded (sqrt(3)/2 units), as is the light (the
 * same), and the difference of positions (1). The exact tier computes W in f64, too: N.V, the
 * products, the difference, and N and V that are not of unit length to the last digit. */
static double direction_of(shd_tier tier) {
    return (tier == SHD_EXACT ? 8 : 3) * unit_of(tier);
}

shd_diffuse_error shd_tier_diffuse_error(shd_tier tier) {
    const double u = unit_of(tier);
    /* The distance, its inverse, the products and the sum, a unit each; what is rounded of N, L and
     * their products is absolute. */
    return (shd_diffuse_error){8 * u, 4 * u};
}

double shd_tier_specular_error(shd_tier tier, double shininess, double moved) {
    const double u = unit_of(tier);
    const double turned = 0.61 * sqrt(shininess) * (direction_of(tier) + moved);
    /* e^-1 of 8 units of d, 3 units each of the logarithm and the exponential, the cut at exp(-17),
     * and the products. */
    const double own = 10 * u;
    if (tier != SHD_DRAFT) return own + turned;
    /* 2^t to 6.4e-5, the logarithms to 2.4e-5 of the power, and the cut at exp(-11). Up to ns = 300
     * d = 1 - L.W, which is off by 6 units, of which 1/2 is below d = 0 and does not count. */
    const double rough = 6.4e-5 + 2.4e-5 + 1.7e-5;
    return rough + turned + (shininess > 300 ? 0 : shininess * 6 * u);
}

double shd_tier_spot_error(shd_tier tier, const shd_plan_light *light, double moved) {
    const double u = unit_of(tier);
    const double e = 2 * u + moved; /* of L and the axis */
    double error = 4 * u;
    /* smoothstep is at most 1.5 / (outer - inner) steep, and q is off by sqrt(2 q) e + 6 q u. */
    if (light->outer > light->inner)
        error += 1.5 * (sqrt(2 * light->outer) * e + 6 * u * light->outer) /
                 (light->outer - light->inner);
    if (light->exponent > 0) error += shd_tier_specular_error(tier, light->exponent, moved);
    return error < 1 ? error : 1;
}

double shd_tier_attenuation_error(shd_tier tier, double moved) {
    return 8 * unit_of(tier) + 2 * moved;
}

double shd_rounding_moves(double size, double reach, double distance) {
    return 0.87 * 2 * U32 * (size + reach) / distance;
}
