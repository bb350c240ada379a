/* How far a film is from the exact one: in the working space, in codes, and to the eye. */
#ifndef SHD_RENDER_TELL_MEASURE_H
#define SHD_RENDER_TELL_MEASURE_H

#include "color/delta_e.h"
#include "image/pack.h"
#include "render/tiles/film.h"

/* How an output shows the film. */
typedef struct shd_showing {
    const shd_color_transform *transform;
    bool flatten; /* laid over black first */
    shd_pack pack;
    /* CIEDE2000 is taken in the output's own encoding where its primaries and curve are known;
     * else (YIQ, HSV, displays of other configurations) in the catalog's space of colors, and
     * `detour` leads there. */
    const shd_color_transform *detour; /* NULL: the output's own */
    shd_lab_space lab;
} shd_showing;

shd_status shd_showing_make(const shd_request *request, const shd_output *output, shd_showing *out,
                            shd_error *error);

/* Of absolute values. p99 is the smallest value that 99 % of all values do not exceed. */
typedef struct shd_spread {
    double max, mean, p99;
} shd_spread;

typedef struct shd_difference {
    double largest;     /* the exact film's largest absolute component: what errors relate to */
    shd_spread linear;  /* components of the film, in the working space */
    shd_spread code;    /* samples of the output, as it would store them with 8 bits */
    double equal;       /* share of those that are the same */
    double psnr;        /* dB, of the same; infinite where all are */
    shd_spread delta_e; /* CIEDE2000 of pixels, their alpha left out */
    double most;        /* what CIEDE2000 is at most, by the plan and the film's own colors */
} shd_difference;

/* Measures `film`, which is of request->plan, against `exact`, on the pool. The film's pixels are
 * used up: working memory comes from the request's arena, but a picture's worth of it is not
 * needed. `seconds` is what the color conversions took: of the exact film, of the other. SHD_MEMORY
 * or SHD_CANCELLED. */
shd_status shd_film_measure(shd_request *request, const shd_showing *showing, const shd_film *exact,
                            shd_film *film, shd_difference *out, double seconds[2],
                            shd_error *error);

#endif
