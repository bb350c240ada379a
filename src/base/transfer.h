/* How samples encode light. Pure functions, any thread. */
#pragma once

#include "base/status.h"

typedef enum shd_transfer {
    SHD_TRANSFER_UNKNOWN,
    SHD_TRANSFER_LINEAR,
    SHD_TRANSFER_SRGB,    /* IEC 61966-2-1, which Display P3 uses too */
    SHD_TRANSFER_REC1886, /* gamma 2.4 */
    /* Those that follow are known to files, not to bounds. */
    SHD_TRANSFER_GAMMA22,
    SHD_TRANSFER_GAMMA26,
    SHD_TRANSFER_PQ, /* ITU-R BT.2100 table 4; 1 is 10,000 cd/m2 */
    SHD_TRANSFER_HLG /* ITU-R BT.2100 table 5, from the scene's light */
} shd_transfer;

/* The curve in f64: encoded from linear light, and back. Both directions are odd functions, 0 at 0
 * and 1 at 1. SHD_TRANSFER_UNKNOWN counts as linear. */
SHD_C double shd_curve_encode(shd_transfer transfer, double linear);
SHD_C double shd_curve_decode(shd_transfer transfer, double encoded);

/* CIELAB's curve of X, Y or Z divided by the white's (CIE 15:2004, 8.2.1.1): a cube root, and up to
 * SHD_LAB_STRAIGHT a line of the slope SHD_LAB_SLOPE. */
static const double SHD_LAB_STRAIGHT = 216.0 / 24389, SHD_LAB_SLOPE = 24389.0 / 27 / 116;
double shd_lab_curve(double t);
