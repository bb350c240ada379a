/* Pictures from the bytes of files, in the process that shaded-decode is: what is wrong with a file
 * is told, and what is worse ends nobody else.
 *
 * PNG goes through libspng, JPEG through libjpeg-turbo and WebP through libwebp, which are there in
 * a millisecond. TIFF, OpenEXR and Radiance HDR go through OpenImageIO's module, which takes
 * 300 ms to load. Formats are told by a file's first bytes; others are not read. */
#pragma once

#include <stdbool.h>
#include <stddef.h>

#include "base/status.h"
#include "decode/wire.h"
#include "image/oiio.h"

typedef struct shd_decoder {
    size_t most;              /* pixels */
    shd_oiio_decode_fn *oiio; /* the module's; NULL: it is not there */
    /* Called once the file's head is known and before what follows it is decoded; *picture is
     * whole. False ends decoding with SHD_CANCELLED. */
    bool (*admit)(void *context, const shd_decoded *picture);
    void *context;
} shd_decoder;

/* Decodes; the caller frees *samples. SHD_SCENE: the bytes are no whole picture of a format that is
 * read here. SHD_LIMIT: it has more pixels. SHD_EXHAUSTED; SHD_CANCELLED. */
shd_status shd_decode(const shd_decoder *decoder, const unsigned char *data, size_t size,
                      shd_decoded *picture, void **samples, shd_error *error);

/* Inside: one a format, of the bytes of such a file, with *picture and *samples zero. */
typedef shd_status shd_decode_fn(const shd_decoder *decoder, const unsigned char *data, size_t size,
                                 shd_decoded *picture, void **samples, shd_error *error);
shd_decode_fn shd_decode_png, shd_decode_jpeg, shd_decode_webp;

/* Inside: what the lengths in a file tell, before anything of it is decoded: SHD_SCENE if it ends
 * early, or is one that takes far longer than it is large. SHD_OK: all may be well. At least a
 * format's first bytes are there. */
shd_status shd_decode_walk(shd_format format, const unsigned char *data, size_t size,
                           shd_error *error);
shd_status shd_decode_walk_tiff(const unsigned char *data, size_t size, shd_error *error);
/* The same of what was admitted, where looking takes far less than decoding; of a format's whole
 * first bytes. */
typedef shd_status shd_decode_check_fn(const unsigned char *data, size_t size, shd_error *error);
shd_decode_check_fn shd_decode_check_exr, shd_decode_check_tiff;

shd_status shd_decode_ends_early(const char *format, shd_error *error);

/* Inside: whether the head is one that is read here, and its decoding is to go on. */
shd_status shd_decode_admit(const shd_decoder *decoder, const shd_decoded *picture,
                            shd_error *error);

/* Inside: room for its samples; NULL: there is none. */
void *shd_decode_room(const shd_decoded *picture, size_t *bytes);
