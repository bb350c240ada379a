/* zlib streams (RFC 1950). Long data are cut into pieces, each of which is compressed by a call of
 * its own that cannot be interrupted, side by side if others help. Cuts depend on the data's length
 * and the compression alone, so that others change no byte. */
#pragma once

#include "image/image.h"

/* The bytes of scratch that so many bytes of data take. */
uint64_t shd_zlib_scratch(const shd_image *image, uint64_t size);

/* Makes the stream, in scratch memory. `image` says who helps, how much to compress (PNG's
 * `compression`), and is asked whether to go on. Bytes that are `pixel`, 1 to 8, apart are likely
 * alike; `wide`: they are samples of two bytes. */
shd_status shd_zlib_compress(const shd_image *image, shd_bytes data, size_t pixel, bool wide,
                             shd_arena *scratch, shd_bytes *out, shd_error *error);
