/* How an output's colors come from the working space's. */
#pragma once

#include "render/rendering.h"

/* From the working space to the output's own, or to what its integers store of that, adjusted as it
 * says. It is good for as long as the rendering's request. */
shd_status shd_output_transform(const shd_rendering *r, const shd_scene *scene,
                                const shd_output *output, const shd_color_transform **out,
                                shd_error *error);

/* Whether pixels are laid over the matte before their colors are converted: neither does the format
 * hold alpha nor is that the channel asked for. */
bool shd_output_is_flat(const shd_scene *scene, const shd_output *output);
void shd_output_flatten(const double matte[3], float *rgba, size_t pixels);
