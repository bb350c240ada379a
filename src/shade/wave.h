/* Means of periodic waves over a footprint: exact box filters.
 *
 * A footprint is the parallelogram of the points at + a x + b y with a and b in [-1/2, 1/2]. Waves
 * are integrated in closed form, by Bernoulli's polynomials B_n of the fractional part, whose
 * derivative is n B_(n-1): 1 on [from, to) of each unit is to - from - B_1(s - from) + B_1(s - to).
 * So edges are as sharp as pixels show them, nothing shimmers, and nothing is grey before it has to
 * be. Errors are below 1e-7. Any thread. */
#pragma once

#include "scene/texture.h"

typedef struct shd_footprint {
    double at[2];
    double x[2], y[2]; /* its sides */
} shd_footprint;

/* No side of a footprint is shorter than this part of a wave, and no footprint is thinner:
 * integrals are differences divided by its sides. */
#define SHD_FOOTPRINT_LEAST 1e-4

/* Lengths of sides that differ by no more than this part are alike: tiers know them to rounding,
 * which must not decide which side is the longer one, or how many steps it takes. */
#define SHD_FOOTPRINT_ALIKE 1e-9

/* 1 on [from, to) of each unit, else 0; 0 <= from < to <= 1. */
typedef struct shd_pulse {
    double from, to;
} shd_pulse;

/* The mean of the pulse of s times the pulse of t. `f` is in units of the pulse's period. */
double shd_pulses_mean(const shd_pulse *pulse, const shd_footprint *f);

/* The mean of the pulse along one axis, 0 or 1. */
double shd_pulse_mean(const shd_pulse *pulse, const shd_footprint *f, int axis);

/* The mean of s, clamped to [0, 1], or repeated or mirrored there. */
double shd_ramp_mean(shd_wrap wrap, const shd_footprint *f);

/* The variance of that over the footprint, as exact as its mean. */
double shd_ramp_variance(shd_wrap wrap, const shd_footprint *f);

/* The same footprint, no thinner than is told above. */
shd_footprint shd_footprint_of(const shd_footprint *f);
