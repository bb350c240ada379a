/* A picture that is compared with another one: what it shows, as light. */
#pragma once

#include "render/request.h"

typedef struct shd_side {
    int width, height;
    float *rgb;   /* [height][width][3]: linear, in sRGB's primaries, over black; the white of the
                   * picture's encoding is 1, 1, 1. Beyond [0,1] where its gamut is */
    float *alpha; /* [height][width] */
} shd_side;

/* Renders the request's scene, as the codes of its output have it before any codec: *out and its
 * memory are of the request's arena. SHD_SCENE: the output shows no color. Other errors are of
 * shd_request_analyze. */
shd_status shd_side_render(shd_request *request, const shd_render_options *options, shd_side **out,
                           shd_error *error);

/* Takes the picture of a name, which is as in shd_picture_wish; samples as below. Errors are of
 * shd_request_texels, too. */
shd_status shd_side_open(shd_request *request, const char *name, shd_side **out, shd_error *error);

/* Reads a file, whose samples have 8 or 16 bits and are taken for sRGB. SHD_SCENE: it cannot be
 * read, or has other samples; or it is above the limit of pixels: SHD_LIMIT. SHD_MEMORY. */
shd_status shd_side_read(shd_request *request, const char *path, shd_format format, shd_side **out,
                         shd_error *error);
