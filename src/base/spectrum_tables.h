/* Spectra that the CIE has published, and those that RGB is lifted by, as samples with equal steps.
 * Made by tests/spectra/tables.py. */
#pragma once

/* What the tables are sampled at: from, and in steps of, so many nm. */
enum {
    SHD_TABLE_STEP = 5,
    SHD_WIDE_FROM = 360,
    SHD_WIDE_COUNT = 95, /* to 830 */
    SHD_LAMP_FROM = 380,
    SHD_LAMP_COUNT = 81, /* to 780 */
    SHD_LAMPS = 12,
    SHD_SAMPLES = 14,
    SHD_PRIMARY_FROM = 380,
    SHD_PRIMARY_STEP = 10,
    SHD_PRIMARY_COUNT = 36,
    SHD_PRIMARY_TO = 730
};

extern const double shd_observer[3][SHD_WIDE_COUNT]; /* CIE 1931, 2 degrees: x, y, z */
extern const double shd_illuminant_d65[SHD_WIDE_COUNT], shd_illuminant_d50[SHD_WIDE_COUNT],
    shd_illuminant_d55[SHD_WIDE_COUNT], shd_illuminant_d75[SHD_WIDE_COUNT];
extern const double shd_illuminants_f[SHD_LAMPS][SHD_LAMP_COUNT];  /* F1 to F12 */
extern const double shd_test_samples[SHD_SAMPLES][SHD_LAMP_COUNT]; /* TCS01 to TCS14 */

/* Reflectances of red, green and blue; their sum is 1 (tests/spectra/primaries.py). */
extern const double shd_primary_curves[3][SHD_PRIMARY_COUNT];
