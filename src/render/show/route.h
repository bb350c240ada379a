/* The one decision about the way of colors from the film to an output. Rendering, estimates and
 * explanations all ask here. */
#ifndef SHD_RENDER_SHOW_ROUTE_H
#define SHD_RENDER_SHOW_ROUTE_H

#include "scene/scene.h"

typedef struct shd_route {
    bool codes; /* the output's samples are looked up in tables, not converted in floats */
    bool film;  /* the film has floats; if not, tiles store the samples of the only output */
} shd_route;

/* `apart`: whether, as far as the caller knows, each channel of the output depends on the same
 * channel of the film alone. */
shd_route shd_route_of(const shd_scene *scene, const shd_output *output, bool apart);

#endif
