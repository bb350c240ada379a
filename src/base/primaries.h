/* The primaries of color spaces as double[8]: CIE 1931 x and y of red, green, blue and white.
 * Constants and pure functions, any thread. */
#pragma once

#include <stdbool.h>

extern const double shd_rec709[8];     /* ITU-R BT.709-6, and IEC 61966-2-1 */
extern const double shd_display_p3[8]; /* SMPTE EG 432-1 with white D65 */
extern const double shd_acescg[8];     /* Academy S-2014-004 (AP1) */
extern const double shd_aces2065_1[8]; /* SMPTE ST 2065-1 (AP0) */

/* XYZ of red, green and blue at full drive, out[X, Y, Z][r, g, b]. Their sum is the white, scaled
 * so that X + Y + Z = 1 (SMPTE RP 177). False, with *out untouched: they span no volume. */
bool shd_primaries_to_xyz(const double xy[8], double out[3][3]);
