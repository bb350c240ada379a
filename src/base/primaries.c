#include "base/primaries.h"

#include <math.h>

const double shd_rec709[8] = {0.640, 0.330, 0.300, 0.600, 0.150, 0.060, 0.3127, 0.3290};
const double shd_display_p3[8] = {0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290};
const double shd_acescg[8] = {0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767};
const double shd_aces2065_1[8] = {0.7347, 0.2653,  0.0000,  1.0000,
                                  0.0001, -0.0770, 0.32168, 0.33767};

/* XYZ of a chromaticity with X + Y + Z = 1. */
static void xyz_of(const double xy[2], double xyz[3]) {
    xyz[0] = xy[0];
    xyz[1] = xy[1];
    xyz[2] = 1 - xy[0] - xy[1];
}

static double determinant_of(const double a[3], const double b[3], const double c[3]) {
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) +
           a[2] * (b[0] * c[1] - b[1] * c[0]);
}

bool shd_primaries_to_xyz(const double xy[8], double out[3][3]) {
    double p[3][3], white[3];
    for (int i = 0; i < 3; i++) xyz_of(xy + 2 * i, p[i]);
    xyz_of(xy + 6, white);
    const double whole = determinant_of(p[0], p[1], p[2]);
    if (!(fabs(whole) > 1e-9)) return false;
    /* How much of each primary makes the white: Cramer's rule. */
    const double amount[3] = {determinant_of(white, p[1], p[2]) / whole,
                              determinant_of(p[0], white, p[2]) / whole,
                              determinant_of(p[0], p[1], white) / whole};
    for (int row = 0; row < 3; row++)
        for (int i = 0; i < 3; i++) out[row][i] = amount[i] * p[i][row];
    return true;
}
