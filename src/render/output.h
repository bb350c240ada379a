/* From the film to a file: an output's colors, its layers, its bytes. */
#ifndef SHD_RENDER_OUTPUT_H
#define SHD_RENDER_OUTPUT_H

#include "render/film.h"

/* Makes picture `index` of the request from the film. Call in order: the last picture is made in
 * the film's own pixels. Adds to the request's times and saturated count. */
shd_status shd_output_make(shd_request *request, const shd_film *film, size_t index,
                           shd_error *error);

#endif
