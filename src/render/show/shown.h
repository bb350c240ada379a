/* What the planner has to know of an output's colors, found by trying. */
#ifndef SHD_RENDER_SHOW_SHOWN_H
#define SHD_RENDER_SHOW_SHOWN_H

#include "plan/bound.h"
#include "render/engine.h"

struct shd_showing;

/* What does not turn out to be a matrix and a known curve is left unknown. */
shd_shown shd_shown_of(const struct shd_showing *showing);

/* For each output of the scene, in the request's arena. SHD_MEMORY, or what a transform cannot be
 * made for. */
shd_status shd_shown_make(const shd_request *request, const shd_scene *scene, const shd_shown **out,
                          shd_error *error);

/* The scene's plan, for its outputs. `request->plan` is set. */
shd_status shd_request_plan_make(shd_request *request, const shd_scene *scene, shd_error *error);

#endif
