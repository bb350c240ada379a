#include "plan/error.h"

#include <math.h>

static const shd_tier_error errors[] = {
    /* Lobes are cut at exp(-11) and exp(-17), shared by the lights. */
    [SHD_DRAFT] = {1.6e-7, 3e-7, 1.7e-5, 1.6e-7, 1.6e-4, 3e-7},
    [SHD_STANDARD] = {1.6e-7, 3e-7, 6e-8, 1.6e-7, 2.5e-7, 3e-7},
    /* In f64, 1e-12 is nothing beside the film's f32. */
    [SHD_EXACT] = {1e-13, 1e-13, 0, 1e-15, 1e-13, 6e-8},
};

const shd_tier_error *shd_tier_error_of(shd_tier tier) {
    return &errors[tier];
}

double shd_specular_error(shd_tier tier, double shininess, double more) {
    const shd_tier_error *e = &errors[tier];
    return e->specular + 0.61 * sqrt(shininess) * (e->direction + more) + 2 * more;
}

double shd_specular_ratio(shd_tier tier, double shininess, double more) {
    const shd_tier_error *e = &errors[tier];
    return 40 * e->specular + sqrt(120 * shininess) * (e->direction + more) + 2 * more;
}
