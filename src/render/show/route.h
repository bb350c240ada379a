/* The one decision on where the colors of outputs go: what renders, what estimates and what tells
 * ask here. */
#ifndef SHD_RENDER_SHOW_ROUTE_H
#define SHD_RENDER_SHOW_ROUTE_H

#include "scene/scene.h"

typedef struct shd_route {
    bool codes; /* the output's samples are looked up in tables: no color is converted in floats */
    bool film;  /* the film has floats; else tiles store the samples of the only output */
} shd_route;

/* `apart`: whether a channel of what is shown depends on that channel of the film alone, as far as
 * the caller knows. */
shd_route shd_route_of(const shd_scene *scene, const shd_output *output, bool apart);

#endif
