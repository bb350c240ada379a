/* How outputs show the film, and what the planner has to know of that. */
#pragma once

#include "bound/bound.h"
#include "color/delta_e.h"
#include "image/pack.h"
#include "render/rendering.h"

typedef struct shd_showing {
    const shd_color_transform *transform;
    bool flatten; /* pixels are laid over black first */
    shd_pack pack;
    /* CIEDE2000 is taken in the output's own encoding if its primaries and curve are known. If not
     * (YIQ, HSV, displays of other configurations) it is taken in the catalog's space of colors,
     * and `detour` leads there. */
    const shd_color_transform *detour; /* NULL: the output's own */
    shd_lab_space lab;
} shd_showing;

/* Transforms belong to `color`. The status is of shd_output_transform. */
shd_status shd_showing_make(shd_color_config *color, const shd_scene *scene,
                            const shd_output *output, shd_showing *out, shd_error *error);

/* Finds by trying whether what is shown is a known curve of a matrix. If not it is left unknown. */
shd_shown shd_shown_of(const shd_showing *showing);

/* Makes one for each output of the scene, in the rendering's arena. SHD_MEMORY, or the reason why a
 * transform cannot be made. */
shd_status shd_shown_make(const shd_rendering *r, const shd_scene *scene, const shd_shown **out,
                          shd_error *error);
