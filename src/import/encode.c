#include "import/encode.h"

#include <spng.h>
#include <stdint.h>

bool shd_encode_png(const shd_png_head *head, const void *samples, size_t size, void **file,
                    size_t *length) {
    struct spng_ihdr info = {.width = (uint32_t)head->width,
                             .height = (uint32_t)head->height,
                             .bit_depth = (uint8_t)head->depth,
                             .color_type = (uint8_t)head->color};
    spng_ctx *writer = spng_ctx_new(SPNG_CTX_ENCODER);
    int failed = !writer;
    *file = NULL;
    if (!failed) failed = spng_set_option(writer, SPNG_ENCODE_TO_BUFFER, 1);
    /* Normals are some noise on slopes: a third of zlib's usual time, and no more bytes. */
    if (!failed && head->depth == 16)
        failed = spng_set_option(writer, SPNG_IMG_COMPRESSION_LEVEL, 1) ||
                 spng_set_option(writer, SPNG_FILTER_CHOICE, SPNG_FILTER_CHOICE_SUB);
    if (!failed) failed = spng_set_ihdr(writer, &info);
    if (!failed)
        failed = spng_encode_image(writer, samples, size, SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
    if (!failed) *file = spng_get_png_buffer(writer, length, &failed);
    spng_ctx_free(writer);
    return *file;
}
