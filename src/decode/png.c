/* PNG, by libspng. What chunks say of colors is not looked at: documents and operators do. */
#include <spng.h>
#include <stdlib.h>

#include "decode/decode.h"

/* Bytes of one chunk that is no pixels, and of all of them. */
enum { CHUNK_MOST = 8 << 20, CHUNKS_MOST = 16 << 20, SIDE_MOST = 0x7fffffff };

/* The samples that the file has, in 8 bits if they are fewer; a palette becomes colors, and a color
 * that is to be transparent an alpha. */
static int choose_form(const struct spng_ihdr *head, bool has_key, shd_decoded *picture) {
    const bool grey = head->color_type == SPNG_COLOR_TYPE_GRAYSCALE ||
                      head->color_type == SPNG_COLOR_TYPE_GRAYSCALE_ALPHA;
    const bool has_alpha = head->color_type == SPNG_COLOR_TYPE_GRAYSCALE_ALPHA ||
                           head->color_type == SPNG_COLOR_TYPE_TRUECOLOR_ALPHA;
    const bool deep = head->bit_depth == 16;
    picture->width = (int32_t)head->width;
    picture->height = (int32_t)head->height;
    picture->depth = deep ? SHD_U16 : SHD_U8;
    picture->alpha = has_alpha || has_key;
    picture->count = (grey ? 1 : 3) + picture->alpha;
    if (has_key && grey) return deep ? SPNG_FMT_GA16 : SPNG_FMT_GA8;
    if (has_key) return deep ? SPNG_FMT_RGBA16 : SPNG_FMT_RGBA8;
    if (head->bit_depth < 8 && grey) return SPNG_FMT_G8;
    return head->color_type == SPNG_COLOR_TYPE_INDEXED ? SPNG_FMT_RGB8 : SPNG_FMT_PNG;
}

static shd_status decode_with(spng_ctx *reader, const shd_decoder *decoder, shd_decoded *picture,
                              void **samples, shd_error *error) {
    struct spng_ihdr head;
    struct spng_trns key;
    int failed = spng_get_ihdr(reader, &head);
    const int keyed = failed ? 0 : spng_get_trns(reader, &key);
    if (keyed && keyed != SPNG_ECHUNKAVAIL) failed = keyed;
    if (failed) return shd_fail(error, SHD_SCENE, "", "PNG: %s", spng_strerror(failed));
    const int form = choose_form(&head, !keyed, picture);
    const shd_status status = shd_decode_admit(decoder, picture, error);
    if (status != SHD_OK) return status;
    size_t bytes, wanted;
    if (!(*samples = shd_decode_room(picture, &bytes)))
        return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    failed = spng_decoded_image_size(reader, form, &wanted);
    if (!failed && wanted != bytes)
        return shd_fail(error, SHD_SCENE, "", "PNG: its samples are of a kind that is not read");
    if (!failed)
        failed = spng_decode_image(reader, *samples, bytes, form, keyed ? 0 : SPNG_DECODE_TRNS);
    if (!failed) failed = spng_decode_chunks(reader); /* up to its end */
    if (!failed) return SHD_OK;
    return failed == SPNG_EMEM ? shd_fail(error, SHD_EXHAUSTED, "", "out of memory")
                               : shd_fail(error, SHD_SCENE, "", "PNG: %s", spng_strerror(failed));
}

shd_status shd_decode_png(const shd_decoder *decoder, const unsigned char *data, size_t size,
                          shd_decoded *picture, void **samples, shd_error *error) {
    spng_ctx *reader = spng_ctx_new(0);
    if (!reader) return shd_fail(error, SHD_EXHAUSTED, "", "out of memory");
    spng_set_image_limits(reader, SIDE_MOST, SIDE_MOST);
    spng_set_chunk_limits(reader, CHUNK_MOST, CHUNKS_MOST);
    spng_set_png_buffer(reader, data, size);
    const shd_status status = decode_with(reader, decoder, picture, samples, error);
    spng_ctx_free(reader);
    if (status != SHD_OK) {
        free(*samples);
        *samples = NULL;
    }
    return status;
}
