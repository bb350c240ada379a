/* Outputs that show a scope of what they would display. */
#pragma once

#include "image/image.h"
#include "render/tiles/film.h"

/* Makes *samples, [height][width][3] of 8 bits in the arena, of a film that has floats.
 * SHD_MEMORY, SHD_CANCELLED, or the reason why there is no transform. */
shd_status shd_scope_make(shd_rendering *r, const shd_film *film, const shd_output *output,
                          const void **samples, shd_error *error);

/* The bytes of the arena that it takes, but for lines that are drawn. */
uint64_t shd_scope_size(const shd_output *output, uint64_t pixels);

/* A scope is a picture of its own: opaque, and of the web's sRGB. */
void shd_scope_describe(const shd_rendering *r, const shd_output *output, shd_image *image);
