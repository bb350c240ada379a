#include "base/transfer.h"

#include <math.h>

static const double PQ_M1 = 2610.0 / 16384, PQ_M2 = 2523.0 / 32, PQ_C1 = 3424.0 / 4096,
                    PQ_C2 = 2413.0 / 128, PQ_C3 = 2392.0 / 128;
static const double HLG_A = 0.17883277, HLG_B = 1 - 4 * 0.17883277, HLG_C = 0.55991073;

/* Of gamma curves; 0: it is none. */
static double power_of(shd_transfer transfer) {
    return transfer == SHD_TRANSFER_REC1886   ? 2.4
           : transfer == SHD_TRANSFER_GAMMA22 ? 2.2
           : transfer == SHD_TRANSFER_GAMMA26 ? 2.6
                                              : 0;
}

double shd_curve_encode(shd_transfer transfer, double linear) {
    const double v = fabs(linear), power = power_of(transfer);
    double out = v;
    if (transfer == SHD_TRANSFER_SRGB) /* IEC 61966-2-1 */
        out = v <= 0.0031308 ? 12.92 * v : 1.055 * pow(v, 1 / 2.4) - 0.055;
    if (power > 0) out = pow(v, 1 / power);
    if (transfer == SHD_TRANSFER_PQ) {
        const double m = pow(v, PQ_M1);
        out = pow((PQ_C1 + PQ_C2 * m) / (1 + PQ_C3 * m), PQ_M2);
    }
    if (transfer == SHD_TRANSFER_HLG)
        out = v <= 1.0 / 12 ? sqrt(3 * v) : HLG_A * log(12 * v - HLG_B) + HLG_C;
    return copysign(out, linear);
}

double shd_curve_decode(shd_transfer transfer, double encoded) {
    const double v = fabs(encoded), power = power_of(transfer);
    double out = v;
    if (transfer == SHD_TRANSFER_SRGB)
        out = v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
    if (power > 0) out = pow(v, power);
    if (transfer == SHD_TRANSFER_PQ) {
        const double m = pow(v, 1 / PQ_M2);
        out = pow(fmax(m - PQ_C1, 0) / (PQ_C2 - PQ_C3 * m), 1 / PQ_M1);
    }
    if (transfer == SHD_TRANSFER_HLG)
        out = v <= 0.5 ? v * v / 3 : (exp((v - HLG_C) / HLG_A) + HLG_B) / 12;
    return copysign(out, encoded);
}

double shd_lab_curve(double t) {
    return t > SHD_LAB_STRAIGHT ? cbrt(t) : (24389.0 / 27 * t + 16) / 116;
}
