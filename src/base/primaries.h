/* The primaries of color spaces as double[8]: CIE 1931 x and y of red, green, blue and white.
 * Constants and pure functions, any thread. */
#pragma once

#include "base/status.h"
#include "base/vec3.h"

extern const double shd_rec709[8];     /* ITU-R BT.709-6, and IEC 61966-2-1 */
extern const double shd_display_p3[8]; /* SMPTE EG 432-1 with white D65 */
extern const double shd_rec2020[8];    /* ITU-R BT.2020-2 and BT.2100 */
extern const double shd_p3_dci[8];     /* SMPTE RP 431-2 */
extern const double shd_p3_d60[8];     /* the same with the white of ACES */
extern const double shd_acescg[8];     /* Academy S-2014-004 (AP1) */
extern const double shd_aces2065_1[8]; /* SMPTE ST 2065-1 (AP0) */

/* XYZ of red, green and blue at full drive, out[X, Y, Z][r, g, b]. Their sum is the white, scaled
 * so that X + Y + Z = 1 (SMPTE RP 177). False, with *out untouched: they span no volume. */
SHD_C bool shd_primaries_to_xyz(const double xy[8], double out[3][3]);

/* The columns of `out` are XYZ of red, green and blue at full drive, whose sum is `white` (Y = 1):
 * by Bradford adaptation, which is `adapt`, from the primaries' own white (ICC.1:2010, annex E).
 * False, and nothing is written that may be read, if the primaries span no volume. */
SHD_C bool shd_primaries_adapt(const double xy[8], shd_vec3 white, shd_affine *adapt,
                               shd_affine *out);

/* The inverse of a matrix of rows whose columns span a volume. */
SHD_C void shd_matrix_invert(const double m[3][3], double out[3][3]);
