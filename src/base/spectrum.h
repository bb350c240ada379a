/* Spectra: curves over wavelengths, what the CIE 1931 observer (2 degrees) sees of them, and linear
 * Rec.709 lifted to spectra (Mallett and Yuksel, "Spectral Primary Decomposition for Rendering with
 * sRGB Reflectance", EGSR 2019; the curves of the primaries are made by
 * tests/spectra/primaries.py).
 *
 * Wavelengths are in nm. Integrals of curves that are linear between samples are exact: between all
 * neighboring samples of their factors by Simpson's rule, which is for cubics. Constants and pure
 * functions, any thread. */
#pragma once

#include "base/arena.h"
#include "base/vec3.h"

/* Linear between its samples, and constant beyond the first and the last (CIE 15:2004 lets
 * what was not measured equal the nearest measured value). So a single sample is a constant. */
typedef struct shd_curve {
    const char *name;     /* NULL: the document's own samples */
    size_t count;         /* 0: CIE standard illuminant A, which is a formula */
    double first, step;   /* of samples at equal steps */
    const double *at;     /* [count]: ascending; NULL: equal steps */
    const double *values; /* [count] */
    double scale;         /* of the reflectance, or of the light once it is scaled to Y = 1 */
} shd_curve;

typedef enum shd_curve_kind { SHD_CURVE_LIGHT, SHD_CURVE_REFLECTANCE } shd_curve_kind;

/* The curves that have names: illuminants, then reflectances. */
size_t shd_curve_names(void);
shd_curve shd_curve_named(size_t index, shd_curve_kind *kind);

/* The value at a wavelength, without `scale`. */
double shd_curve_value(const shd_curve *curve, double nm);

/* What turns XYZ to linear Rec.709 outside of spectral scenes; `white` is Y of D65. Made once for
 * many colors. */
typedef struct shd_eye {
    shd_affine to_rgb;
    double white;
} shd_eye;

bool shd_eye_make(shd_eye *out);

/* The color of a reflectance under D65, or of a light that is scaled to Y = 1, times `scale`, in
 * linear Rec.709, from 380 to 730 nm; what spectral channels come to as their number grows. False:
 * the eye sees nothing of the light, which cannot be scaled. */
bool shd_curve_rgb(const shd_eye *eye, const shd_curve *curve, shd_curve_kind kind, double rgb[3]);

/* The means of a curve, times `scale`, over what linear Rec.709's red, green and blue stand for:
 * weighted by the curves of the primaries times D65. For what is no color, as an index of
 * refraction: means are within the curve's own values. */
void shd_curve_means(const shd_curve *curve, double out[3]);

enum { SHD_BINS_LEAST = 16, SHD_BINS_MOST = 256 };

/* Equal bins of wavelengths, the channels of spectral scenes. A reflectance is its mean in each
 * bin. A light is the color, in the working space, of each bin of it on white. Colors are those by
 * which each RGB reflectance makes the round trip under D65:
 *
 *     rgb = to_rgb sum_b w_b k_b,   to_rgb = (sum_b w_b p_b')^-1
 *
 * w_b being the integral of D65 times the observer over bin b, and p_b the means of the primaries'
 * curves. */
typedef struct shd_bins {
    size_t count;
    double from, to;
    shd_affine to_rgb;       /* XYZ to the working space */
    shd_affine from_working; /* the working space to linear Rec.709; linear */
    double (*primaries)[3];  /* [count]: means of red's, green's and blue's curve */
    double (*white)[3];      /* [count]: D65 as a light; the sum is white */
} shd_bins;

/* Makes bins in the arena. `to_working` is linear, and turns linear Rec.709 to the working space.
 * 360 <= from <= 380 and 730 <= to <= 830. False: memory, or there is no inverse. */
bool shd_bins_make(size_t count, double from, double to, const shd_affine *to_working,
                   shd_arena *arena, shd_bins *out);

/* A reflectance: a curve's, scaled, or one that is lifted from the working space. */
void shd_bins_reflect(const shd_bins *bins, const shd_curve *curve, double *out);
void shd_bins_lift(const shd_bins *bins, const double rgb[3], double *out);

/* Adds a light, [count][3]: a curve's, scaled to Y = 1 times `scale`, or one that is lifted and
 * multiplied by D65. False: as shd_curve_rgb. */
bool shd_bins_add_light(const shd_bins *bins, const shd_curve *curve, double (*out)[3]);
void shd_bins_add_lifted(const shd_bins *bins, const double rgb[3], double (*out)[3]);

/* The color of a surface in a light; `reflectance` NULL: of white. */
static inline void shd_bins_mix(size_t count, const double *reflectance, const double (*light)[3],
                                double rgb[3]) {
    double sum[3] = {0};
    for (size_t b = 0; b < count; b++)
        for (int c = 0; c < 3; c++) sum[c] += (reflectance ? reflectance[b] : 1) * light[b][c];
    for (int c = 0; c < 3; c++) rgb[c] = sum[c];
}
