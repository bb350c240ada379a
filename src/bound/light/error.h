/* How far the kernels' weights are from the model. Error bounds are made of this.
 *
 * A light's weights are wd = f s (N.L)+ and ws = f s g (R.V)+^ns. With F the largest f s of the
 * points in question, a tier errs by at most
 *
 *     |d wd| <= F (facing + moved) + relative wd
 *     |d ws| <= F (faint + lobe) + relative ws
 *
 * `moved` is how far rounding of positions moves the direction to the light. `faint` and `lobe`
 * depend on how bright the highlight may be there. The model jumps on edges (N.L = 0 under a
 * highlight, the rim of a cone without penumbra), and a shininess below 1 makes a cliff at R.V = 0,
 * where the slope of (R.V)^ns has no limit. Points within f32's rounding of an edge (plan/tier.h)
 * are lit in f64. Those within f64's rounding may fall on its other side in each tier. No bound
 * counts these points, which are single samples.
 *
 * The figures are 1.2 times and more what 2e5 random points have shown for each path and each of 26
 * exponents from 1 to 1e6. tests/unit/shade_errors.c holds them against 113-bit floats, and
 * tests/property/bounds.c holds whole pictures. */
#pragma once

#include "plan/plan.h"

/* The way on which a light's weights are computed. Spots go the way of attenuated lights. */
typedef enum shd_path {
    SHD_PATH_DIRECTIONAL,
    SHD_PATH_POINT,
    SHD_PATH_ATTENUATED,
    SHD_PATHS
} shd_path;

typedef struct shd_path_error {
    double facing;    /* of N.L */
    double relative;  /* of the distance and what depends on it */
    double direction; /* of L and W, as a chord; ns multiplies it */
} shd_path_error;

/* How kernels round: in f64; in f32, products with the sums that they are added to, or by
 * themselves. */
typedef enum shd_rounding { SHD_ROUNDS_64, SHD_ROUNDS_FUSED, SHD_ROUNDS_LOOSE } shd_rounding;

/* How Phong's kernels of an instruction set do in a tier. */
shd_rounding shd_rounding_of(shd_tier tier, shd_isa isa);

const shd_path_error *shd_path_error_of(shd_rounding rounding, shd_path path);

/* Of a plan that is sketched (shade/sketch.h), whose lobes are SHD_ROUNDS_LOOSE: no less than the
 * standard tier's, which draws the rest of its pictures. On ellipsoids, or on balls and planes. */
const shd_path_error *shd_sketch_error_of(bool ellipsoid, shd_path path);

/* The relative error of a color. It counts the sum of a group of lights in f32 (or the rounding of
 * an f64 sum to f32), products with the material, interpolation between vertices, the mean of a
 * pixel's samples, and the sum of its parts if it sees several materials or the background. */
double shd_color_error(const shd_plan *plan, shd_tier tier);

/* A lobe errs in proportion to itself above this part of its top, and absolutely below. */
static const double SHD_LOBE_FOOT = 1e-3;

/* What the errors of a lobe are made of. (R.V)^ns is off by its derivative times the error of
 * c = R.V = 1 - |L - W|^2 / 2. That is ns c^(ns - 1) sqrt(2 - 2 c) times the error of L and W, a
 * factor that rises up to c = (ns - 1) / (ns - 1/2), the square's rounding, and the functions'. */
typedef struct shd_lobe_error {
    double shininess;
    double crest, slope; /* that c, and ns c^(ns - 1) there */
    double square;       /* the relative error of |L - W|^2 */
    double foot;         /* the c at which (R.V)^ns is SHD_LOBE_FOOT */
    double turned_ratio; /* that factor over (R.V)^ns from `foot` on; infinite: there is no limit */
    double ratio;        /* the error of functions, relative to (R.V)^ns */
    double faint, rough; /* what is cut off as nothing; errors of functions near it */
} shd_lobe_error;

/* `lights`: how many the scene has, for these share what is cut off. */
shd_lobe_error shd_lobe_error_of(shd_rounding rounding, double shininess, size_t lights);

/* (shine+)^shininess. */
double shd_shine_power(double shine, double shininess);

/* The lobe's error by directions that are off by `direction`, if R.V is at most `shine` and
 * (R.V)^ns at most `power`; then the part of it that is not in proportion to the lobe, and the rest
 * of it, relative to the lobe. */
double shd_lobe_turned(const shd_lobe_error *e, double shine, double power, double direction);
double shd_lobe_foot(const shd_lobe_error *e, double shine, double power, double direction);
double shd_lobe_ratio(const shd_lobe_error *e, double direction);

/* The errors by functions, and by what is cut off or near that. */
double shd_lobe_functions(const shd_lobe_error *e, double power);
double shd_lobe_faint(const shd_lobe_error *e, double power);

/* The errors by directions and by functions together. Each is small where the other is largest. */
double shd_lobe_sum(double turned, double functions);

/* The error of a spot's factor s if cos t is in [low, high] and directions are off by `moved`. */
double shd_spot_error(shd_rounding rounding, const shd_plan_light *spot, double low, double high,
                      double moved);
