/* zlib streams (RFC 1950) by libdeflate, which compresses all that it is given in one call and
 * cannot be interrupted: long data are cut into pieces, each compressed by a call of its own, side
 * by side where others help. How they are cut depends on their length alone, and so do the bytes.
 */
#ifndef SHD_IMAGE_ZLIB_H
#define SHD_IMAGE_ZLIB_H

#include "image/image.h"

/* What of scratch is taken for as many bytes. */
uint64_t shd_zlib_scratch(uint64_t size);

/* The stream, in scratch memory. `image` says who helps, and is asked whether to go on. */
shd_status shd_zlib_compress(const shd_image *image, shd_bytes data, shd_arena *scratch,
                             shd_bytes *out, shd_error *error);

#endif
