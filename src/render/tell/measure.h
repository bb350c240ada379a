/* How far a film is from the exact one: in the working space, in codes, and to the eye. */
#pragma once

#include "render/show/shown.h"
#include "render/tiles/film.h"

/* A spread of absolute values. p99 is the smallest value that 99 % of all values do not exceed. */
typedef struct shd_spread {
    double max, mean, p99;
} shd_spread;

typedef struct shd_difference {
    double largest;     /* the exact film's largest absolute component: what errors relate to */
    shd_spread linear;  /* components of the film, in the working space */
    shd_spread code;    /* samples of the output, as it would store them in 8 bits */
    double equal;       /* share of those that are the same */
    double psnr;        /* dB, of the same; infinite if all are */
    shd_spread delta_e; /* CIEDE2000 of pixels, their alpha left out */
    double most;        /* what CIEDE2000 is at most, by the plan and the film's own colors */
} shd_difference;

/* Measures `film`, which is of r->plan, against `exact`, on the pool. It uses the film's pixels up,
 * so that it takes little of r->arena. Adds the time of the film's color conversions to
 * r->times.color; `exact_seconds` gets that of the exact film's. SHD_MEMORY or SHD_CANCELLED. */
shd_status shd_film_measure(shd_rendering *r, const shd_showing *showing, const shd_film *exact,
                            shd_film *film, shd_difference *out, double *exact_seconds,
                            shd_error *error);
