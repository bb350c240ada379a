/* The parts of a fit: see phong_fit.h. */
#pragma once

#include <math.h>

#include "analysis/phong_fit.h"

/* A highlight has four numbers, and counts if it takes away this many times the variance of what is
 * left: a chance of 1e-4 under independent errors. */
static const double SHD_FIT_STANDS_OUT = 24;

typedef struct shd_fitting {
    const shd_fit_rows *rows;
    shd_fit_lobes *lobes;
    void *context;
    float **scratch;
    const atomic_bool *cancelled;
    shd_products base[3]; /* without the highlight */
} shd_fitting;

/* A solution for one exponent, log(1 + n) = at. */
typedef struct shd_candidate {
    double at, rest;
    shd_products products[3];
    double x[3][SHD_COLUMNS];
} shd_candidate;

static inline double shd_fit_exponent(double at) {
    return fmin(expm1(at), SHD_FIT_MOST);
}

shd_status shd_fit_cancelled(shd_error *error);

/* How many errors a channel's rows have. */
static inline size_t shd_fit_errors(const shd_fitting *f, size_t rows, int channel) {
    const size_t alike = f->rows->alike[channel];
    return alike > 1 ? rows - alike + 1 : rows;
}

/* The variance of what is left of a row with weight 1, after so many parameters (of the exponent
 * each channel has a third), such that its root is one standard deviation however few errors it is
 * found of. INFINITY: there are too few. */
double shd_fit_variance(const shd_fitting *f, double rest, size_t errors, double parameters);

/* Sums what no highlight has part in: f->base. SHD_CANCELLED. */
shd_status shd_fit_sum_base(shd_fitting *f, shd_error *error);

/* Adds a lobe to the base's sums: out[3]. SHD_CANCELLED. */
shd_status shd_fit_add_lobe(const shd_fitting *f, const float *lobe, shd_products out[3],
                            shd_error *error);

/* Solves with the candidate's products, and returns its rest. */
double shd_fit_solve(shd_candidate *k);

/* Tells everything of the solution, whose exponent and terms are moved by what the search has left.
 * `lobe`: it has a highlight. out->doubt, and each channel's rows, are set. */
shd_status shd_fit_tell_errors(const shd_fitting *f, shd_candidate *best, bool lobe,
                               shd_phong_fit *out, shd_error *error);

/* What is asked of rows that share errors: the solution, the lobes below, at and above its exponent
 * (u = log(1 + n), `width` between both ends), and how errors go into it. */
typedef struct shd_plateau_parts {
    const shd_fit_rows *rows;
    const double (*x)[SHD_COLUMNS]; /* [3] */
    float *const *lobes;            /* [3] */
    double width;
    const double (*inverse)[SHD_COLUMNS][SHD_COLUMNS]; /* [3] */
    const double (*follow)[SHD_COLUMNS];               /* [3]: of the terms with u */
    const double *variance; /* [3]: of rows; 0: the channel is left out */
    double exponent;        /* the variance of u by independent errors */
} shd_plateau_parts;

/* What they add to covariances: of a channel's terms by its own rows, of these and u, and to u. */
typedef struct shd_plateaus {
    double own[3][SHD_COLUMNS][SHD_COLUMNS], cross[3][SHD_COLUMNS], exponent;
} shd_plateaus;

/* `room`: twice [count][3] that is written over. Once cancelled, *out is of no use. */
void shd_fit_find_plateaus(const shd_plateau_parts *p, float *const room[2],
                           const atomic_bool *cancelled, shd_plateaus *out);
