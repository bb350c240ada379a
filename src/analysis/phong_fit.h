/* Phong's coefficients from light that was seen: pure numbers.
 *
 * In each channel the light of a point is constant + kd D + ks S(n): D and S are sums over lights
 * without the material, and constant = ke + ka Ia, which are one number, because neither depends on
 * the place. For a given exponent n, that is linear; n is searched for, with all channels at once.
 */
#pragma once

#include "analysis/least_squares.h"
#include "base/cancel.h"
#include "base/status.h"

enum { SHD_FIT_CONSTANT, SHD_FIT_DIFFUSE, SHD_FIT_SPECULAR, SHD_FIT_SHININESS, SHD_FIT_TERMS };

enum { SHD_FIT_LOBES = 8 }; /* exponents that are asked for at once, at most */

static const double SHD_FIT_MOST = 1e6; /* exponents that are tried are 0 to this */
static const double SHD_FIT_USUAL =
    32; /* what is told without a highlight, for its terms' errors */

/* What is seen, [count][3] each. */
typedef struct shd_fit_rows {
    size_t count;
    const float *light;   /* linear */
    const float *weight;  /* 1 / standard deviation of `light`; 0: it is left out */
    const float *diffuse; /* D */
    size_t alike[3];      /* rows of a channel that share one error, and whose weights say so */
    bool relative;        /* weights are in no unit: errors are told by what is left alone */
} shd_fit_rows;

/* Fills out[lobe] ([count][3]) with S of each exponent. */
typedef shd_status shd_fit_lobes(void *context, const double *exponents, size_t lobes, float **out,
                                 shd_error *error);

/* Why a term is not known. The value is then one of many that fit as well, or nearly. */
typedef enum shd_fit_doubt {
    SHD_FIT_SURE,
    SHD_FIT_UNSEEN,      /* its light is 0 on all rows, or below a hundredth of their errors */
    SHD_FIT_LIKE_OTHERS, /* its light is a sum of that of other terms */
    SHD_FIT_TOO_FEW,     /* there are fewer rows than unknowns */
    SHD_FIT_VAGUE,       /* its standard deviation is above 0.02 and above a quarter of it */
    SHD_FIT_SHARP,       /* without a highlight: a sharp one would hardly be on any row */
    SHD_FIT_NO_LOBE,     /* of the exponent: there is no highlight that it would be of */
    SHD_FIT_FEW,         /* of the exponent: the highlight is on fewer than eight pixels */
    SHD_FIT_FLAT,        /* of the exponent: any other does as well */
    SHD_FIT_BEYOND       /* of the exponent: the largest that is tried is the best */
} shd_fit_doubt;

typedef struct shd_fit_channel {
    size_t rows;                                     /* with a weight */
    double value[SHD_COLUMNS];                       /* >= 0 */
    double deviation[SHD_COLUMNS];                   /* infinite: not known */
    double covariance[SHD_FIT_TERMS][SHD_FIT_TERMS]; /* with the exponent; 0 where not known */
    shd_fit_doubt doubt[SHD_COLUMNS];
    int like[SHD_COLUMNS]; /* of LIKE_OTHERS: the one term that it is like; -1: a sum of both */
    double rms;            /* of what is left, in the unit of light */
    double weighted;       /* the same in standard deviations: near 1 if weights were right */
} shd_fit_channel;

typedef struct shd_phong_fit {
    shd_fit_channel channels[3];
    double shininess, deviation; /* infinite: not known */
    shd_fit_doubt doubt;
} shd_phong_fit;

/* Finds the coefficients >= 0 and the exponent that leave the least, weighted: on a grid of 32
 * exponents, evenly in log(1 + n), and from its two best valleys on with eight at a time. Without a
 * highlight that stands out of what is left (by F's test, at about 4 standard deviations), there is
 * none. Standard deviations are those of the linearized problem without the bounds at 0; errors of
 * rows are as large as what is left, and Student's factor for few of them, if that is more than
 * weights say. They count as independent but for those that are `alike`, and what rows of one light
 * (one code) have in common: phong_plateaus.c. `lobes` is called 12 to 24 times.
 * SHD_CANCELLED, or what `lobes` returns. */
shd_status shd_phong_fit_find(const shd_fit_rows *rows, shd_fit_lobes *lobes, void *context,
                              float *scratch[SHD_FIT_LOBES], const atomic_bool *cancelled,
                              shd_phong_fit *out, shd_error *error);
