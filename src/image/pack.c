#include "image/pack.h"

#include <float.h>
#include <string.h>

#include "base/sample.h"
#include "image/spread.h"

enum { BLOCK = 64 }; /* pixels that are quantized before their channels are picked */

shd_pack shd_pack_plan(const shd_image *image, bool premultiply, bool grey) {
    const float limit = image->depth == SHD_HALF ? 65504.0f : FLT_MAX;
    shd_pack pack = {.bytes = 4, .limit = limit, .least = -limit};
    if (image->depth == SHD_U8) pack.bytes = 1, pack.max = 255;
    if (image->depth == SHD_U16) pack.bytes = 2, pack.max = 65535;

    const bool all = image->channel < 0;
    for (; pack.count < (all || !grey ? 3 : 1); pack.count++)
        pack.source[pack.count] = all ? pack.count : image->channel;
    pack.alpha = image->alpha && image->channel != 3;
    pack.premultiply = pack.alpha && premultiply;
    if (pack.alpha) pack.source[pack.count++] = 3;
    return pack;
}

shd_pack shd_pack_of(const shd_image *image, shd_format format) {
    const shd_format_info *info = shd_format_get(format);
    return shd_pack_plan(image, info->premultiplied, info->grey);
}

/* Codes of all four channels of up to BLOCK pixels. */
static void quantize_straight(const shd_pack *pack, const float *restrict rgba, int pixels,
                              int32_t *restrict codes) {
    const double max = pack->max;
    for (int i = 0; i < 4 * pixels; i++) codes[i] = shd_code(rgba[i] * max, max);
}

/* The same with the encoded value multiplied by alpha. */
static void quantize_premultiplied(const shd_pack *pack, const float *rgba, int pixels,
                                   int32_t *codes) {
    for (int i = 0; i < pixels; i++) {
        double alpha = shd_hold(rgba[4 * i + 3], 1);
        for (int c = 0; c < 3; c++) {
            double x = shd_hold(rgba[4 * i + c] * pack->max, pack->max);
            codes[4 * i + c] = (int32_t)(x * alpha + 0.5);
        }
        codes[4 * i + 3] = (int32_t)(alpha * pack->max + 0.5);
    }
}

/* Picks `count` of every four samples of `bytes` bytes. The color samples that most pictures keep
 * are copied four at a time, except for the last pixel: the next pixel overwrites the fourth. */
static void pick_channels(const shd_pack *pack, const void *quads, size_t bytes, int pixels,
                          unsigned char *to) {
    const unsigned char *from = quads;
    const bool color = pack->count >= 3 && pack->source[0] == 0 && pack->source[1] == 1;
    const size_t quad = 4 * bytes, step = (size_t)pack->count * bytes;
    if (color && pack->count == 4) {
        memcpy(to, from, quad * (size_t)pixels);
    } else if (color && bytes == 1) {
        for (int i = 0; i < pixels - 1; i++) memcpy(to + 3 * i, from + 4 * i, 4);
        memcpy(to + 3 * (pixels - 1), from + 4 * (pixels - 1), 3);
    } else if (color) {
        for (int i = 0; i < pixels - 1; i++) memcpy(to + 6 * i, from + 8 * i, 8);
        memcpy(to + 6 * (pixels - 1), from + 8 * (pixels - 1), 6);
    } else {
        for (int i = 0; i < pixels; i++)
            for (int s = 0; s < pack->count; s++)
                memcpy(to + (size_t)i * step + (size_t)s * bytes,
                       from + (size_t)i * quad + (size_t)pack->source[s] * bytes, bytes);
    }
}

/* A row of codes of 8 or 16 bits. */
static void pack_codes(const shd_pack *pack, const float *rgba, int width, unsigned char *out) {
    int32_t codes[4 * BLOCK];
    uint8_t bytes[4 * BLOCK];
    uint16_t words[4 * BLOCK];
    for (int x = 0; x < width; x += BLOCK) {
        const int pixels = width - x < BLOCK ? width - x : BLOCK;
        if (pack->premultiply)
            quantize_premultiplied(pack, rgba + 4 * (size_t)x, pixels, codes);
        else
            quantize_straight(pack, rgba + 4 * (size_t)x, pixels, codes);
        if (pack->bytes == 1) {
            for (int i = 0; i < 4 * pixels; i++) bytes[i] = (uint8_t)codes[i];
            pick_channels(pack, bytes, sizeof *bytes, pixels, out);
        } else {
            for (int i = 0; i < 4 * pixels; i++) words[i] = (uint16_t)codes[i];
            pick_channels(pack, words, sizeof *words, pixels, out);
        }
        out += (size_t)(pixels * pack->count) * pack->bytes;
    }
}

static void pack_floats(const shd_pack *pack, const float *rgba, int width, float *out) {
    const float limit = pack->limit, least = pack->least;
    for (int i = 0; i < width; i++, rgba += 4, out += pack->count) {
        float alpha = pack->premultiply ? rgba[3] : 1;
        for (int s = 0; s < pack->count; s++) {
            float v = rgba[pack->source[s]];
            if (!(pack->alpha && s == pack->count - 1)) v *= alpha;
            out[s] = v > limit ? limit : v < least ? least : v;
        }
    }
}

void shd_pack_row(const shd_pack *pack, const float *rgba, int width, void *out) {
    if (pack->max > 0)
        pack_codes(pack, rgba, width, out);
    else
        pack_floats(pack, rgba, width, out);
}

/* Bands of rows, side by side. */
typedef struct packing {
    const shd_pack *pack;
    const shd_image *image;
    size_t row, rows; /* bytes of a row, rows of a band */
    unsigned char *out;
} packing;

static void pack_band(void *context, size_t index, unsigned slot) {
    (void)slot;
    const packing *p = context;
    const size_t first = index * p->rows, height = (size_t)p->image->height;
    const size_t end = height - first < p->rows ? height : first + p->rows;
    const unsigned char *samples = p->image->samples;
    if (samples) memcpy(p->out + first * p->row, samples + first * p->row, (end - first) * p->row);
    for (size_t y = first; !samples && y < end; y++)
        shd_pack_row(p->pack, p->image->rgba + 4 * y * (size_t)p->image->width, p->image->width,
                     p->out + y * p->row);
}

shd_status shd_pack_rows(const shd_pack *pack, const shd_image *image, void *out,
                         shd_error *error) {
    enum { BAND = 1 << 16 }; /* pixels between two questions whether to go on */
    const size_t width = (size_t)image->width, height = (size_t)image->height;
    const size_t row = width * (size_t)pack->count * pack->bytes;
    packing p = {pack, image, row, 1 + BAND / width, out};
    const size_t bands = (height + p.rows - 1) / p.rows;
    return shd_encode_spread(image, bands, pack_band, &p) ? SHD_OK : shd_encode_cancelled(error);
}

shd_status shd_pack_samples(const shd_pack *pack, const shd_image *image, shd_arena *scratch,
                            const void **out, shd_error *error) {
    *out = image->samples;
    if (image->samples) return SHD_OK;
    const size_t pixels = (size_t)image->width * (size_t)image->height;
    void *rows = shd_arena_alloc(scratch, pixels, (size_t)pack->count * pack->bytes);
    *out = rows;
    return rows ? shd_pack_rows(pack, image, rows, error) : shd_encode_no_memory(error);
}
