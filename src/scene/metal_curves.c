/* The indices of metals over wavelengths in nm, from below 360 to 830, as refractiveindex.info has
 * them (CC0; M. N. Polyanskiy, Scientific Data 11, 94, 2024). */
#include "scene/metals.h"

/* P. B. Johnson and R. W. Christy, Phys. Rev. B 6, 4370 (1972). */
static const double noble_at[] = {354.2, 367.9, 381.5, 397.4, 413.3, 430.5, 450.9, 471.4, 495.9,
                                  520.9, 548.6, 582.1, 616.8, 659.5, 704.5, 756,   821.1, 892};
static const double gold_n[] = {1.5,  1.48, 1.46, 1.47, 1.46, 1.45, 1.38, 1.31, 1.04,
                                0.62, 0.43, 0.29, 0.21, 0.14, 0.13, 0.14, 0.16, 0.17};
static const double gold_k[] = {1.866, 1.895, 1.933, 1.952, 1.958, 1.948, 1.914, 1.849, 1.833,
                                2.081, 2.455, 2.863, 3.272, 3.697, 4.103, 4.542, 5.083, 5.663};
static const double silver_n[] = {0.1,  0.07, 0.05, 0.05, 0.05, 0.04, 0.04, 0.05, 0.05,
                                  0.05, 0.06, 0.05, 0.06, 0.05, 0.04, 0.03, 0.04, 0.04};
static const double silver_k[] = {1.419, 1.657, 1.864, 2.07,  2.275, 2.462, 2.657, 2.869, 3.093,
                                  3.324, 3.586, 3.858, 4.152, 4.483, 4.838, 5.242, 5.727, 6.312};
static const double copper_n[] = {1.37, 1.36, 1.33, 1.32, 1.28, 1.25, 1.24, 1.25, 1.22,
                                  1.18, 1.02, 0.7,  0.3,  0.22, 0.21, 0.24, 0.26, 0.3};
static const double copper_k[] = {1.916, 1.975, 2.045, 2.116, 2.207, 2.305, 2.397, 2.483, 2.564,
                                  2.608, 2.577, 2.704, 3.205, 3.747, 4.205, 4.665, 5.18,  5.768};

/* The same, Phys. Rev. B 9, 5056 (1974). */
static const double chromium_at[] = {354, 368, 381, 397, 413, 431, 451, 471, 496,
                                     521, 549, 582, 617, 659, 704, 756, 821, 892};
static const double chromium_n[] = {1.84, 1.87, 1.92, 2,    2.08, 2.19, 2.33, 2.51, 2.75,
                                    2.94, 3.18, 3.22, 3.17, 3.09, 3.05, 3.08, 3.2,  3.3};
static const double chromium_k[] = {2.64, 2.69, 2.74, 2.83, 2.93, 3.04, 3.14, 3.24, 3.3,
                                    3.33, 3.33, 3.3,  3.3,  3.34, 3.39, 3.42, 3.48, 3.52};

/* A. D. Rakic, Appl. Opt. 34, 4755 (1995). */
static const double aluminium_at[] = {326.28, 364.66, 413.28, 442.8,  476.87,
                                      516.6,  563.57, 619.93, 652.25, 688.81,
                                      729.32, 774.91, 794.78, 815.69, 837.74};
static const double aluminium_n[] = {0.31474, 0.39877, 0.52135, 0.6079, 0.7278,
                                     0.8734,  1.0728,  1.366,   1.5724, 1.8301,
                                     2.1606,  2.6154,  2.7675,  2.7668, 2.6945};
static const double aluminium_k[] = {3.9165, 4.3957, 5.0008, 5.3676, 5.7781, 6.2418, 6.7839, 7.4052,
                                     7.7354, 8.0601, 8.3565, 8.4914, 8.3866, 8.2573, 8.1878};

/* 70 % copper and 30 % zinc, from 360 nm in steps of 10 (M. R. Querry, Contractor Report
 * CRDC-CR-85034, 1985). */
static const double brass_n[] = {
    1.503, 1.497, 1.487, 1.471, 1.445, 1.405, 1.35,  1.278, 1.191, 1.094, 0.994, 0.9,
    0.816, 0.745, 0.686, 0.639, 0.602, 0.573, 0.549, 0.527, 0.505, 0.484, 0.468, 0.46,
    0.45,  0.452, 0.449, 0.445, 0.444, 0.444, 0.445, 0.444, 0.444, 0.445, 0.446, 0.448,
    0.45,  0.452, 0.455, 0.457, 0.458, 0.46,  0.464, 0.469, 0.473, 0.478, 0.481, 0.483};
static const double brass_k[] = {
    1.815, 1.818, 1.818, 1.813, 1.805, 1.794, 1.786, 1.784, 1.797, 1.829, 1.883, 1.957,
    2.046, 2.145, 2.25,  2.358, 2.464, 2.568, 2.668, 2.765, 2.86,  2.958, 3.059, 3.159,
    3.253, 3.345, 3.434, 3.522, 3.609, 3.695, 3.778, 3.86,  3.943, 4.025, 4.106, 4.186,
    4.266, 4.346, 4.424, 4.501, 4.579, 4.657, 4.737, 4.814, 4.89,  4.965, 5.039, 5.115};

#define COUNT(array) (sizeof(array) / sizeof(array)[0])
#define CURVE(metal, at_, part)                                                                    \
    { .count = COUNT(metal##_##part), .at = at_, .values = metal##_##part, .scale = 1 }
#define METAL(metal, at)                                                                           \
    { CURVE(metal, at, n), CURVE(metal, at, k) }
#define STEPS(part)                                                                                \
    { .count = COUNT(brass_##part), .first = 360, .step = 10, .values = brass_##part, .scale = 1 }

const shd_curve shd_metal_curves[SHD_METALS][2] = {
    METAL(aluminium, aluminium_at), {STEPS(n), STEPS(k)},  METAL(chromium, chromium_at),
    METAL(copper, noble_at),        METAL(gold, noble_at), METAL(silver, noble_at),
};
