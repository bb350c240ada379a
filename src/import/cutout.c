#include "import/cutout.h"

#include <spng.h>
#include <stdint.h>
#include <stdlib.h>

#include "import/mean.h"

/* In place: what is made of a pixel is never longer than the pixel. */
static void cut(const shd_decoded *p, void *samples, float factor, float cutoff) {
    const size_t count = (size_t)p->count, pixels = (size_t)p->width * (size_t)p->height;
    const uint8_t *codes = samples;
    const uint16_t *deep = samples;
    uint8_t *out = samples;
    for (size_t i = 0; i < pixels; i++) {
        const size_t at = (i + 1) * count - 1;
        const float alpha = p->depth == SHD_U8 ? codes[at] / 255.0f : deep[at] / 65535.0f;
        out[i] = alpha * factor >= cutoff ? 255 : 0;
    }
}

static bool write_png(const shd_decoded *p, const void *codes, void **file, size_t *length) {
    struct spng_ihdr head = {.width = (uint32_t)p->width,
                             .height = (uint32_t)p->height,
                             .bit_depth = 8,
                             .color_type = SPNG_COLOR_TYPE_GRAYSCALE};
    spng_ctx *writer = spng_ctx_new(SPNG_CTX_ENCODER);
    int failed = !writer;
    *file = NULL;
    if (!failed) failed = spng_set_option(writer, SPNG_ENCODE_TO_BUFFER, 1);
    if (!failed) failed = spng_set_ihdr(writer, &head);
    if (!failed)
        failed = spng_encode_image(writer, codes, (size_t)p->width * (size_t)p->height,
                                   SPNG_FMT_PNG, SPNG_ENCODE_FINALIZE);
    if (!failed) *file = spng_get_png_buffer(writer, length, &failed);
    spng_ctx_free(writer);
    return *file;
}

bool shd_cut_out(const void *bytes, size_t size, float factor, float cutoff, void **file,
                 size_t *length) {
    shd_decoded p;
    void *samples = shd_decode_codes(bytes, size, &p);
    bool made = samples && p.alpha;
    if (made) cut(&p, samples, factor, cutoff);
    if (made) made = write_png(&p, samples, file, length);
    free(samples);
    return made;
}
