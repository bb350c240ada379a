/* What the tiers' kernels (shade/, sight/) cut off, hold and round, and the bounds of their errors
 * (bound/) know. tests/unit/shade_tiers.c holds both against each other. */
#pragma once

#include <math.h>
#include <stdbool.h>
#include <stddef.h>

/* The standard tier adds up lights in f32 in groups of so many, and the groups in f64. */
enum { SHD_LIGHT_GROUP = 4 };

/* Attenuation is held at this if a light is so close that 1/d^2 is beyond f64. It is finite and far
 * beyond any output's range. */
static const double SHD_LARGEST_FALL = 1e300;

/* If 1 - cos t is within this times sqrt(1 - cos angle) of a rim without penumbra, f64 decides on
 * which side a point is. In f32, 1 - cos t is off by sqrt(2 (1 - cos t)) times what directions are
 * off by, and by its own rounding. */
static const double SHD_RIM = 4e-6;

/* In f32, N.(light - p) is off by less than this, of the light's distance and of the frame's unit.
 * If positions are split, whose second halves are rounded to 2^-49, sqrt(SHD_SPLIT) of that unit
 * counts. If it is nearer to 0 than that under a highlight, the point is lit again in f64, because
 * highlights end there as off a cliff. */
static const double SHD_TURNED = 0x1p-22, SHD_SPLIT = 0x1p-52;

/* The same of sketches (shade/sketch.h), which leave such points to the standard tier. */
static const double SHD_SKETCH_TURNED = 0x1p-17;

/* A sketch is of so many pixels each way, and has no more lights and lobes than these. */
enum { SHD_SKETCH_SIDE = 8, SHD_SKETCH_LIGHTS = 16, SHD_SKETCH_LOBES = 2 };

/* Highlights of a shininess below 1 end at another cliff, where R.V is 0. Points at which R.V is
 * nearer to 0 than this are lit again, too. */
static const double SHD_CLIFF = 1e-3;

/* A lobe is cut where it has fallen to exp(-cut), so that what is cut of all of the scene's lights
 * together is nothing beside the standard tier's error. In f64 it is cut at exp(-SHD_EXACT_CUT),
 * which is less than its functions err by. */
static const double SHD_LEAST_CUT = 17, SHD_EXACT_CUT = 60;

static inline double shd_lobe_cut(size_t lights) {
    return SHD_LEAST_CUT + log((double)(lights > 1 ? lights : 1));
}

/* Lobes that are nothing beyond 60 degrees (1 - R.V is 1/2) have polynomials of their own in f32.
 */
static inline bool shd_is_short_lobe(double shininess, double cut) {
    return cut / shininess < 0.5;
}

/* Whether a power of a cosine has an edge at 90 degrees that is too steep for f32: f64 does it. */
static inline bool shd_is_sheer(double exponent) {
    return exponent < 1;
}

/* The least power of 2 that the standard tier's functions give, for smaller ones, too. */
enum { SHD_LEAST_LOG2 = -125 };

/* Models beside Phong's magnify what f32 rounds where light and view are both along the surface.
 * Points are lit again in f64 at which neither N.L nor N.V of Oren-Nayar's model is as large as
 * SHD_ALONG, or |L + V|^2 of half vectors as SHD_OPPOSITE. */
static const double SHD_ALONG = 0x1p-4, SHD_OPPOSITE = 0x1p-6;

/* So they are where N.L is below this under a normalized lobe, whose factor is steep there. */
static inline double shd_normalized_low(double shininess) {
    return shininess < 8 ? 0 : 0.5 / sqrt(shininess / 2 + 0.5);
}

/* Steeper lobes are done in f64. */
static const double SHD_STEEPEST_BLINN = 1e4, SHD_STEEPEST_NORMALIZED = 32;

/* What rounding to f64 does to a hit, relative to the lengths on the way to it (sight/tie.h). */
static const double SHD_HIT_ROUNDING = 16 * 0x1p-53;

/* What quadrature of Phong's lobes under a light with a shape may be off, of the most that the
 * light adds (shade/area.h). */
static const double SHD_AREA_TOLERANCE = 1e-6;

/* What quadrature of an environment may be off, of the most that it adds (shade/environment.h).
 * Tests see less than a fifth of it. */
static const double SHD_ENVIRONMENT_TOLERANCE = 2e-4;

/* The same of lobes that are not symmetric, for which a map is walked (shade/around.h). */
static const double SHD_AROUND_TOLERANCE = 1e-4;

/* The same of those tiers that need not walk as far (shade/around_quick.h): of the sum itself, and
 * of the most that the map adds. */
static const double SHD_QUICK_SHARE = 4e-3, SHD_QUICK_FLOOR = 1e-6;

/* What quadrature of other models over directions may be off, of the most that a light adds. */
static const double SHD_AREA_MODEL_TOLERANCE = 3e-5;
