/* Reflectance from microgeometry: Westin, Arvo and Torrance 1992, "Predicting reflectance functions
 * from complex surfaces".
 *
 * A small surface (grooves, a weave, a height field) of Lambertian facets is lit and seen in a
 * simulation, once, and what leaves it is tabulated by direction. As in the paper, geometry comes
 * apart from color: light that has met n facets has the color kd^n, and each n has a table,
 *
 *     pi f_r = sum_n kd^n rho_n(L, V),    rho_n = kappa_n / ((N.L) (N.V)),
 *
 * with kappa_n the mean over the surface of what facets see of both directions. The paper's
 * spherical harmonics are replaced by B-splines, which never become negative and keep energy.
 *
 * rho is symmetric in L and V, and the light that leaves under any V adds up to 1 with kd = 1, both
 * by construction (rounding aside). The table is the model: it has no error but its noise against
 * the microgeometry, and what its resolution of 5.6 degrees (11.25 around N) smoothes. Constant
 * once it is made; it is plain bytes, and the same ones on every machine; any thread. */
#pragma once

#include "base/cancel.h"
#include "plan/plan.h"
#include "shade/lighting.h"

enum {
    SHD_WESTIN_BOUNCES = 8, /* the last one stands for all that follow */
    SHD_WESTIN_RISES = 16,  /* angles from the normal: (k + 1/2) 90/16 degrees */
    SHD_WESTIN_TURNS = 32,  /* angles around it: (k + 1/2) 360/32 degrees */
    SHD_WESTIN_WAYS = SHD_WESTIN_RISES * SHD_WESTIN_TURNS,
    SHD_WESTIN_QUARTER = SHD_WESTIN_WAYS / 4 /* mirror images have the others */
};

/* The standard error of pi f_r with kd = 1, from batches that are independent. */
typedef struct shd_westin_error {
    double rms; /* weighted by both directions' cosines */
    double max;
} shd_westin_error;

typedef struct shd_westin {
    bool isotropic; /* a turn of both directions about the normal changes nothing */
    double tail;    /* each bounce after the last has this share of the one before it */
    shd_westin_error noise;
    shd_table_limits limits;
    /* rho [way of the view within a quarter][way of the light][bounce]. A way is [rise][turn]. */
    float rho[SHD_WESTIN_QUARTER][SHD_WESTIN_WAYS][SHD_WESTIN_BOUNCES];
} shd_westin;

/* Simulates, in some 0.2 s on one core. SHD_CANCELLED if `cancelled` (or NULL) is raised;
 * SHD_EXHAUSTED: out of memory (it takes SHD_WESTIN_SCRATCH bytes meanwhile). */
#define SHD_WESTIN_SCRATCH ((size_t)8 << 20)
shd_status shd_westin_make(const shd_microgeometry *micro, const atomic_bool *cancelled,
                           shd_westin *out, shd_error *error);

shd_westin_error shd_westin_noise(const shd_westin *table);

/* pi f_r of each channel, for facets of reflectance kd, |kd| <= 1. `light` and `view` are unit in
 * the frame of the surface: x along the tangent, z along the normal. 0 below the horizon. */
void shd_westin_reflect(const shd_westin *table, shd_vec3 light, shd_vec3 view, const double kd[3],
                        double out[3]);

/* The unit tangent of a surface point, perpendicular to its normal: in the object's own frame,
 * around the y axis on spheres, cylinders, cones and tori; on others the x axis, or the z axis
 * where x is along the normal. */
shd_vec3 shd_surface_tangent(const shd_object *object, shd_vec3 position, shd_vec3 normal);

/* The same for many points of an object. */
typedef struct shd_tangents {
    bool around; /* by the object's own frame */
    shd_affine to_world, from_world;
    shd_vec3 axes[3]; /* of the object, in the world */
} shd_tangents;

shd_tangents shd_tangents_of(const shd_object *object);
shd_vec3 shd_tangent_at(const shd_tangents *tangents, shd_vec3 position, shd_vec3 normal);

/* What its table is turned by: any tangent is as good as another one if it is isotropic. */
shd_tangents shd_westin_tangents(const shd_westin *table, const shd_object *object);

/* What a material adds to the light that arrives along `toward`, over kd and that light: row[c] =
 * pi f_r (N.L) / kd. */
void shd_westin_weigh(const shd_westin *table, const shd_object *object, const shd_surface *at,
                      shd_vec3 toward, double row[3]);
