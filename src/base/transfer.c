#include "base/transfer.h"

#include <math.h>

double shd_curve_encode(shd_transfer transfer, double linear) {
    const double v = fabs(linear);
    double out = v;
    if (transfer == SHD_TRANSFER_SRGB) /* IEC 61966-2-1 */
        out = v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
    if (transfer == SHD_TRANSFER_REC1886) out = pow(v, 1 / 2.4);
    return copysign(out, linear);
}

double shd_curve_decode(shd_transfer transfer, double encoded) {
    const double v = fabs(encoded);
    double out = v;
    if (transfer == SHD_TRANSFER_SRGB)
        out = v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
    if (transfer == SHD_TRANSFER_REC1886) out = pow(v, 2.4);
    return copysign(out, encoded);
}

double shd_lab_curve(double t) {
    return t > SHD_LAB_STRAIGHT ? cbrt(t) : (24389.0 / 27 * t + 16) / 116;
}
