/* What an output displays, in floats, before anything is packed: for analysis and scopes. */
#pragma once

#include "render/show/shown.h"
#include "render/tiles/film.h"

typedef enum shd_axes { SHD_AXES_OWN, SHD_AXES_HSV, SHD_AXES_YIQ, SHD_AXES_LAB } shd_axes;

typedef struct shd_displayed {
    shd_showing showing; /* to floats */
    const shd_color_info *info;
    const shd_film *film;
    size_t pixels;
    float *rgba;          /* [pixels][4]: converted, not held in any range; alpha is the film's */
    bool integers;        /* the output's samples are codes; if not none is clipped */
    bool color;           /* its values are R, G and B that mean a color */
    uint64_t clipped;     /* samples that are stored whose code is beyond the codes there are */
    uint64_t beyond;      /* pixels with a value below 0 or above 1; of those seen, as below */
    uint64_t not_finite;  /* pixels with a value that is not */
    uint64_t transparent; /* pixels whose alpha is 0, which are not seen */
} shd_displayed;

/* Converts a copy of the film, which has floats, on the pool, as the output does it. Both stay as
 * long as *out is used, and its memory is of r->arena. Adds nothing to the rendering's counts.
 * SHD_MEMORY, SHD_CANCELLED, or the reason why there is no transform. */
shd_status shd_displayed_make(shd_rendering *r, const shd_scene *scene, const shd_output *output,
                              const shd_film *film, shd_displayed *out, shd_error *error);

/* The colors that Lab is of, [count][4]: of pixels from `first` on, at most 1024. */
void shd_displayed_colors(const shd_displayed *displayed, size_t first, size_t count, float *out);

/* The pixels on three axes, planes[3][pixels]; a pixel that is not seen or not finite is NaN on all
 * of them. HSV and YIQ are of outputs with color, and Lab of those whose values are no data: it is
 * of what is held in [0,1], with the white of the encoding. False: it was cancelled. */
bool shd_displayed_axes(shd_rendering *r, const shd_displayed *displayed, shd_axes axes,
                        float *planes);
