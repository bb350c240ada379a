/* What a scene's outputs have in common, without any of them. */
#pragma once

#include "render/rendering.h"
#include "render/tiles/film.h"

/* Plans and renders the scene without the layers of its outputs. Nothing is encoded; the film is of
 * r->arena, and so is r->plan. */
shd_status shd_bare_render(shd_rendering *r, const shd_scene *scene,
                           const shd_render_options *options, shd_film *film, shd_error *error);
