/* What a material does with light from one direction: f_r, and figures made of it.
 *
 * f_r(L, V) is the share of the irradiance by light from L that goes to V, a solid angle, in 1/sr.
 * A light of Il adds pi f_r (N.L) Il to what V sees. Nothing here depends on a picture. */
#pragma once

#include "plan/plan.h"

/* The angles of light from the normal whose albedo is told, in degrees. */
enum { SHD_ALBEDO_ANGLES = 19 };
extern const double shd_albedo_angles[SHD_ALBEDO_ANGLES];

typedef struct shd_reflectance {
    const shd_plan *plan;
    const shd_plan_material *material;
    size_t object; /* the first that has the material: its frame is the surface's */
    /* The share of light from each angle that is sent on, and the most that these are off. */
    double albedo[SHD_ALBEDO_ANGLES][3];
    double quadrature;
    /* The largest share of a channel, and its angle: of those, 89.9 and 89.99 degrees. */
    double most, most_angle;
    /* The smallest angle from which a channel sends on more than arrives; NAN: none; 90: one that
     * f64 does not tell from 90. It may be beyond all that `most` is of. */
    double gains;
    /* The largest |f_r(L, V) - f_r(V, L)| over the larger one, on a grid, and where. */
    double residual, residual_light, residual_view, residual_turn;
    /* Whether f_r grows without limit where light and view are near the surface. */
    bool unbounded;
} shd_reflectance;

/* f_r of each channel for unit vectors in the surface's frame, whose normal is z. */
void shd_reflectance_at(const shd_reflectance *r, shd_vec3 light, shd_vec3 view, double f[3]);

static inline shd_vec3 shd_polar(double polar, double azimuth) {
    return (shd_vec3){sin(polar) * cos(azimuth), sin(polar) * sin(azimuth), cos(polar)};
}
