/* Lights with a shape: what a rectangle, a disc or a sphere of constant radiance adds at a point.
 *
 * A shape of intensity Il and projected area A has the radiance v = pi Il / A, and v dw from the
 * solid angle dw counts as a directional light of Il' = v dw / pi = Il dw / A. So a weight is
 *
 *     1/A  integral of w(L) dw   over the directions L of the shape before the surface
 *
 * with w(L) the weight of a directional light: (N.L)+ for the diffuse term, (R.V)+^n, where R.V =
 * L.W, for a lobe. Flat shapes shine to the side that `direction` points to. A point on the shape,
 * behind it, or inside a sphere gets nothing; so does a point whose horizon has the whole shape in
 * its plane, to within 16 eps of the coordinates.
 *
 * All of it is f64 and depends on the light and the point alone. Any thread. It cannot fail.
 *
 * Sources. Boundary integrals of all shapes: Lambert's formula; its form for circles is the
 * integral of a rational function of sine and cosine. Lobes: J. Arvo, "Applications of Irradiance
 * Tensors to the Simulation of Non-Lambertian Phenomena", SIGGRAPH 1995, axial moments (eq. 16 to
 * 19), whose sums of powers are geometric series here, so that they hold for real exponents:
 *
 *     integral of (L.W)^n dw = 1/(n+1) boundary integral of (1 - z^(n+1)) / (1 - z^2) W.(u x du)
 *
 * with z = W.u. Integer exponents have closed forms along edges; other ones and arcs take
 * Gauss-Kronrod quadrature, which knows its error. */
#pragma once

#include "base/cpu.h"
#include "shade/lighting.h"

/* How a light with a shape is summed. */
typedef enum shd_area_method {
    SHD_AREA_POINT, /* as a point: it is small and far */
    SHD_AREA_CLOSED,
    SHD_AREA_QUADRATURE
} shd_area_method;

/* How far the mean of a power of a cosine over a light of this size (half its extent, of the
 * distance) is off the power at its middle, if no horizon cuts it. */
double shd_area_off(double size, double exponent);

/* The method for Phong's model with these lobes, seen from `distance` of its middle or farther. For
 * SHD_AREA_POINT, *off is at most how far off that is, of what the light adds at most, which is
 * within `point_off`, or rounding; otherwise the quadrature's error, or 0. Where a horizon cuts a
 * light, it is never a point. */
shd_area_method shd_area_choose(const shd_light *light, const shd_plan_lobe *lobes, size_t count,
                                double distance, double point_off, double *off);

/* The weights of Phong's model: *diffuse, and lobe[k] for each lobe of at->material, without any
 * color. They are not written if the light adds nothing, which is false. *error (or NULL): an
 * estimate from above of the quadrature's error in any of them. */
bool shd_area_weigh(const shd_light *light, const shd_surface *at, double point_off,
                    double *diffuse, double *lobe, double *error);

/* Writes to row[0..count) what a directional light of Il = 1 from `toward`, which is before the
 * surface, adds. */
typedef void shd_area_function(const void *context, shd_vec3 toward, double *row);

enum { SHD_AREA_ROWS_MOST = 256, SHD_AREA_CREASES_MOST = 2 };

/* Directions that are before the surface, and up to three weights of each. What is between `points`
 * and `count`, the next multiple of SHD_WAYS_STEP, repeats the last one and weighs 0. */
enum { SHD_WAYS_STEP = 8, SHD_WAYS_MOST = 64, SHD_WAY_SUMS = 3 };
typedef struct shd_ways {
    size_t points, count;
    int sums; /* weights that are set */
    double toward[3][SHD_WAYS_MOST], weight[SHD_WAY_SUMS][SHD_WAYS_MOST];
} shd_ways;

/* Adds to out[row][k] the sum of weight[k] times what each direction adds to the row. */
typedef void shd_area_sum_function(const void *context, const shd_ways *ways,
                                   double (*out)[SHD_WAY_SUMS]);

/* A model as it is integrated. */
typedef struct shd_area_model {
    shd_area_function *weigh;
    const void *context;
    size_t count; /* of rows, at most SHD_AREA_ROWS_MOST */
    /* The exponent of a lobe (R.V)^n that is as sharp as the model is anywhere, or sharper. It
     * tells when a light is so small that it is a point. */
    double sharpness;
    /* Planes through the point, by their normals, at which the weights may have a kink. With these
     * the sum is as exact as for smooth weights. Those of Phong's lobes have W. */
    shd_vec3 creases[SHD_AREA_CREASES_MOST];
    int crease_count;
    /* What does the same as `weigh` for many directions at once; NULL: there is nothing. */
    shd_area_sum_function *sum;
    shd_isa isa; /* of kernels that find directions: they are the same by any */
} shd_area_model;

/* The weights of any model: row[k] = 1/A integral of w(L)[k] dw, by adaptive quadrature over
 * directions, to about 1e-5 of the largest if the weights are smooth beside their creases. Returns
 * an estimate from above of its error, which is larger if they are not; negative: the light adds
 * nothing, and the row is 0. */
double shd_area_integrate(const shd_light *light, const shd_surface *at, double point_off,
                          const shd_area_model *model, double *row);

/* A map of the unit square to the shape that keeps ratios of areas: of the flat shape, or of the
 * part of the sphere that faces the point `from` (all of it, seen from inside). */
shd_vec3 shd_area_point(const shd_light *light, shd_vec3 from, double u, double v);
