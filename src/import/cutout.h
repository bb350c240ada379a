/* The inside of the module: pictures of what is cut out. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

/* Of a PNG, JPEG or WebP file with an alpha: a grey PNG of its size, white where that alpha times
 * `factor` is `cutoff` or more, else black. *file is malloc'ed. False: it is another file, damaged
 * or too large, or there is no memory. */
bool shd_cut_out(const void *bytes, size_t size, float factor, float cutoff, void **file,
                 size_t *length);
