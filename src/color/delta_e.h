/* How far apart two colors look: from an encoded color by its primaries and curve to CIE XYZ, to
 * CIELAB, to the CIEDE2000 difference. All in f64; pure functions, any thread.
 *
 * Sources: SMPTE RP 177 (matrices from chromaticities); CIE 15:2004 (CIELAB); G. Sharma, W. Wu,
 * E. N. Dalal, "The CIEDE2000 Color-Difference Formula: Implementation Notes, Supplementary Test
 * Data, and Mathematical Observations", Color Research and Application 30(1), 2005, whose
 * equation numbers delta_e.c names. */
#pragma once

#include <stdbool.h>

#include "base/transfer.h"

/* What a picture's encoding is, made once: the way from codes to Lab. */
typedef struct shd_lab_space {
    shd_transfer transfer; /* LINEAR, SRGB or REC1886 */
    double to_xyz[3][3];   /* from linear RGB, divided by the white: white is 1, 1, 1 */
} shd_lab_space;

/* `primaries`: CIE 1931 xy of red, green, blue, white, as in shd_color_info. The white of the
 * encoding is the white of Lab: (1,1,1) is L* = 100, a* = b* = 0. False if the transfer is unknown
 * or the primaries span no colors. */
bool shd_lab_space_make(shd_transfer transfer, const double primaries[8], shd_lab_space *out);

/* The Lab of an encoded color. The color is held in [0,1] first, as a screen would; not-a-number is
 * 0. */
void shd_lab_of(const shd_lab_space *space, const float rgb[3], double lab[3]);

/* CIEDE2000 with kL = kC = kH = 1: a difference of 1 is about what a trained eye sees side by side.
 * Symmetric, finite for finite input, exactly 0 for equal colors. */
double shd_delta_e_2000(const double a[3], const double b[3]);
