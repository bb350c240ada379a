/* How far off is what outputs show: in linear light, in codes, and to the eye. */
#pragma once

#include "bound/bound.h"
#include "bound/light/excess.h"

/* What f32 adds to a difference of two films on the way through an output's curve, relative to the
 * channel: 1.15 times what 3e6 pairs of floats have shown. */
double shd_curve_noise(shd_transfer transfer);
/* The same through a matrix that is not diagonal, relative to the products that it adds up. */
static const double SHD_MATRIX_NOISE = 5 * 0x1p-24;

/* How a screen shows the working space. XYZ is divided by the white. */
typedef struct shd_screen {
    double rgb[3][3];      /* from the working space to the screen's linear RGB */
    double to_xyz[3][3];   /* from there to XYZ */
    double xyz[3][3];      /* both, one after the other */
    double columns[3][3];  /* XYZ of each channel of the working space */
    double channels[3][3]; /* XYZ of each of the screen's channels */
    bool same; /* the channels are the working space's, so that equal ones stay equal to the bit */
} shd_screen;

shd_screen shd_screen_of(const shd_shown *shown);

/* out = m v. */
static inline void shd_apply(const double m[3][3], const double v[3], double out[3]) {
    for (int r = 0; r < 3; r++) {
        out[r] = 0;
        for (int c = 0; c < 3; c++) out[r] += m[r][c] * v[c];
    }
}

/* A pixel that mixes colors errs by the mean of their errors, and is at least as bright as each
 * color times its share w. Curves are flattest in the light, so that the bound of one color covers
 * the other ones' shares, too, except where a curve is straight near black: there a color u at the
 * end of the straight part and black err together by 1 - w + slope(w u) / slope(u) w of each one's
 * bound. That is 1.39 at most for Lab's cube root, and 1.32 for sRGB. */
static const double SHD_MIXTURE = 1.4;

double shd_bound_linear(const shd_excess_list *list);

/* The error of a channel of value v: absolute + min(limited, ratio (v - base)+ + distance v). */
typedef struct shd_linear_error {
    double absolute, limited, ratio, distance, base;
} shd_linear_error;

/* How far off the linear components of a pixel are, by its color. Constant once made; any threads
 * may use it. */
typedef struct shd_pixel_bound {
    double most;               /* of the plan; infinite: it is not known */
    double background;         /* of pixels that show nothing else */
    double color, more;        /* relative to the channel; of every channel */
    size_t count;              /* of the excesses that a pixel may show */
    shd_linear_error (*of)[3]; /* [count], in the arena; NULL: no color tells more */
} shd_pixel_bound;

/* False: memory, or cancelled. */
bool shd_pixel_bound_make(const shd_plan *plan, shd_arena *arena, shd_pixel_bound *out);

/* Of a pixel that shows this color of the working space, in any of the three components. */
double shd_pixel_bound_at(const shd_pixel_bound *bound, const double rgb[3]);

double shd_bound_code(const shd_excess_list *list, const shd_shown *shown);
/* A bound up to `enough` may be told as `enough`, and a larger one as any value above it. */
double shd_bound_delta_e(const shd_excess_list *list, const shd_shown *shown, double enough);
