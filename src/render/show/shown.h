/* How outputs show the film, and what the planner has to know of that. */
#pragma once

#include "bound/bound.h"
#include "color/delta_e.h"
#include "image/pack.h"
#include "render/rendering.h"

typedef struct shd_showing {
    const shd_color_transform *transform;
    bool flatten;        /* pixels are laid over the matte first */
    const double *matte; /* [3], of the output */
    double exposure;     /* stops, of the transforms */
    bool bounded;        /* false: colors are not just a curve of a matrix of the film's */
    shd_pack pack;
    /* CIEDE2000 is taken in the output's own encoding if its primaries and curve are known. If not
     * (YIQ, HSV, displays of other configurations) it is taken in the catalog's space of colors,
     * and `detour` leads there. */
    const shd_color_transform *detour; /* NULL: the output's own */
    shd_lab_space lab;
} shd_showing;

/* Transforms are good for as long as the rendering's request. The status is of
 * shd_output_transform. */
shd_status shd_showing_make(const shd_rendering *r, const shd_scene *scene,
                            const shd_output *output, shd_showing *out, shd_error *error);

/* The same, with the transform to floats, whatever the output's depth is. */
shd_status shd_showing_floats(const shd_rendering *r, const shd_scene *scene,
                              const shd_output *output, shd_showing *out, shd_error *error);

/* Finds by trying whether what is shown is a known curve of a matrix. If not it is left unknown. */
shd_shown shd_shown_of(const shd_showing *showing);

/* Makes one for each output of the scene, in the rendering's arena. SHD_MEMORY, or the reason why a
 * transform cannot be made. */
shd_status shd_shown_make(const shd_rendering *r, const shd_scene *scene, const shd_shown **out,
                          shd_error *error);
