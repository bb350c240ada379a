#include "color/delta_e.h"

#include <math.h>

#include "base/primaries.h"
#include "base/sample.h"

static const double degree = 3.14159265358979323846 / 180;

/* ---- To Lab ---- */

bool shd_lab_space_make(shd_transfer transfer, const double primaries[8], shd_lab_space *out) {
    const double x = primaries[6], y = primaries[7], white[3] = {x, y, 1 - x - y};
    shd_lab_space space = {.transfer = transfer};
    if (transfer == SHD_TRANSFER_UNKNOWN || !shd_primaries_to_xyz(primaries, space.to_xyz))
        return false;
    for (int row = 0; row < 3; row++) {
        if (!(white[row] > 0)) return false;
        for (int i = 0; i < 3; i++) space.to_xyz[row][i] /= white[row];
    }
    *out = space;
    return true;
}

void shd_lab_of(const shd_lab_space *space, const float rgb[3], double lab[3]) {
    double linear[3], f[3];
    for (int i = 0; i < 3; i++)
        linear[i] = shd_curve_decode(space->transfer, shd_hold((double)rgb[i], 1));
    for (int row = 0; row < 3; row++)
        f[row] =
            shd_lab_curve(space->to_xyz[row][0] * linear[0] + space->to_xyz[row][1] * linear[1] +
                          space->to_xyz[row][2] * linear[2]);
    lab[0] = 116 * f[1] - 16;
    lab[1] = 500 * (f[0] - f[1]);
    lab[2] = 200 * (f[1] - f[2]);
}

/* ---- CIEDE2000 ---- */

/* sqrt(c^7 / (c^7 + 25^7)): near 0 for greys, near 1 for strong colors. */
static double strength_of(double chroma) {
    double c7 = pow(chroma, 7);
    return sqrt(c7 / (c7 + 6103515625.0));
}

/* In degrees, [0,360); 0 for greys (7). */
static double hue_of(double a, double b) {
    if (a == 0 && b == 0) return 0;
    double h = atan2(b, a) / degree;
    return h < 0 ? h + 360 : h;
}

double shd_delta_e_2000(const double a[3], const double b[3]) {
    /* Hues that are opposite to within rounding count as 180 degrees apart. The formula has a jump
     * there, and the published pairs stand on its edge. */
    const double half = 180 + 1e-9;

    /* a* is stretched for weak colors (2) to (7). */
    double stretch = 1.5 - 0.5 * strength_of((hypot(a[1], a[2]) + hypot(b[1], b[2])) / 2);
    double a1 = stretch * a[1], a2 = stretch * b[1];
    double c1 = hypot(a1, a[2]), c2 = hypot(a2, b[2]);
    double h1 = hue_of(a1, a[2]), h2 = hue_of(a2, b[2]);
    bool grey = c1 * c2 == 0;

    /* Differences (8) to (11). */
    double turn = grey ? 0 : h2 - h1;
    if (turn > half) turn -= 360;
    if (turn < -half) turn += 360;
    double dl = b[0] - a[0], dc = c2 - c1;
    double dh = 2 * sqrt(c1 * c2) * sin(turn / 2 * degree);

    /* Means (12) to (14). */
    double l = (a[0] + b[0]) / 2, c = (c1 + c2) / 2, h = h1 + h2;
    if (!grey) {
        if (fabs(h1 - h2) > half) h += h < 360 ? 360 : -360;
        h /= 2;
    }

    /* Weights (15) to (21). */
    double t = 1 - 0.17 * cos((h - 30) * degree) + 0.24 * cos(2 * h * degree) +
               0.32 * cos((3 * h + 6) * degree) - 0.20 * cos((4 * h - 63) * degree);
    double blue = (h - 275) / 25, rotation = 30 * exp(-blue * blue);
    double off = (l - 50) * (l - 50);
    double sl = 1 + 0.015 * off / sqrt(20 + off), sc = 1 + 0.045 * c, sh = 1 + 0.015 * c * t;
    double rt = -sin(2 * rotation * degree) * 2 * strength_of(c);

    /* The sum (22): rounding may take it below 0. */
    double x = dl / sl, y = dc / sc, z = dh / sh;
    return sqrt(fmax(x * x + y * y + z * z + rt * y * z, 0));
}
