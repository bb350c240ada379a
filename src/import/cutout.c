#include "import/cutout.h"

#include <spng.h>
#include <stdint.h>
#include <stdlib.h>

#include "import/encode.h"
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

bool shd_cut_out(const void *bytes, size_t size, float factor, float cutoff, void **file,
                 size_t *length) {
    shd_decoded p;
    void *samples = shd_decode_codes(bytes, size, &p);
    bool made = samples && p.alpha;
    if (made) cut(&p, samples, factor, cutoff);
    if (made) {
        const shd_png_head head = {p.width, p.height, 8, SPNG_COLOR_TYPE_GRAYSCALE};
        made = shd_encode_png(&head, samples, (size_t)p.width * (size_t)p.height, file, length);
    }
    free(samples);
    return made;
}
