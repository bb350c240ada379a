/* Maps of environments that are pictures, which documents name.
 *
 * A map has fewer texels than its picture, or other ones, in the scene's working space
 * (scene/surroundings.h). It is kept with tables of environments, so that its picture is decoded
 * once, and stays as long as a request that has it. */
#pragma once

#include "render/request.h"
#include "scene/surroundings.h"

/* The map of the picture that a document names, of about `rows` rows (shd_surroundings_rows), which
 * the request holds until it is dropped. A map that it has is found again at once. Errors are those
 * of shd_request_texels, and SHD_SCENE for a picture that is not twice as wide as high. The
 * request's thread. */
shd_status shd_request_map(shd_request *request, const char *name, const shd_space_info *working,
                           int rows, const shd_surroundings **out, shd_error *error);

/* Drops all of them. */
void shd_request_drop_maps(shd_request *request);
