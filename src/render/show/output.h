/* From the film to a file: an output's colors, its layers, its bytes. */
#pragma once

#include "image/image.h"
#include "render/tiles/film.h"

/* The way of an output's colors, for rendering, estimates and explanations. */
typedef struct shd_route {
    bool codes; /* the output's samples are looked up in tables, not converted in floats */
    bool film;  /* the film has floats; if not, tiles store the samples of the only output */
} shd_route;

/* `apart`: whether, as far as the caller knows, each channel of the output depends on the same
 * channel of the film alone. */
shd_route shd_route_of(const shd_scene *scene, const shd_output *output, bool apart);

/* Makes the picture of the scene's output `index` from the film. Call in order: the last picture is
 * made in the film's own pixels. Adds to r->times and its counts. */
shd_status shd_output_make(shd_rendering *r, const shd_film *film, size_t index, shd_picture *out,
                           shd_error *error);

/* The same without a file: *out has `rgba` or `samples` of the arena. It is encoded for `r`, unless
 * another rendering takes it over, which outlives its texts. */
shd_status shd_output_paint(shd_rendering *r, const shd_film *film, size_t index, shd_image *out,
                            shd_error *error);
void shd_output_hand_over(shd_rendering *r, shd_image *image);

/* Before the film is rendered: makes its samples if the tiles store those of the only output at
 * once. SHD_MEMORY. */
shd_status shd_output_prepare(shd_rendering *r, shd_film *film, shd_error *error);

/* The most bytes of the arena that any one of the pictures takes, without its file and what depends
 * on the values of pixels. What was prepared is not counted. */
shd_status shd_output_size(shd_rendering *r, const shd_film *film, uint64_t *out, shd_error *error);

/* Adds less than half a code of 8 bits to the colors of pixels `first` to `end` of the picture, of
 * which rgba has the first one at its beginning. */
void shd_output_dither(const shd_raster *raster, float *rgba, size_t first, size_t end);

/* How many of the output's layers are colors, which are converted as the picture is. */
size_t shd_output_color_layers(const shd_output *output);
