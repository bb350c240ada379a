/* How far the kernels' weights are from the model: what error bounds are made of.
 *
 * A light's weights are wd = f s (N.L)+ and ws = f s g (R.V)+^ns. With F the largest f of the
 * points in question, a tier errs by at most
 *
 *     |d wd| <= F (absolute + relative (N.L)+)
 *     |d ws| <= F (faint + min(specular(ns), ratio(ns) (R.V)+^ns))
 *
 * but on edges: where the model jumps (N.L = 0 under a highlight, the rim of a cone without
 * penumbra) a point within rounding of the edge may fall on its other side. No bound counts
 * these: they are single samples.
 *
 * The figures are above what tests/unit/shade_sums.c and tests/property/bounds.c measure, of which
 * the latter fails where they are too small. */
#ifndef SHD_PLAN_ERROR_H
#define SHD_PLAN_ERROR_H

#include "scene/scene.h"

typedef struct shd_tier_error {
    double absolute, relative; /* of diffuse weights */
    double faint;              /* of specular weights: what is cut off as nothing */
    double direction;          /* of L and W, as chords: what ns multiplies */
    double specular;           /* beside that, of specular weights */
    double color;              /* relative, of a sample's color: sums, products, the film's f32 */
} shd_tier_error;

const shd_tier_error *shd_tier_error_of(shd_tier tier);

/* specular(ns) and ratio(ns) of the tier, where directions are off by `more` on top. The power is
 * exp(ns log(1 - d)) with d = |L - W|^2 / 2, off by sqrt(2 d) times the directions' error: of
 * (1 - d)^ns that is most at d = 1 / 2ns, and relative to it most where it fades, at ns d = 60,
 * where the logarithm's own error counts 40 times and more. */
double shd_specular_error(shd_tier tier, double shininess, double more);
double shd_specular_ratio(shd_tier tier, double shininess, double more);

#endif
