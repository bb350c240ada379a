#include "base/primaries.h"

#include <math.h>

const double shd_rec709[8] = {0.640, 0.330, 0.300, 0.600, 0.150, 0.060, 0.3127, 0.3290};
const double shd_display_p3[8] = {0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.3127, 0.3290};
const double shd_rec2020[8] = {0.708, 0.292, 0.170, 0.797, 0.131, 0.046, 0.3127, 0.3290};
const double shd_p3_dci[8] = {0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351};
const double shd_p3_d60[8] = {0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.32168, 0.33767};
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

static bool adapt_white(shd_vec3 white, shd_vec3 other, shd_affine *out) {
    static const shd_affine bradford = {.linear = {{0.8951, 0.2664, -0.1614},
                                                   {-0.7502, 1.7135, 0.0367},
                                                   {0.0389, -0.0685, 1.0296}}};
    const shd_vec3 from = shd_linear(&bradford, white), to = shd_linear(&bradford, other);
    shd_affine back;
    if (!(from.x > 1e-6 && from.y > 1e-6 && from.z > 1e-6) || !shd_invert(&bradford, &back))
        return false;
    shd_affine scale = {.linear = {{to.x / from.x}, {0, to.y / from.y}, {0, 0, to.z / from.z}}};
    scale = shd_compose(&scale, &bradford);
    *out = shd_compose(&back, &scale);
    return true;
}

bool shd_primaries_adapt(const double xy[8], shd_vec3 white, shd_affine *adapt, shd_affine *out) {
    const double y = xy[7];
    shd_affine rgb = {.origin = {0, 0, 0}};
    if (!(y > 1e-6) || !shd_primaries_to_xyz(xy, rgb.linear)) return false;
    for (int i = 0; i < 9; i++) rgb.linear[i / 3][i % 3] /= y;
    if (!adapt_white((shd_vec3){xy[6] / y, 1, (1 - xy[6] - y) / y}, white, adapt)) return false;
    *out = shd_compose(adapt, &rgb);
    return true;
}

void shd_matrix_invert(const double m[3][3], double out[3][3]) {
    double all = 0;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            const int a = (j + 1) % 3, b = (j + 2) % 3, c = (i + 1) % 3, d = (i + 2) % 3;
            out[i][j] = m[a][c] * m[b][d] - m[a][d] * m[b][c];
        }
    for (int i = 0; i < 3; i++) all += m[0][i] * out[i][0];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) out[i][j] /= all;
}
