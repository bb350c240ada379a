/* How far the kernels' weights are from the model: what error bounds are made of.
 *
 * A light's weights are wd = f s (N.L)+ and ws = f s g (R.V)+^ns. With F the largest f s of the
 * points in question, a tier errs by at most
 *
 *     |d wd| <= F (facing + moved) + relative wd
 *     |d ws| <= F (faint + lobe) + relative ws
 *
 * where `moved` is what rounding of positions moves the direction to the light by; faint and lobe
 * depend on how bright the highlight may be there. On edges the model jumps (N.L = 0 under a
 * highlight, the rim of a cone without penumbra), and a point within rounding of one may fall on
 * its other side. No bound counts these: they are single samples. A shininess below 1 makes a cliff
 * of R.V = 0, where (R.V)^ns has no slope that ends: there samples below SHD_CLIFF are its edge.
 *
 * The figures are 1.2 times and more what 2e5 random points have shown for each path and each of 26
 * exponents from 1 to 1e6. tests/unit/shade_errors.c holds them against 113-bit floats, and fails
 * where an error exceeds them, as does tests/property/bounds.c with whole pictures. */
#ifndef SHD_BOUND_LIGHT_ERROR_H
#define SHD_BOUND_LIGHT_ERROR_H

#include "plan/plan.h"

#define SHD_CLIFF 1e-3 /* of R.V */

/* What a light's weights take to compute. */
typedef enum shd_path { SHD_PATH_DIRECTIONAL, SHD_PATH_POINT, SHD_PATH_ATTENUATED } shd_path;

typedef struct shd_path_error {
    double facing;    /* of N.L */
    double relative;  /* of the distance and what depends on it */
    double direction; /* of L and W, as a chord: what ns multiplies */
} shd_path_error;

/* Spots are on the path of attenuated lights. */
const shd_path_error *shd_path_error_of(shd_tier tier, shd_path path);

/* Relative, of a color: sums of up to four lights in f32 and products with the material, or f64's
 * sum as f32; then what lies between vertices, and the mean of a pixel's samples, and the sum of
 * its parts where it sees several materials, or the background as well. */
double shd_color_error(const shd_plan *plan, shd_tier tier);

/* Below this part of its top a lobe's errors count as they are, and above in proportion to it. */
static const double SHD_LOBE_FOOT = 1e-3;

/* What the errors of a lobe are made of. (R.V)^ns is off by its derivative times the error of
 * R.V = 1 - |L - W|^2 / 2, that is by ns c^(ns - 1) sqrt(2 - 2 c) times that of L and W at c = R.V,
 * which rises up to c = (ns - 1) / (ns - 1/2), and by what the square is rounded; and by what the
 * tier's functions err. */
typedef struct shd_lobe_error {
    double shininess;
    double crest, slope; /* that c, and ns c^(ns - 1) there */
    double square;       /* relative: of |L - W|^2 */
    double turned_ratio; /* that factor over (R.V)^ns where that is at least SHD_LOBE_FOOT, */
    double foot;         /* from this c on; infinite: there is none */
    double ratio;        /* of functions, relative to (R.V)^ns */
    double faint, rough; /* what is cut off as nothing; errors of functions near it */
} shd_lobe_error;

/* `lights`: how many the scene has; they share what is cut off. */
shd_lobe_error shd_lobe_error_of(shd_tier tier, double shininess, size_t lights);

/* (shine+)^shininess. */
double shd_shine_power(double shine, double shininess);

/* Where R.V is at most `shine`, whose power is `power`: what directions that are off by `direction`
 * make of the lobe, and what functions do. */
double shd_lobe_turned(const shd_lobe_error *e, double shine, double power, double direction);
/* The part of the first that is not in proportion to the lobe; and what the rest is relative to it.
 */
double shd_lobe_foot(const shd_lobe_error *e, double shine, double power, double direction);
double shd_lobe_ratio(const shd_lobe_error *e, double direction);
double shd_lobe_functions(const shd_lobe_error *e, double power);
double shd_lobe_faint(const shd_lobe_error *e, double power);

/* The first two together: each is small where the other one is largest. */
double shd_lobe_sum(double turned, double functions);

/* Of a spot's s, which fades where q = 1 - cos t is from `inner` to `outer`, and whose cos t is
 * within [low, high]. */
typedef struct shd_spot_shape {
    double inner, outer, exponent;
} shd_spot_shape;

double shd_spot_error(shd_tier tier, const shd_spot_shape *spot, double low, double high,
                      double moved);

#endif
