#include "import/metal.h"

#include <math.h>
#include <spng.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "base/transfer.h"
#include "import/encode.h"
#include "import/import.h"
#include "import/mean.h"

/* A decoded file; `samples` NULL: there is none. */
typedef struct plate {
    shd_decoded head;
    void *samples;
} plate;

static bool open_plate(const shd_metal_source *from, plate *out) {
    *out = (plate){.samples = NULL};
    if (!from->bytes) return true;
    out->samples = shd_decode_codes(from->bytes, from->size, &out->head);
    return out->samples;
}

/* The code of a channel, over the largest; greys have it in all. 1: there is no file. */
static double code_at(const plate *p, size_t x, size_t y, int channel) {
    if (!p->samples) return 1;
    const size_t count = (size_t)p->head.count, colors = count - (size_t)p->head.alpha,
                 at = (y * (size_t)p->head.width + x) * count + (colors < 3 ? 0 : (size_t)channel);
    return p->head.depth == SHD_U8 ? ((const uint8_t *)p->samples)[at] / 255.0
                                   : ((const uint16_t *)p->samples)[at] / 65535.0;
}

static bool varies(const plate *metal) {
    const double first = code_at(metal, 0, 0, 2);
    if (!metal->samples) return false;
    for (size_t y = 0; y < (size_t)metal->head.height; y++)
        for (size_t x = 0; x < (size_t)metal->head.width; x++)
            if (code_at(metal, x, y, 2) != first) return true;
    return false;
}

/* What the fit makes of colors, which it does not look at: of f0 what rough facets scatter, and
 * what they leave to what is beneath, which goes with 1 - f0. */
typedef struct shares {
    double scattered, left, f0;
} shares;

static shares find_shares(const shd_model_material *material) {
    shd_model_material all = *material;
    shd_import_material made;
    shares out;
    for (int c = 0; c < 3; c++) all.diffuse[c] = 1;
    all.metallic = 1;
    shd_import_material_of(&all, false, &made);
    out.scattered = made.light.diffuse[0];
    all.metallic = 0;
    shd_import_material_of(&all, false, &made);
    out.f0 = made.light.specular[0];
    out.left = (made.light.diffuse[0] - out.f0 * out.scattered) / (1 - out.f0);
    return out;
}

static uint8_t encode(double linear) {
    return (uint8_t)lround(255 * shd_curve_encode(SHD_TRANSFER_SRGB, fmin(fmax(linear, 0), 1)));
}

typedef struct splitting {
    const plate *base, *metal;
    const float *color; /* factors */
    double metallic;
    shares shares;
    size_t width, height;
    uint8_t *beneath, *mirrored; /* [height][width][3] */
} splitting;

static void split_texel(const splitting *s, size_t x, size_t y) {
    const shd_decoded *metal = &s->metal->head;
    const size_t mx = x * (size_t)metal->width / s->width,
                 my = y * (size_t)metal->height / s->height;
    const double m = fmin(s->metallic * code_at(s->metal, mx, my, 2), 1);
    for (int c = 0; c < 3; c++) {
        double color = (double)s->color[c];
        color *= shd_curve_decode(SHD_TRANSFER_SRGB, code_at(s->base, x, y, c));
        color = fmin(color, 1);
        const double f0 = s->shares.f0 + (color - s->shares.f0) * m,
                     beneath = color * (1 - m) * (1 - f0) * s->shares.left;
        const size_t at = 3 * (y * s->width + x) + (size_t)c;
        s->mirrored[at] = encode(f0);
        s->beneath[at] = encode(beneath + f0 * s->shares.scattered);
    }
}

static bool write_split(const splitting *s, shd_metal *out) {
    const size_t size = 3 * s->width * s->height;
    const shd_png_head head = {(int)s->width, (int)s->height, 8, SPNG_COLOR_TYPE_TRUECOLOR};
    for (size_t y = 0; y < s->height; y++)
        for (size_t x = 0; x < s->width; x++) split_texel(s, x, y);
    if (!shd_encode_png(&head, s->beneath, size, &out->beneath, &out->beneath_size)) return false;
    if (shd_encode_png(&head, s->mirrored, size, &out->mirrored, &out->mirrored_size)) return true;
    free(out->beneath);
    *out = (shd_metal){.beneath = NULL};
    return false;
}

/* What is all metal, or none, has one picture that both colors follow. */
static bool is_between(const plate *base, const plate *metal, double factor) {
    const double m = factor * code_at(metal, 0, 0, 2);
    return base->samples && m > 0 && m < 1;
}

bool shd_split_metal(const shd_metal_source *base, const shd_metal_source *metal,
                     const shd_model_material *material, shd_metal *out) {
    plate color, blue = {.samples = NULL};
    *out = (shd_metal){.beneath = NULL};
    bool made = open_plate(base, &color) && open_plate(metal, &blue) &&
                (varies(&blue) || is_between(&color, &blue, (double)metal->factor[0]));
    if (made) {
        const shd_decoded *head = color.samples ? &color.head : &blue.head;
        splitting s = {.base = &color,
                       .metal = &blue,
                       .color = base->factor,
                       .metallic = (double)metal->factor[0],
                       .shares = find_shares(material),
                       .width = (size_t)head->width,
                       .height = (size_t)head->height};
        s.beneath = malloc(3 * s.width * s.height);
        s.mirrored = malloc(3 * s.width * s.height);
        made = s.beneath && s.mirrored && write_split(&s, out);
        free(s.beneath);
        free(s.mirrored);
    }
    free(color.samples);
    free(blue.samples);
    return made;
}
