/* Samples of the picture in a file that somebody at the machine names: for what compares pictures,
 * verifies them or takes them for photos. PNG, JPEG and WebP are decoded by a process of their own
 * (assets/decoder.h), so that what is wrong with a file is one sentence and no library's own line;
 * the others by OpenImageIO in this one (image/read.h). */
#pragma once

#include "image/read.h"
#include "render/request.h"

/* The picture is to be `width` x `height`, or with the width 0 of any size up to the limit
 * `pixels`. The caller frees out->values. SHD_SCENE: it cannot be read, or is of another size.
 * SHD_LIMIT, SHD_EXHAUSTED, SHD_CANCELLED. */
shd_status shd_sample_file_read(shd_request *request, const char *path, shd_format format,
                                int width, int height, shd_samples *out, shd_error *error);
